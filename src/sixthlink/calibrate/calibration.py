"""What does a calibration leave behind? Numbers, and the evidence for each of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.head import Certificate, Scatter, SearchReport
from sixthlink.calibrate.heldout_error import HeldOut
from sixthlink.calibrate.joint import JointEvidence
from sixthlink.calibrate.unobserved import Unobserved, changing
from sixthlink.camera import LENS_NAMES, CameraRig
from sixthlink.geometry import Floats, frozen_floats
from sixthlink.recording import EYE_IN_HAND, Rejection
from sixthlink.robot import (
    Arm,
    HeadLink,
    PaperNumbers,
    head_link_from_transform,
    last_link,
    paper_numbers_from_transform,
)

__all__ = [
    "BoardEvidence",
    "Calibration",
    "CameraEvidence",
    "Gate",
    "ShotEvidence",
    "head_link_of",
    "observed_positions",
    "paper_numbers_of",
    "unobserved_names",
    "unobserved_of",
]


@dataclass(frozen=True)
class Gate:
    """One question that a calibration must answer with yes before it is accepted.

    Attributes:
        name: Short name.
        passed: The answer.
        message: The figure it rests on and its limit; where it refuses, also what to do.
    """

    name: str
    passed: bool
    message: str


@dataclass(frozen=True)
class BoardEvidence:
    """What the recording says of the board itself.

    Attributes:
        scale: True over declared size, by the robot's motion; None where it was not asked.
        scale_std: Standard deviation of it, or None.
        sag_m: Largest minus smallest height of its points over a flat board, corrected [m]; 0 where none shows.
        sag_std_m: Standard deviation of it [m].
        moved_m: How far the head would be off if the board counted as flat [m]; None where it does not matter.
        moved_rad: The same for its direction [rad], or None.
    """

    scale: float | None = None
    scale_std: float | None = None
    sag_m: float = 0.0
    sag_std_m: float = 0.0
    moved_m: float | None = None
    moved_rad: float | None = None


@dataclass(frozen=True, eq=False)
class CameraEvidence:
    """How one camera's numbers came about.

    Attributes:
        calibrated: Whether the intrinsics were calibrated here rather than given.
        images: Number of images used.
        rms_px: RMS pixel residual per coordinate [pixel], 0 when given.
        std: ``(16,)`` standard deviation of fx, fy, cx, cy [pixel] and the terms of distortion [-]; 0 when given or
            fixed.
    """

    calibrated: bool
    images: int
    rms_px: float
    std: Floats

    def __post_init__(self) -> None:
        whole = np.pad(np.asarray(self.std, dtype=np.float64), (0, len(LENS_NAMES) - len(self.std)))
        object.__setattr__(self, "std", frozen_floats(whole, (len(LENS_NAMES),), "std"))


@dataclass(frozen=True)
class ShotEvidence:
    """How one used shot fits.

    Attributes:
        shot: Id of the shot.
        placement: Name of the target's placement.
        translation_m: Distance of its target pose to the placement's mean [m].
        rotation_rad: Angle of its target pose to the placement's mean [rad].
        rms_px: RMS pixel residual of its target pose [pixel]; 0 when poses were recorded instead of pixels.
        points: Number of points seen; 0 when poses were recorded.
        turns: Turns by which the names of a symmetric target's points were turned in this shot.
    """

    shot: str
    placement: str
    translation_m: float
    rotation_rad: float
    rms_px: float
    points: int
    turns: int


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated head on an arm.

    Attributes:
        recording: Name of the recording.
        mount: ``eye-in-hand`` or ``eye-to-hand``.
        solver: Which estimator gave the answer.
        X: ``(4, 4)`` the head: T_flange_head (eye-in-hand) or T_base_head (eye-to-hand).
        arm: Kinematics that the flange poses were computed with, or None when the controller's were used.
        rig: The head's cameras, or None when target poses were recorded.
        cameras: Evidence per camera of the rig.
        stereo_rms_px: RMS pixel residual of the cameras together [pixel], 0 with one camera.
        placements: Names of the target's placements.
        Ts_base_target: ``(P, 4, 4)`` target per placement: T_base_target, or T_flange_target for eye-to-hand.
        value_m2: Eq. (11) at the answer [m²].
        rotation_length_m: ℓ of eq. (11) [m].
        pairs: Pairs of shots that eq. (11) sums over.
        search: What the swarms did, or None where none searched.
        certificate: Whether the answer is proven to be the global minimum of eq. (11).
        shots: Evidence per used shot.
        rejections: Images and shots that were not used, and why.
        gates: Whether the calibration is accepted.
        inputs: SHA-256 of every input file by name.
        versions: Versions of sixthlink and of the libraries it ran on.
        unobserved: What the motion does not show, held by convention in ``X`` and ``Ts_base_target`` and nowhere to be
            printed (:func:`unobserved_of`); None where the whole head was seen.
        joint: Proof of a joint estimate of arm, head and placements; None for the head alone.
        heldout: Error on shots that were kept out of the fit, or None.
        print_sigma_m: Standard deviation of the target's misprints per coordinate, found in the images and corrected
            [m]; 0 where none shows.
        board: What the recording says of the board itself.
        tracker_points: Points of a laser tracker that entered the same problem; 0 without a tracker.
        scale_shots: Names of the shots of scale bars that the estimate used.
        notes: What a user should know of the image files.
    """

    recording: str
    mount: str
    solver: str
    X: Floats
    arm: Arm | None
    rig: CameraRig | None
    cameras: tuple[CameraEvidence, ...]
    stereo_rms_px: float
    placements: tuple[str, ...]
    Ts_base_target: Floats
    value_m2: float
    rotation_length_m: float
    pairs: int
    search: SearchReport | None
    certificate: Certificate
    shots: tuple[ShotEvidence, ...]
    rejections: tuple[Rejection, ...]
    gates: tuple[Gate, ...] = ()
    inputs: dict[str, str] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    unobserved: Unobserved | None = None
    joint: JointEvidence | None = None
    heldout: HeldOut | None = None
    print_sigma_m: float = 0.0
    tracker_points: int = 0
    board: BoardEvidence = BoardEvidence()
    scale_shots: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "X", frozen_floats(self.X, (4, 4), "X"))
        shape = (len(self.placements), 4, 4)
        object.__setattr__(self, "Ts_base_target", frozen_floats(self.Ts_base_target, shape, "Ts_base_target"))

    @property
    def scatter(self) -> Scatter:
        """Residual of eq. (10) per used shot."""
        return Scatter(np.array([s.translation_m for s in self.shots]), np.array([s.rotation_rad for s in self.shots]))

    @property
    def accepted(self) -> bool:
        """Whether no gate refuses."""
        return all(gate.passed for gate in self.gates)

    @property
    def T_link5_head(self) -> Floats | None:
        """``(4, 4)`` the head in the frame of the last joint, or None for a fixed head.

        Without kinematics the flange stands in for link 5.
        """
        if self.mount != EYE_IN_HAND:
            return None
        return self.X if self.arm is None else last_link(self.arm) @ self.X


