"""What does the calibration of an arm from a tracker record leave behind? An arm, and the evidence for its numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.joint import ArmEvidence, JointEvidence
from sixthlink.calibrate.tracked_arm.sweeps import JointSweep
from sixthlink.calibrate.tracker import CircleFinding
from sixthlink.geometry import Floats, Line, frozen_floats
from sixthlink.recording import Rejection
from sixthlink.robot import Arm

__all__ = ["PointErrors", "RecordFinding", "ReflectorPlace", "TrackedArm", "TrackedAxis"]


@dataclass(frozen=True)
class RecordFinding:
    """A finding and where in the record it was made.

    Attributes:
        where: Name of the sweep, or ``record``.
        finding: The finding.
    """

    where: str
    finding: CircleFinding


@dataclass(frozen=True, eq=False)
class TrackedAxis:
    """The axis of one joint, in the tracker's frame.

    Attributes:
        joint: Name of the joint.
        stop: ``(J,)`` joint values at which it is told [rad or m].
        axis: The axis of the calibrated arm there; the joint grows about it by the right hand.
        direction_std_rad: Standard deviation of its direction, along the least certain tilt [rad].
        position_std_m: Standard deviation of its place, along the least certain shift across it [m].
        sweep: The surest sweep of the joint, or None where none shows it.
    """

    joint: str
    stop: Floats
    axis: Line
    direction_std_rad: float
    position_std_m: float
    sweep: JointSweep | None


@dataclass(frozen=True, eq=False)
class ReflectorPlace:
    """Where a reflector sits.

    Attributes:
        name: Its name.
        link: Number of the link that carries it; the last is the flange.
        place_m: ``(3,)`` in the link's frame [m].
        std_m: ``(3,)`` standard deviations [m]; infinite along an axis that the points do not show.
        unseen: Directions that the points do not show, in words; empty when all are seen.
    """

    name: str
    link: int
    place_m: Floats
    std_m: Floats
    unseen: str


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Distances of N points from where an arm carries their reflectors.

    Attributes:
        distances_m: ``(N,)`` [m].
        turns_rad: ``(K,)`` angles of the probes whose orientation was measured [rad].
    """

    distances_m: Floats
    turns_rad: Floats

    @property
    def rms_m(self) -> float:
        """RMS distance [m]."""
        return float(np.sqrt(np.mean(self.distances_m**2)))

    @property
    def max_m(self) -> float:
        """Largest distance [m]."""
        return float(self.distances_m.max())

    @property
    def rms_rad(self) -> float | None:
        """RMS angle [rad]; None where no orientation was measured."""
        return float(np.sqrt(np.mean(self.turns_rad**2))) if len(self.turns_rad) else None


@dataclass(frozen=True, eq=False)
class TrackedArm:
    """An arm, and the evidence for it.

    Attributes:
        record: Name of the record.
        instrument: Name of the instrument.
        arm: The calibrated arm.
        nominal: The arm that it started from: the maker's, or the one that the axes alone show.
        drawn: Whether the nominal arm was given, rather than found from the axes.
        T_base_tracker: ``(4, 4)`` where the tracker stands.
        sweeps: Every sweep with its circles.
        axes: The axis of every turning joint.
        reflectors: Where the reflectors sit.
        joint: Covariance, noise and every parameter of the arm.
        train: Errors of the points that made the answer.
        heldout: The same points, each predicted by fits that had not seen its pose.
        heldout_before: The same under the nominal arm, tracker and reflectors placed by the other points.
        used: ``(N,)`` indices of the points in the record that made the answer, in the order of the errors.
        rejections: Points that were not used, and why.
        findings: Everything that sweeps, tracker and axes tell.
        gates: What had to be answered with yes.
        inputs: SHA-256 per input file.
        versions: Versions of the software.
    """

    record: str
    instrument: str
    arm: Arm
    nominal: Arm
    drawn: bool
    T_base_tracker: Floats
    sweeps: tuple[JointSweep, ...]
    axes: tuple[TrackedAxis, ...]
    reflectors: tuple[ReflectorPlace, ...]
    joint: JointEvidence
    train: PointErrors
    heldout: PointErrors
    heldout_before: PointErrors
    used: tuple[int, ...]
    rejections: tuple[Rejection, ...]
    findings: tuple[RecordFinding, ...]
    gates: tuple[Gate, ...]
    inputs: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_base_tracker", frozen_floats(self.T_base_tracker, (4, 4), "T_base_tracker"))

    @property
    def accepted(self) -> bool:
        """Whether no gate refuses."""
        return all(gate.passed for gate in self.gates)

    @property
    def couplings(self) -> tuple[ArmEvidence, ...]:
        """The coupling factors of the arm, with their uncertainty."""
        return tuple(p for p in self.joint.arm if p.name.startswith("coupling_"))
