"""What does a calibration from touches leave behind? An arm, and the evidence for each of its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.joint import JointEvidence
from sixthlink.geometry import Floats, frozen_floats
from sixthlink.recording import Rejection
from sixthlink.robot import Arm
from sixthlink.target import LengthStandard

__all__ = ["ArmCalibration", "FixedPoint", "HeldOutTouches", "TouchEvidence"]


@dataclass(frozen=True, eq=False)
class TouchEvidence:
    """How one used touch fits.

    Attributes:
        shot: Id of the shot.
        placement: Name of the place.
        mark: Name of the socket.
        joints: ``(J,)`` joint values [rad or m]; a later reading begins with them.
        before_m: Distance of the ball to its socket under the nominal arm [m].
        after_m: The same under the calibrated arm [m].
    """

    shot: str
    placement: str
    mark: str
    joints: Floats
    before_m: float
    after_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", frozen_floats(self.joints, (None,), "joints"))


@dataclass(frozen=True)
class FixedPoint:
    """Where a socket is.

    Attributes:
        placement: Name of the place.
        mark: Name of the socket.
        position_m: x, y, z in the base frame [m].
    """

    placement: str
    mark: str
    position_m: tuple[float, float, float]


@dataclass(frozen=True)
class HeldOutTouches:
    """Error on touches that were kept out of the fit.

    Attributes:
        shots: How many.
        rms_translation_m: RMS distance of the ball to its socket [m].
    """

    shots: int
    rms_translation_m: float


@dataclass(frozen=True, eq=False)
class ArmCalibration:
    """An arm, and the evidence for it.

    Attributes:
        recording: Name of the recording.
        arm: The calibrated arm.
        nominal: The arm that it started from.
        tool_m: ``(3,)`` centre of the ball in the flange's frame [m].
        standard: Length standard whose distance counted as known, or None.
        points: Where the sockets are.
        touches: The touches that were used.
        smoothness_rad: Change of pose over which the arm's remaining errors stay alike [rad].
        joint: Covariance, noise and every parameter of the arm.
        rejections: Touches that were not used, and why.
        gates: What had to be answered with yes.
        heldout: Error on touches of kind ``judge``, or None.
        inputs: SHA-256 per input file.
        versions: Versions of the software.
    """

    recording: str
    arm: Arm
    nominal: Arm
    tool_m: Floats
    standard: LengthStandard | None
    points: tuple[FixedPoint, ...]
    touches: tuple[TouchEvidence, ...]
    smoothness_rad: float
    joint: JointEvidence
    rejections: tuple[Rejection, ...]
    gates: tuple[Gate, ...]
    heldout: HeldOutTouches | None = None
    inputs: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tool_m", frozen_floats(self.tool_m, (3,), "tool_m"))

    @property
    def accepted(self) -> bool:
        """Whether no gate refuses."""
        return all(gate.passed for gate in self.gates)

    @property
    def rms_before_m(self) -> float:
        """RMS distance of the ball to its socket under the nominal arm [m]."""
        return float(np.sqrt(np.mean([t.before_m**2 for t in self.touches])))

    @property
    def rms_after_m(self) -> float:
        """The same under the calibrated arm [m]."""
        return float(np.sqrt(np.mean([t.after_m**2 for t in self.touches])))
