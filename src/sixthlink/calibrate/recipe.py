"""How does a recording with its detections become a calibration?

The walk of the paper: target pose per shot, eq. (10)-(11) over all placements, search, polish, residuals.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.calibration import Calibration, ShotEvidence
from sixthlink.calibrate.cameras import RigCalibration
from sixthlink.calibrate.gates import gates_of
from sixthlink.calibrate.half_turns import half_turn_transform, opposite_readings
from sixthlink.calibrate.head import (
    HeadProblem,
    Held,
    Objective,
    Scatter,
    SearchReport,
    certificate_of,
    head_problem,
    held_objective,
    objective,
    observability,
    placement_poses,
    scatter,
    search_box,
    search_head,
    solve_certified,
)
from sixthlink.calibrate.lens_with_robot import refine_lens_with_robot
from sixthlink.calibrate.target_poses import TargetPoses, locate_targets
from sixthlink.calibrate.unobserved import Unobserved, degenerate_motion, what_is_held
from sixthlink.errors import TooFewShotsError
from sixthlink.geometry import Floats, Ints, inverse
from sixthlink.progress import Progress
from sixthlink.recording import (
    EYE_IN_HAND,
    Recording,
    Rejection,
    flange_poses_of,
    placement_indices,
    selected,
    shots_of_kind,
)
from sixthlink.robot import last_link
from sixthlink.solvers import SwarmBudget

__all__ = ["SolveOptions", "calibrate_head", "problem_of_recording"]


@dataclass(frozen=True)
class SolveOptions:
    """What the user may choose about eq. (11).

    Attributes:
        seed: Seed of the swarms.
        budget: Number, size and length of the swarms.
        rotation_length_m: ℓ of eq. (11) [m]: 1 counts lengths in metres, 0.001 in millimetres as the paper does.
        observable_rest: Solve what the motion shows where it cannot show the whole head, instead of refusing.
    """

    seed: int = 0
    budget: SwarmBudget = field(default_factory=SwarmBudget)
    rotation_length_m: float = 1.0
    observable_rest: bool = False


@dataclass(frozen=True, eq=False)
class _Usable:
    """Calibration shots with a target pose, ready for eq. (11).

    Attributes:
        cameras: The cameras that located the targets, or None when target poses were recorded.
        shots: Index of each usable shot in the recording.
        targets: Evidence of the target poses where they came from pixels.
        problem: The shots as a problem whose unknown is the head in the frame that carries it.
        eq11: Eq. (11) of that problem.
        placements: Names of the placements.
        half_turned: Whether a symmetric target was read from its other end.
        rejections: Everything that was refused on the way here.
        held: What the motion does not show and eq. (11) therefore holds.
        unobserved: The same for the record; None where the whole head is seen.
    """

    cameras: RigCalibration | None
    shots: Ints
    targets: TargetPoses | None
    problem: HeadProblem
    eq11: Objective
    placements: tuple[str, ...]
    half_turned: npt.NDArray[np.bool_]
    rejections: tuple[Rejection, ...]
    held: Held | None = None
    unobserved: Unobserved | None = None


def calibrate_head(
    recording: Recording,
    cameras: RigCalibration | None,
    options: SolveOptions,
    progress: Progress,
    *,
    rejections: tuple[Rejection, ...] = (),
    versions: Mapping[str, str] | None = None,
) -> Calibration:
    """Calibrate the head of a recording by eq. (11) with QPSO and polish.

    Args:
        recording: What was recorded; its arm is taken as exact.
        cameras: The calibrated cameras with what they saw, or None for a recording of target poses.
        options: Choices of the solver.
        progress: Listener.
        rejections: Images already rejected on the way here.
        versions: Versions of the software, for the record.

    Raises:
        TooFewShotsError: No placement has three usable shots.
        DegenerateMotionError: The motion leaves a direction of the head unseen, and its rest was not asked for.
    """
    usable = _usable_with_final_lens(recording, cameras, options, rejections)
    X, search = _searched(recording, usable, options, progress)
    certificate = certificate_of(usable.eq11, X[:3, :3])
    final = usable.cameras
    return Calibration(
        recording=recording.name,
        mount=recording.mount,
        solver="paper",
        X=X,
        arm=recording.arm if recording.joints is not None else None,
        rig=final.rig if final else None,
        cameras=final.cameras if final else (),
        stereo_rms_px=final.stereo_rms_px if final else 0.0,
        placements=usable.placements,
        Ts_base_target=placement_poses(usable.problem, X),
        value_m2=search.value_m2,
        rotation_length_m=options.rotation_length_m,
        pairs=usable.eq11.pairs,
        search=search,
        certificate=certificate,
        shots=_shot_evidence(recording, usable, scatter(usable.problem, X)),
        rejections=usable.rejections,
        gates=gates_of(len(shots_of_kind(recording, "calibrate")), len(usable.shots), certificate),
        unobserved=usable.unobserved,
        inputs=dict(recording.inputs),
        versions=dict(versions or {}),
    )


def problem_of_recording(recording: Recording, cameras: RigCalibration | None, options: SolveOptions) -> HeadProblem:
    """What the head solvers see of a recording: its usable shots, their targets located with the final lens."""
    return _usable_with_final_lens(recording, cameras, options, ()).problem


def _usable_with_final_lens(
    recording: Recording,
    cameras: RigCalibration | None,
    options: SolveOptions,
    rejections: tuple[Rejection, ...],
) -> _Usable:
    """The usable shots; for a single self-calibrated camera located with the lens that the robot has refined.

    Raises:
        DegenerateMotionError: The motion leaves a direction of the head unseen.
    """
    usable = _usable(recording, cameras, options, rejections)
    seen = observability(usable.problem, carrier="flange" if recording.mount == EYE_IN_HAND else "base")
    if not seen.complete:
        if not options.observable_rest:
            raise degenerate_motion(seen)
        held, unobserved = what_is_held(usable.problem, seen)
        return replace(usable, eq11=held_objective(usable.eq11, held), held=held, unobserved=unobserved)
    if cameras and len(cameras.cameras) == 1 and cameras.cameras[0].calibrated:
        X = solve_certified(usable.eq11)[0]
        usable = _usable(recording, _with_robot(recording, cameras, usable, X), options, rejections)
    return usable


def _searched(
    recording: Recording, usable: _Usable, options: SolveOptions, progress: Progress
) -> tuple[Floats, SearchReport]:
    """The head by the paper's search, whose six numbers live in the frame of link 5 where there is one."""
    T_link5_outer = _T_link5_outer(recording)
    in_link5 = replace(usable.problem, Ts_outer=usable.problem.Ts_outer @ inverse(T_link5_outer))
    eq11 = objective(in_link5, options.rotation_length_m)
    X_link5, search = search_head(
        eq11 if usable.held is None else held_objective(eq11, usable.held.seen_from(T_link5_outer)),
        search_box(in_link5),
        seed=options.seed,
        budget=options.budget,
        progress=progress,
    )
    X = inverse(T_link5_outer) @ X_link5
    return X if usable.held is None else usable.held.head(X), search


