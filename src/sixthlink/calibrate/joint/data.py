"""What does the joint estimate start from?

What was observed, the noise it carries and from where, what is known of cameras and arm beforehand, and a first state
that needs no guess: the head on which most shots agree under the nominal arm, the tool's point that keeps touched
points still.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint.consensus import consensus
from sixthlink.calibrate.joint.standing import standing
from sixthlink.calibrate.observations import (
    Columns,
    FixedPointTouches,
    JointState,
    MarkSightings,
    MeasuredPoints,
    MeasuredPoses,
    Observations,
    SocketDistances,
    TargetPoseShots,
    carried,
)
from sixthlink.geometry import Floats
from sixthlink.robot import Arm, flange_poses

__all__ = [
    "HeadShots",
    "JointData",
    "looked_at",
    "observations_of",
    "pose_noises",
    "reflector_names",
    "repeatability_of",
    "start_of",
]

UNSTATED_REPEATABILITY_RAD = 1e-4
"""Where the noise estimate starts for an arm whose file states no repeatability."""

FIRST_CONTACT_M = 2e-4
"""Where the noise estimate of touches, and of measured points without a stated noise, starts [m]."""

FIRST_ORIENTATION_RAD = 1e-3
"""Where the noise estimate of measured orientations without a stated noise starts [rad]."""

ROTATION_LENGTH_M = 1.0
"""ℓ of eq. (11) for the start."""


@dataclass(frozen=True, eq=False)
class HeadShots:
    """N shots of a target by the head.

    Attributes:
        joints: ``(N, J)`` joint values [rad or m].
        problem: The shots as eq. (10) sees them under the nominal arm.
        fixed_head: Whether the head stands still and the target rides on the flange.
        covariances: ``(N, 6, 6)`` of the target poses from their pixels, as motions in head axes; None where poses
            were recorded, whose noise is then estimated.
        by_lens: ``(N, 6, g)`` how the poses follow the cameras' free unknowns.
    """

    joints: Floats
    problem: HeadProblem
    fixed_head: bool = False
    covariances: Floats | None = None
    by_lens: Floats = field(default_factory=lambda: np.zeros((0, 6, 0)))


@dataclass(frozen=True, eq=False)
class JointData:
    """Everything observed. At least one of ``shots``, ``touches`` and ``measured`` is there; the rest adds to it.

    Attributes:
        arm: The nominal arm.
        shots: Shots of targets.
        lens_covariance: ``(g, g)`` of the cameras' free unknowns, from the images.
        lens_offset: ``(g,)`` how far the cameras already are from what the images alone say; not at all by default.
        sightings: Marks of a length standard, seen by the head.
        certificate: Their certified distances.
        touches: Touches of fixed points.
        distances: Known distances between touched points.
        measured: Points on the links that an outside instrument measured.
        probed: The same where it measured the orientation too; stations and reflectors are numbered as in ``measured``.
    """

    arm: Arm
    shots: HeadShots | None = None
    lens_covariance: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    lens_offset: Floats = field(default_factory=lambda: np.zeros(0))
    sightings: MarkSightings | None = None
    certificate: SocketDistances | None = None
    touches: FixedPointTouches | None = None
    distances: SocketDistances | None = None
    measured: MeasuredPoints | None = None
    probed: MeasuredPoses | None = None

    def __post_init__(self) -> None:
        if self.shots is None and self.touches is None and not self.outside:
            raise ValueError("a joint calibration needs shots of a target, touches or measured points")
        if not len(self.lens_offset):
            object.__setattr__(self, "lens_offset", np.zeros(len(self.lens_covariance)))

    @property
    def outside(self) -> tuple[MeasuredPoints, ...]:
        """What an outside instrument measured: points, poses, both or nothing."""
        return tuple(kind for kind in (self.measured, self.probed) if kind is not None)

    @property
    def singles(self) -> int:
        """Number of kinds whose observations can be wrong one by one; they come first in :func:`observations_of`."""
        return (self.shots is not None) + (self.touches is not None) + len(self.outside)

    @property
    def stated(self) -> Mapping[str, float]:
        """Origins of noise whose size is stated beforehand, as scales."""
        known = {"joints": 1.0} if self.arm.joint_repeatability_rad else {}
        return known | {"pixels": 1.0, "standard": 1.0, "instrument": 1.0, "probe": 1.0}


def repeatability_of(arm: Arm) -> Floats:
    """``(J,)`` standard deviation of a joint that counts as scale 1 [rad or m]."""
    return np.full(len(arm.joints), arm.joint_repeatability_rad or UNSTATED_REPEATABILITY_RAD)


def observations_of(data: JointData) -> tuple[Observations, ...]:
    """Every kind that was observed; those of single shots and points, which can be wrong one by one, come first."""
    shots = None if data.shots is None else _target_shots(data.shots, repeatability_of(data.arm))
    kinds = (shots, data.touches, *data.outside, data.sightings, data.certificate, data.distances)
    return tuple(kind for kind in kinds if kind is not None)


def reflector_names(data: JointData) -> tuple[str, ...]:
    """Names of the measured reflectors, by their numbers."""
    if not data.outside:
        return ()
    count = max(int(kind.reflectors.max()) for kind in data.outside) + 1
    return data.outside[0].names or tuple(f"R{k + 1}" for k in range(count))


def start_of(data: JointData) -> tuple[JointState, dict[str, float]]:
    """First state under the nominal arm, and first size of every origin of noise."""
    state = JointState(data.arm, lens_step=np.zeros(len(data.lens_covariance)))
    scales = {"joints": 1.0, "pixels": 1.0, "standard": 1.0, "instrument": 1.0}
    scales |= {"contact": FIRST_CONTACT_M, "readings": FIRST_CONTACT_M}
    scales |= {"orientation": FIRST_ORIENTATION_RAD, "probe": 1.0}
    changes: dict[str, Floats] = {}
    if data.shots is not None:
        found = consensus(data.shots.problem, ROTATION_LENGTH_M)
        changes |= {"X": found.X, "Ts_stand_target": found.Ts_stand_target}
        across = max(float(np.median(found.translations_m)), 1e-6)
        tilt = max(float(np.median(found.rotations_rad)), 1e-6)
        scales |= {"across": across, "along": across, "tilt": tilt, "roll": tilt}
        if data.sightings is not None:
            changes |= {"marks_m": _standing_marks(data.arm, data.sightings, found.X)}
    if data.touches is not None:
        tool_m, points_m = _touching(data.arm, data.touches)
        changes |= {"tool_m": tool_m, "points_m": points_m}
    if data.outside:
        found_at = standing(data.arm, data.outside)
        names = ("reflectors_m", "Rs_link_reflector", "Ts_base_instrument")
        changes |= {name: getattr(found_at, name) for name in names}
    return JointState(**(vars(state) | changes)), scales


def pose_noises(Ts_head_target: Floats) -> dict[str, Floats]:
    """Patterns ``(N, 6, 6)`` of the noise of recorded target poses, as motions in head axes.

    A camera sees across its line of sight better than along it, and a turn about that line better than a tilt; a
    tilt turns the target about its own middle, not about its origin.

    Args:
        Ts_head_target: ``(N, 4, 4)`` recorded poses.

    Returns:
        Covariances per unit of variance: ``across`` and ``along`` the sight [m²], ``tilt`` and ``roll`` [rad²].
    """
    middle = Ts_head_target[:, :3, :3] @ looked_at(Ts_head_target)
    sight = Ts_head_target[:, :3, 3] + middle
    sight = sight / np.maximum(np.linalg.norm(sight, axis=1, keepdims=True), 1e-12)
    along = sight[:, :, None] * sight[:, None, :]
    across = np.eye(3) - along
    to_origin = carried(-middle)

    def pattern(block: Floats, start: int) -> Floats:
        M = np.zeros((len(block), 6, 6))
        M[:, start : start + 3, start : start + 3] = block
        covariance: Floats = to_origin @ M @ np.swapaxes(to_origin, 1, 2)
        return covariance

    return {
        "across": pattern(across, 0),
        "along": pattern(along, 0),
        "tilt": pattern(across, 3),
        "roll": pattern(along, 3),
    }


def looked_at(Ts_head_target: Floats) -> Floats:
    """Point ``(3,)`` of the target nearest to the optical axes of all shots [m]: what people point a camera at.

    It stands for the target's middle where only poses were recorded. Axes that are nearly parallel leave the depth
    open; it then stays near the origin's.
    """
    axes = Ts_head_target[:, 2, :3]
    origins = -np.einsum("nji,nj->ni", Ts_head_target[:, :3, :3], Ts_head_target[:, :3, 3])
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    right = np.einsum("nij,nj->i", across, origins)
    return np.asarray(np.linalg.lstsq(across.sum(axis=0), right, rcond=1e-3)[0], dtype=np.float64)


def _target_shots(shots: HeadShots, repeatability_rad: Floats) -> TargetPoseShots:
    noises = pose_noises(shots.problem.Ts_inner) if shots.covariances is None else {"pixels": shots.covariances}
    return TargetPoseShots(
        shots.joints,
        shots.problem.Ts_inner,
        shots.problem.placements,
        noises,
        repeatability_rad,
        shots.by_lens,
        shots.fixed_head,
    )


def _standing_marks(arm: Arm, sightings: MarkSightings, X: Floats) -> Floats:
    """Marks ``(B, m, 3)`` under the nominal arm: the mean of what each was seen at."""
    B, m = int(sightings.places.max()) + 1, int(sightings.marks.max()) + 1
    found = sightings.linearised(JointState(arm, X=X, marks_m=np.zeros((B, m, 3))), Columns())
    sums, counts = np.zeros((B, m, 3)), np.zeros((B, m, 1))
    np.add.at(sums, (sightings.places, sightings.marks), found.residuals)
    np.add.at(counts, (sightings.places, sightings.marks), 1.0)
    return sums / np.maximum(counts, 1.0)


def _touching(arm: Arm, touches: FixedPointTouches) -> tuple[Floats, Floats]:
    """Tool's point ``(3,)`` and fixed points ``(B, m, 3)`` of all touches under the nominal arm: linear."""
    Ts_base_flange = flange_poses(arm, touches.joints)
    B, m = int(touches.places.max()) + 1, int(touches.points.max()) + 1
    N = len(touches.joints)
    rows = np.zeros((N, 3, 3 + 3 * B * m))
    rows[:, :, :3] = Ts_base_flange[:, :3, :3]
    column = 3 + 3 * (touches.places * m + touches.points)
    for k in range(3):
        rows[np.arange(N), k, column + k] = -1.0
    right = -Ts_base_flange[:, :3, 3]
    found = np.asarray(np.linalg.lstsq(rows.reshape(3 * N, -1), right.ravel())[0], dtype=np.float64)
    return found[:3], found[3:].reshape(B, m, 3)
