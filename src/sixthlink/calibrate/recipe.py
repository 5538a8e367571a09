"""How does a recording with its detections become a calibration?

The walk of the paper: target pose per shot, eq. (10)-(11) over all placements, search, polish, residuals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.calibration import Calibration, Gate, ShotEvidence
from sixthlink.calibrate.cameras import RigCalibration
from sixthlink.calibrate.half_turns import half_turn_transform, opposite_readings
from sixthlink.calibrate.head import (
    GAP_TOLERANCE,
    Certificate,
    HeadProblem,
    Scatter,
    SearchReport,
    certificate_of,
    head_problem,
    objective,
    observability,
    placement_poses,
    scatter,
    search_box,
    search_head,
)
from sixthlink.calibrate.lens_with_robot import refine_lens_with_robot
from sixthlink.calibrate.target_poses import TargetPoses, locate_targets
from sixthlink.errors import DegenerateMotionError, TooFewShotsError
from sixthlink.geometry import Floats, Ints, inverse
from sixthlink.progress import Progress
from sixthlink.recording import (
    EYE_IN_HAND,
    Detections,
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

MINIMUM_USED_SHARE = 0.5
"""Share of the calibration shots that must have been usable for the result to be accepted."""


@dataclass(frozen=True)
class SolveOptions:
    """What the user may choose about eq. (11).

    Attributes:
        seed: Seed of the swarms.
        budget: Number, size and length of the swarms.
        rotation_length_m: ℓ of eq. (11) [m]: 1 counts lengths in metres, 0.001 in millimetres as the paper does.
    """

    seed: int = 0
    budget: SwarmBudget = field(default_factory=SwarmBudget)
    rotation_length_m: float = 1.0


@dataclass(frozen=True, eq=False)
class _Usable:
    """Calibration shots with a target pose, as a problem whose unknown is the head in the frame of link 5."""

    shots: Ints
    problem: HeadProblem
    placements: tuple[str, ...]
    half_turned: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Solution:
    """One pass through eq. (11)."""

    usable: _Usable
    targets: TargetPoses | None
    X_link5: Floats
    search: SearchReport
    certificate: Certificate
    pairs: int
    rejected: tuple[Rejection, ...]


def calibrate_head(
    recording: Recording,
    detections: Detections | None,
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
        detections: What the cameras saw, or None for a recording of target poses.
        cameras: The calibrated cameras, or None for a recording of target poses.
        options: Choices of the solver.
        progress: Listener.
        rejections: Images already rejected on the way here.
        versions: Versions of the software, for the record.

    Raises:
        TooFewShotsError: No placement has three usable shots.
    """
    cameras, solution = _with_final_lens(recording, detections, cameras, options, progress, rejections)
    usable, targets, X_link5 = solution.usable, solution.targets, solution.X_link5
    return Calibration(
        recording=recording.name,
        mount=recording.mount,
        solver="paper",
        X=inverse(_T_link5_outer(recording)) @ X_link5,
        arm=recording.arm if recording.joints is not None else None,
        rig=cameras.rig if cameras else None,
        cameras=cameras.cameras if cameras else (),
        stereo_rms_px=cameras.stereo_rms_px if cameras else 0.0,
        placements=usable.placements,
        Ts_base_target=placement_poses(usable.problem, X_link5),
        value_m2=solution.search.value_m2,
        rotation_length_m=options.rotation_length_m,
        pairs=solution.pairs,
        search=solution.search,
        certificate=solution.certificate,
        shots=_shot_evidence(recording, usable, targets, scatter(usable.problem, X_link5)),
        rejections=solution.rejected,
        gates=_gates(recording, usable, solution.certificate),
        inputs=dict(recording.inputs),
        versions=dict(versions or {}),
    )


def problem_of_recording(
    recording: Recording,
    detections: Detections | None,
    cameras: RigCalibration | None,
    options: SolveOptions,
    progress: Progress,
) -> HeadProblem:
    """What the head solvers see of a recording: its usable shots, their targets located with the final lens."""
    return _with_final_lens(recording, detections, cameras, options, progress, ())[1].usable.problem


def _with_final_lens(  # noqa: PLR0917 - what calibrate_head was given
    recording: Recording,
    detections: Detections | None,
    cameras: RigCalibration | None,
    options: SolveOptions,
    progress: Progress,
    rejections: tuple[Rejection, ...],
) -> tuple[RigCalibration | None, _Solution]:
    """The solution; for a single self-calibrated camera once more with the lens that the robot has refined."""
    solution = _solved(recording, detections, cameras, options, progress, rejections)
    if cameras and len(cameras.cameras) == 1 and cameras.cameras[0].calibrated:
        cameras = _with_robot(recording, cameras, solution)
        solution = _solved(recording, detections, cameras, options, progress, rejections)
    return cameras, solution


def _solved(  # noqa: PLR0917 - what calibrate_head was given
    recording: Recording,
    detections: Detections | None,
    cameras: RigCalibration | None,
    options: SolveOptions,
    progress: Progress,
    rejections: tuple[Rejection, ...],
) -> _Solution:
    """Target poses, eq. (11), search and polish, with the cameras as they are."""
    shots, targets = _located(recording, detections, cameras)
    rejected = rejections + (cameras.rejections if cameras else ()) + (targets.rejections if targets else ())
    usable = _usable(recording, shots, targets, rejected)
    eq11 = objective(usable.problem, options.rotation_length_m)
    X_link5, search = search_head(
        eq11, search_box(usable.problem), seed=options.seed, budget=options.budget, progress=progress
    )
    _refuse_unseen(recording, usable, X_link5, options.rotation_length_m)
    certificate = certificate_of(eq11, X_link5[:3, :3])
    return _Solution(usable, targets, X_link5, search, certificate, eq11.pairs, rejected)


