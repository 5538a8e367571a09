"""How does eq. (11) turn the usable shots of a recording into a calibrated head?

The walk of the paper: eq. (10)-(11) over all placements, search, polish, residuals; the arm is taken as exact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sixthlink.calibrate.board_scale import BoardScale, board_evidence, board_gate
from sixthlink.calibrate.calibration import Calibration
from sixthlink.calibrate.gates import agreement_gate, gates_of, heldout_gate
from sixthlink.calibrate.head import (
    HeadProblem,
    Scatter,
    SearchReport,
    certificate_of,
    held_objective,
    objective,
    placement_poses,
    scatter,
    search_box,
    search_head,
    solve_certified,
)
from sixthlink.calibrate.heldout import held_out
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.stereo_check import stereo_gates
from sixthlink.calibrate.strays import stray_gate
from sixthlink.calibrate.usable import SolveOptions, Usable, shot_evidence, usable_with_final_lens
from sixthlink.geometry import Floats, inverse
from sixthlink.progress import Progress
from sixthlink.recording import EYE_IN_HAND, Recording, Rejection, shots_of_kind
from sixthlink.robot import last_link

__all__ = ["calibrate_head", "problem_of_recording"]


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
    usable = usable_with_final_lens(recording, cameras, options, rejections)
    X, search = _searched(recording, usable, options, progress)
    certificate = certificate_of(usable.eq11, X[:3, :3])
    final = usable.cameras
    arm = recording.arm if recording.joints is not None else None
    Ts_stand_target, found = placement_poses(usable.problem, X), scatter(usable.problem, X)
    size = None if usable.held is not None else _board_scale(usable, X, found)
    heldout, unjudged = held_out(
        recording, final, arm, X=X, placements=usable.placements, Ts_stand_target=Ts_stand_target
    )
    return Calibration(
        recording=recording.name,
        mount=recording.mount,
        solver="paper",
        X=X,
        arm=arm,
        rig=final.rig if final else None,
        cameras=final.cameras if final else (),
        stereo_rms_px=final.stereo_rms_px if final else 0.0,
        placements=usable.placements,
        Ts_base_target=Ts_stand_target,
        value_m2=search.value_m2,
        rotation_length_m=options.rotation_length_m,
        pairs=usable.eq11.pairs,
        search=search,
        certificate=certificate,
        shots=shot_evidence(recording, usable, found),
        rejections=usable.rejections + unjudged,
        gates=(
            *gates_of(len(shots_of_kind(recording, "calibrate")), len(usable.shots), certificate),
            agreement_gate(found),
            stray_gate(usable.problem, [recording.ids[s] for s in usable.shots]),
            *((board_gate(size),) if size else ()),
            *stereo_gates(recording, final),
            *((heldout_gate(heldout, found),) if heldout else ()),
        ),
        unobserved=usable.unobserved,
        heldout=heldout,
        print_sigma_m=final.print_sigma_m if final else 0.0,
        board=board_evidence(size, final),
        inputs=dict(recording.inputs),
        versions=dict(versions or {}),
    )


def problem_of_recording(recording: Recording, cameras: RigCalibration | None, options: SolveOptions) -> HeadProblem:
    """What the head solvers see of a recording: its usable shots, their targets located with the final lens."""
    return usable_with_final_lens(recording, cameras, options, ()).problem


def _searched(
    recording: Recording, usable: Usable, options: SolveOptions, progress: Progress
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


def _board_scale(usable: Usable, X: Floats, found: Scatter) -> BoardScale:
    """The board's size by the motion of the usable shots, under the lens that does not know of the robot yet."""
    if usable.by_images is None:
        return usable.board_size(X, found)
    return usable.by_images.board_size(solve_certified(usable.by_images.eq11)[0], found)


def _T_link5_outer(recording: Recording) -> Floats:
    """What stands between link 5 and the frame that carries the head: the last link, where there is one."""
    if recording.mount != EYE_IN_HAND or recording.joints is None or recording.arm is None:
        return np.eye(4)
    return last_link(recording.arm)