def head_link_of(calibration: Calibration) -> HeadLink | None:
    """The head as the arm's sixth link, or None for a fixed head."""
    T = calibration.T_link5_head
    return None if T is None else head_link_from_transform(T)


def paper_numbers_of(calibration: Calibration) -> PaperNumbers | None:
    """The head as the paper's (α, β, γ, x, y, z), or None for a fixed head."""
    T = calibration.T_link5_head
    return None if T is None else paper_numbers_from_transform(T)


def unobserved_of(calibration: Calibration, values_of: Callable[[Calibration], Floats]) -> npt.NDArray[np.bool_]:
    """Which numbers of a calibration were not observed.

    Args:
        calibration: The calibration.
        values_of: Numbers that follow from its head, an array of any shape.

    Returns:
        An array of that shape.
    """
    if calibration.unobserved is None:
        return np.zeros(values_of(calibration).shape, dtype=bool)
    return changing(lambda X: values_of(replace(calibration, X=X)), calibration.X, calibration.unobserved)


def unobserved_names(
    calibration: Calibration, numbers_of: Callable[[Calibration], HeadLink | PaperNumbers | None]
) -> frozenset[str]:
    """Names of the numbers of :func:`head_link_of` or :func:`paper_numbers_of` that were not observed."""
    numbers = numbers_of(calibration)
    if numbers is None or calibration.unobserved is None:
        return frozenset()
    names = [f.name for f in fields(numbers) if f.name != "remark"]

    def values(of: Calibration) -> Floats:
        found = numbers_of(of)
        return np.array([getattr(found, name) for name in names])

    hidden = unobserved_of(calibration, values)
    return frozenset(name for name, unseen in zip(names, hidden, strict=True) if unseen)


def observed_positions(calibration: Calibration) -> tuple[tuple[Floats, float], ...]:
    """Axes in the frame that carries the head along which its position was observed, and the position [m].

    Empty where the whole head was seen, and where nothing of the position was.
    """
    if calibration.unobserved is None:
        return ()
    return tuple((axis, float(axis @ calibration.X[:3, 3])) for axis in calibration.unobserved.axes_across)