def _with_robot(recording: Recording, cameras: RigCalibration, usable: _Usable, X: Floats) -> RigCalibration:
    """A single camera whose lens the robot has helped to determine, its detections named alike in all shots."""
    target = recording.target
    if target is None:
        return cameras
    if target.half_turn is not None:
        turned = np.isin(cameras.detections.shots, usable.shots[usable.half_turned])
        named = cameras.detections.points
        points = np.where(turned, target.half_turn[named], named)
        cameras = replace(cameras, detections=replace(cameras.detections, points=points))
    return refine_lens_with_robot(cameras, target.points_m, usable.shots, usable.problem, X)


def _T_link5_outer(recording: Recording) -> Floats:
    """What stands between link 5 and the frame that carries the head: the last link, where there is one."""
    if recording.mount != EYE_IN_HAND or recording.joints is None or recording.arm is None:
        return np.eye(4)
    return last_link(recording.arm)


def _located(recording: Recording, cameras: RigCalibration | None) -> tuple[Ints, TargetPoses | None, Floats]:
    """Calibration shots with a target pose, the evidence where it came from pixels, and the poses."""
    wanted = shots_of_kind(recording, "calibrate")
    if cameras is None:
        if recording.Ts_head_target is None:
            raise ValueError("the recording has neither pixels nor target poses")
        return wanted, None, recording.Ts_head_target[wanted]
    if recording.target is None:
        raise ValueError("pixels need a target to be explained by")
    seen = selected(cameras.detections, np.isin(cameras.detections.shots, wanted))
    targets = locate_targets(
        cameras.rig, recording.target.points_m, seen, recording.ids, half_turn=recording.target.half_turn
    )
    return targets.shots, targets, targets.Ts_head_target


def _usable(
    recording: Recording,
    cameras: RigCalibration | None,
    options: SolveOptions,
    rejections: tuple[Rejection, ...],
) -> _Usable:
    shots, targets, Ts_head_target = _located(recording, cameras)
    rejected = rejections + (cameras.rejections if cameras else ()) + (targets.rejections if targets else ())
    placements, names = placement_indices(recording, shots)
    try:
        problem = head_problem(recording.mount, flange_poses_of(recording)[shots], Ts_head_target, placements)
    except TooFewShotsError as few:
        reasons = "".join(f"\n  {r.shot} {r.camera}: {r.reason}" for r in rejected)
        raise TooFewShotsError(f"{few}{reasons}", needed=few.needed, usable=few.usable) from None
    half_turned = np.zeros(len(shots), dtype=bool)
    if targets and recording.target is not None and recording.target.half_turn is not None:
        H = half_turn_transform(recording.target.points_m, recording.target.half_turn)
        half_turned = opposite_readings(problem, H)
        problem = replace(problem, Ts_inner=np.where(half_turned[:, None, None], Ts_head_target @ H, Ts_head_target))
    eq11 = objective(problem, options.rotation_length_m)
    return _Usable(cameras, shots, targets, problem, eq11, names, half_turned, rejected)


def _shot_evidence(recording: Recording, usable: _Usable, residuals: Scatter) -> tuple[ShotEvidence, ...]:
    targets = usable.targets
    return tuple(
        ShotEvidence(
            shot=recording.ids[shot],
            placement=recording.placements[shot],
            translation_m=float(residuals.translations_m[k]),
            rotation_rad=float(residuals.rotations_rad[k]),
            rms_px=float(targets.rms_px[k]) if targets else 0.0,
            points=int(targets.points[k]) if targets else 0,
            half_turned=bool(usable.half_turned[k]),
        )
        for k, shot in enumerate(usable.shots)
    )
