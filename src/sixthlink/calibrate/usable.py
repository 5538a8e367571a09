"""Which shots of a recording can be used, and what does a solver see of them?

The target's pose per shot, symmetric targets read alike, the motion judged; for a single self-calibrated camera, the
targets located again with the lens that the robot has helped to determine.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from sixthlink.calibrate.board_scale import BoardScale, scale_by_head
from sixthlink.calibrate.calibration import ShotEvidence
from sixthlink.calibrate.head import (
    HeadProblem,
    Held,
    Objective,
    Observability,
    Scatter,
    head_problem,
    held_objective,
    objective,
    observability,
    scatter,
    solve_certified,
)
from sixthlink.calibrate.lens_with_robot import refine_lens_with_robot
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.target_poses import TargetPoses, locate_targets
from sixthlink.calibrate.turns import readings, renamed, turn_transforms
from sixthlink.calibrate.unobserved import Unobserved, degenerate_motion, what_is_held
from sixthlink.errors import TooFewShotsError
from sixthlink.geometry import Floats, Ints
from sixthlink.recording import (
    EYE_IN_HAND,
    Recording,
    Rejection,
    flange_poses_of,
    placement_indices,
    selected,
    shots_of_kind,
)
from sixthlink.solvers import SwarmBudget
from sixthlink.target import turn_names

__all__ = [
    "SolveOptions",
    "Usable",
    "located_targets",
    "motion_of",
    "shot_evidence",
    "usable_shots",
    "usable_with_final_lens",
]


@dataclass(frozen=True)
class SolveOptions:
    """What the user may choose about eq. (11).

    Attributes:
        seed: Seed of the swarms.
        budget: Number, size and length of the swarms.
        rotation_length_m: ℓ of eq. (11) [m]: 1 counts lengths in metres, 0.001 in millimetres as the paper does.
        observable_rest: Solve what the motion shows where it cannot show the whole head, instead of refusing.
        noise: ``estimated`` from the residuals, or ``stated`` to keep what the robot's file says; for arm and head
            together.
    """

    seed: int = 0
    budget: SwarmBudget = field(default_factory=SwarmBudget)
    rotation_length_m: float = 1.0
    observable_rest: bool = False
    noise: str = "estimated"


@dataclass(frozen=True, eq=False)
class Usable:
    """Calibration shots with a target pose, ready for eq. (11).

    Attributes:
        cameras: The cameras that located the targets, or None when target poses were recorded.
        shots: Index of each usable shot in the recording.
        targets: Evidence of the target poses where they came from pixels.
        problem: The shots as a problem whose unknown is the head in the frame that carries it.
        eq11: Eq. (11) of that problem.
        placements: Names of the placements.
        turns: Turns by which the names of a symmetric target's points were turned.
        rejections: Everything that was refused on the way here.
        held: What the motion does not show and eq. (11) therefore holds.
        unobserved: The same for the record; None where the whole head is seen.
        by_images: The same shots under the lens that the images alone determine, where the robot has refined it.
    """

    cameras: RigCalibration | None
    shots: Ints
    targets: TargetPoses | None
    problem: HeadProblem
    eq11: Objective
    placements: tuple[str, ...]
    turns: Ints
    rejections: tuple[Rejection, ...]
    held: Held | None = None
    unobserved: Unobserved | None = None
    by_images: Usable | None = None

    def board_size(self, X: Floats, fitted: Scatter) -> BoardScale:
        """The size of the board by the motion of the shots, weighed by their scatter under a head ``(4, 4)``."""
        covariance = self.cameras.covariance if self.cameras else np.zeros((0, 0))
        by_lens = self.targets.by_rig if self.targets else np.zeros((len(self.shots), 6, 0))
        return scale_by_head(self.problem, X, fitted, by_lens, covariance)


def usable_with_final_lens(
    recording: Recording,
    cameras: RigCalibration | None,
    options: SolveOptions,
    rejections: tuple[Rejection, ...],
) -> Usable:
    """The usable shots; for a single self-calibrated camera located with the lens that the robot has refined.

    Raises:
        DegenerateMotionError: The motion leaves a direction of the head unseen.
    """
    usable = usable_shots(recording, cameras, options, rejections)
    seen = motion_of(recording, usable)
    if not seen.complete:
        if not options.observable_rest:
            raise degenerate_motion(seen)
        held, unobserved = what_is_held(usable.problem, seen)
        return replace(usable, eq11=held_objective(usable.eq11, held), held=held, unobserved=unobserved)
    if cameras and len(cameras.cameras) == 1 and cameras.cameras[0].calibrated:
        X = solve_certified(usable.eq11)[0]
        size = usable.board_size(X, scatter(usable.problem, X))
        better = _with_robot(recording, cameras, usable, X, doubted=size.wrong or size.doubtful)
        return replace(usable_shots(recording, better, options, rejections), by_images=usable)
    return usable


def motion_of(recording: Recording, usable: Usable) -> Observability:
    """What the motion of the usable shots can show of the head."""
    return observability(usable.problem, carrier="flange" if recording.mount == EYE_IN_HAND else "base")


def _with_robot(
    recording: Recording, cameras: RigCalibration, usable: Usable, X: Floats, *, doubted: bool
) -> RigCalibration:
    """A single camera whose lens the robot has helped to determine, its detections named alike in all shots."""
    target = recording.target
    if target is None:
        return cameras
    if usable.turns.any():
        names = turn_names(target.turn, len(target.points_m))
        cameras = replace(cameras, detections=renamed(cameras.detections, usable.shots, usable.turns, names))
    return refine_lens_with_robot(cameras, cameras.points_m, usable.shots, usable.problem, X, doubted=doubted)


def located_targets(
    recording: Recording, cameras: RigCalibration | None, kind: str
) -> tuple[Ints, TargetPoses | None, Floats]:
    """Shots of one kind with a target pose, the evidence where it came from pixels, and the poses ``(S, 4, 4)``."""
    wanted = shots_of_kind(recording, kind)
    if cameras is None:
        if recording.Ts_head_target is None:
            raise ValueError("the recording has neither pixels nor target poses")
        return wanted, None, recording.Ts_head_target[wanted]
    if recording.target is None:
        raise ValueError("pixels need a target to be explained by")
    seen = selected(cameras.detections, np.isin(cameras.detections.shots, wanted))
    targets = locate_targets(
        cameras.rig,
        cameras.points_m,
        seen,
        recording.ids,
        turn=recording.target.turn,
        unknowns=cameras.unknowns,
    )
    return targets.shots, targets, targets.Ts_head_target


def usable_shots(
    recording: Recording,
    cameras: RigCalibration | None,
    options: SolveOptions,
    rejections: tuple[Rejection, ...],
) -> Usable:
    """The calibration shots whose target could be located, as the cameras are.

    Raises:
        TooFewShotsError: They are too few for a head.
    """
    shots, targets, Ts_head_target = located_targets(recording, cameras, "calibrate")
    rejected = rejections + (cameras.rejections if cameras else ()) + (targets.rejections if targets else ())
    placements, names = placement_indices(recording, shots)
    try:
        problem = head_problem(recording.mount, flange_poses_of(recording)[shots], Ts_head_target, placements)
    except TooFewShotsError as few:
        raise few.because(str(r) for r in rejected) from None
    turns = np.zeros(len(shots), dtype=np.int64)
    if targets and recording.target is not None and recording.target.turn is not None:
        Ts_target_renamed = turn_transforms(recording.target.points_m, recording.target.turn)
        turns = readings(problem, Ts_target_renamed)
        problem = replace(problem, Ts_inner=Ts_head_target @ Ts_target_renamed[turns])
    eq11 = objective(problem, options.rotation_length_m)
    return Usable(cameras, shots, targets, problem, eq11, names, turns, rejected)


def shot_evidence(recording: Recording, usable: Usable, residuals: Scatter) -> tuple[ShotEvidence, ...]:
    """How each usable shot fits."""
    targets = usable.targets
    return tuple(
        ShotEvidence(
            shot=recording.ids[shot],
            placement=recording.placements[shot],
            translation_m=float(residuals.translations_m[k]),
            rotation_rad=float(residuals.rotations_rad[k]),
            rms_px=float(targets.rms_px[k]) if targets else 0.0,
            points=int(targets.points[k]) if targets else 0,
            turns=int(usable.turns[k]),
        )
        for k, shot in enumerate(usable.shots)
    )