def _refuse_unseen(recording: Recording, usable: _Usable, X_link5: Floats, rotation_length_m: float) -> None:
    """Refuse a motion that leaves a direction of the head unseen, and name it in the frame that carries the head."""
    T_link5_outer = _T_link5_outer(recording)
    problem = replace(usable.problem, Ts_outer=usable.problem.Ts_outer @ T_link5_outer)
    carrier = "flange" if recording.mount == EYE_IN_HAND else "base"
    rotation = (inverse(T_link5_outer) @ X_link5)[:3, :3]
    seen = observability(objective(problem, rotation_length_m), rotation, carrier=carrier)
    if not seen.complete:
        raise DegenerateMotionError(
            "the robot's motion cannot show " + "; ".join(seen.words) + "; add shots that turn the flange by 20° or "
            "more about at least two different axes",
            directions=seen.words,
        )


def _with_robot(recording: Recording, cameras: RigCalibration, solution: _Solution) -> RigCalibration:
    """A single camera whose lens the robot has helped to determine, its detections named alike in all shots."""
    usable, target = solution.usable, recording.target
    if target is None:
        return cameras
    if target.half_turn is not None:
        turned = np.isin(cameras.detections.shots, usable.shots[usable.half_turned])
        named = cameras.detections.points
        points = np.where(turned, target.half_turn[named], named)
        cameras = replace(cameras, detections=replace(cameras.detections, points=points))
    return refine_lens_with_robot(cameras, target.points_m, usable.shots, usable.problem, solution.X_link5)


def _T_link5_outer(recording: Recording) -> Floats:
    """What stands between link 5 and the frame that carries the head: the last link, where there is one."""
    if recording.mount != EYE_IN_HAND or recording.joints is None or recording.arm is None:
        return np.eye(4)
    return last_link(recording.arm)


def _located(
    recording: Recording, detections: Detections | None, cameras: RigCalibration | None
) -> tuple[Ints, TargetPoses | None]:
    """Calibration shots with a target pose, and the poses' evidence where they came from pixels."""
    wanted = shots_of_kind(recording, "calibrate")
    if detections is None or cameras is None:
        return wanted, None
    if recording.target is None:
        raise ValueError("pixels need a target to be explained by")
    seen = selected(cameras.detections, np.isin(cameras.detections.shots, wanted))
    targets = locate_targets(
        cameras.rig, recording.target.points_m, seen, recording.ids, half_turn=recording.target.half_turn
    )
    return targets.shots, targets


def _usable(recording: Recording, shots: Ints, targets: TargetPoses | None, rejected: Sequence[Rejection]) -> _Usable:
    try:
        placements, names = placement_indices(recording, shots)
        Ts_outer = flange_poses_of(recording)[shots]
        Ts_head_target = targets.Ts_head_target if targets else _recorded_poses(recording)[shots]
        problem = head_problem(recording.mount, Ts_outer, Ts_head_target, placements)
    except TooFewShotsError as few:
        reasons = "".join(f"\n  {r.shot} {r.camera}: {r.reason}" for r in rejected)
        raise TooFewShotsError(f"{few}{reasons}", needed=few.needed, usable=few.usable) from None
    half_turned = np.zeros(len(shots), dtype=bool)
    if targets and recording.target is not None and recording.target.half_turn is not None:
        H = half_turn_transform(recording.target.points_m, recording.target.half_turn)
        half_turned = opposite_readings(problem, H)
        problem = replace(problem, Ts_inner=np.where(half_turned[:, None, None], Ts_head_target @ H, Ts_head_target))
    in_link5 = replace(problem, Ts_outer=problem.Ts_outer @ inverse(_T_link5_outer(recording)))
    return _Usable(shots, in_link5, names, half_turned)


def _recorded_poses(recording: Recording) -> Floats:
    if recording.Ts_head_target is None:
        raise ValueError("the recording has neither pixels nor target poses")
    return recording.Ts_head_target


def _shot_evidence(
    recording: Recording, usable: _Usable, targets: TargetPoses | None, residuals: Scatter
) -> tuple[ShotEvidence, ...]:
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


def _gates(recording: Recording, usable: _Usable, certificate: Certificate) -> tuple[Gate, ...]:
    recorded, used = len(shots_of_kind(recording, "calibrate")), len(usable.shots)
    return (
        Gate(
            "enough shots used",
            used >= MINIMUM_USED_SHARE * recorded,
            f"{used} of {recorded} calibration shots were usable, at least {MINIMUM_USED_SHARE:.0%} are needed; "
            "the rejections say what to change",
        ),
        Gate(
            "proven minimum",
            certificate.certified,
            f"eq. (11) is within {certificate.relative_gap:.1e} of its proven lower bound, at most "
            f"{GAP_TOLERANCE:.0e} is accepted; if not, more swarms or iterations, or better shots, help",
        ),
    )
