"""How do the usable shots of a recording become an arm, a head and placements, found together?

From the images' own cameras: shots, lenses and certified lengths enter one estimate; where the robot moves the lenses,
the targets are located again with them. Shots that do not belong are named, shots of kind ``judge`` are predicted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.board_scale import BoardScale, board_evidence, board_gate, scale_by_joint
from sixthlink.calibrate.budget import budget_of
from sixthlink.calibrate.calibration import Calibration
from sixthlink.calibrate.gates import agreement_gate, gates_of, heldout_gate, noise_gate
from sixthlink.calibrate.head import (
    HeadProblem,
    Scatter,
    certificate_of,
    head_problem,
    objective,
    objective_values,
    scatter,
    solve_certified,
)
from sixthlink.calibrate.heldout import held_out
from sixthlink.calibrate.joint import (
    BlockVerdict,
    Estimate,
    JointData,
    NoiseEvidence,
    estimate,
    estimate_with_blocks,
    joint_evidence,
)
from sixthlink.calibrate.joint_inputs import joint_data, middle_of_target
from sixthlink.calibrate.lens_evidence import lens_stds
from sixthlink.calibrate.observations import covariances
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.scale_bars import scale_gates
from sixthlink.calibrate.stereo_check import stereo_gates
from sixthlink.calibrate.tracked_arm import TrackerData, points_of_the_same_arm, wrong_points
from sixthlink.calibrate.unobserved import degenerate_motion
from sixthlink.calibrate.usable import SolveOptions, Usable, motion_of, shot_evidence, usable_shots
from sixthlink.calibrate.wrong_shots import wrong_shots
from sixthlink.camera import moved_rig
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats
from sixthlink.progress import Progress
from sixthlink.recording import (
    EYE_IN_HAND,
    Recording,
    Rejection,
    TrackerRecord,
    shots_of_kind,
)
from sixthlink.robot import Arm, flange_poses

__all__ = ["calibrate_jointly"]

STAGE = "arm and head together"

LENS_ROUNDS = 4
LENS_SETTLED = 0.05
"""Change of any lens unknown, in its own standard deviations, below which the targets need not be located again."""


@dataclass(frozen=True, eq=False)
class _Solved:
    cameras: RigCalibration | None
    usable: Usable
    data: JointData
    found: Estimate
    verdicts: tuple[BlockVerdict, ...]


def calibrate_jointly(
    recording: Recording,
    cameras: RigCalibration | None,
    options: SolveOptions,
    progress: Progress,
    *,
    rejections: tuple[Rejection, ...] = (),
    versions: Mapping[str, str] | None = None,
    tracker: TrackerRecord | None = None,
) -> Calibration:
    """Calibrate arm, head and placements of a recording together, weighted by what makes the noise.

    Args:
        recording: What was recorded, with joint values and the arm's nominal kinematics.
        cameras: The cameras as their images determine them, with what they saw; None for recorded target poses.
        options: Choices of the solver.
        progress: Listener.
        rejections: Images already rejected on the way here.
        versions: Versions of the software, for the record.
        tracker: What a laser tracker saw of the same arm; its points enter the same problem.

    Raises:
        TooFewShotsError: No placement has three usable shots.
        DegenerateMotionError: The motion leaves a direction of the head unseen.
        CalibrationError: There are no joint values, or the estimate does not settle.
    """
    nominal = _kinematics(recording)
    tracked = None if tracker is None else points_of_the_same_arm(tracker, nominal)
    solved = _solved(
        recording, nominal, cameras, tracked=tracked, options=options, rejections=rejections, progress=progress
    )
    found, usable = solved.found, solved.usable
    arm = replace(found.fit.state.arm, source=f"calibrated from {recording.name}; nominal: {nominal.source}")
    X, kept = _head(found), found.kept[0]
    assert recording.joints is not None  # noqa: S101 - there are kinematics, so there are joints
    Ts_base_flange = flange_poses(arm, recording.joints[usable.shots])
    problem = head_problem(recording.mount, Ts_base_flange, usable.problem.Ts_inner, usable.problem.placements)
    used = _part(problem, kept)
    eq11 = objective(used, options.rotation_length_m)
    certificate = certificate_of(eq11, solve_certified(eq11)[0][:3, :3])
    heldout, unjudged = held_out(
        recording,
        solved.cameras,
        arm,
        X=X,
        placements=usable.placements,
        Ts_stand_target=found.fit.state.Ts_stand_target,
    )
    lens = solved.cameras.names if solved.cameras else ()
    evidence = joint_evidence(nominal, found, solved.verdicts, lens, solved.data.stated)
    evidence = replace(
        evidence,
        noise=tuple(_in_pixels(n, solved.cameras) for n in evidence.noise),
        budget=budget_of(solved.data, found, middle_of_target(recording)),
    )
    wrong = wrong_shots(recording, problem, usable, found)
    size = _board_scale(found, Ts_base_flange, recording.mount, usable.problem.Ts_inner)
    left_out = wrong_points(tracker, tracked, found) if tracker is not None and tracked is not None else ()
    fitted = scatter(used, X)
    all_evidence = shot_evidence(recording, usable, _spread(fitted, kept))
    recorded = len(shots_of_kind(recording, "calibrate"))
    return Calibration(
        recording=recording.name,
        mount=recording.mount,
        solver="joint",
        X=X,
        arm=arm,
        rig=solved.cameras.rig if solved.cameras else None,
        cameras=solved.cameras.cameras if solved.cameras else (),
        stereo_rms_px=solved.cameras.stereo_rms_px if solved.cameras else 0.0,
        placements=usable.placements,
        Ts_base_target=found.fit.state.Ts_stand_target,
        value_m2=float(objective_values(eq11, X[:3, :3], X[:3, 3])),
        rotation_length_m=options.rotation_length_m,
        pairs=eq11.pairs,
        search=None,
        certificate=certificate,
        shots=tuple(shot for shot, good in zip(all_evidence, kept, strict=True) if good),
        rejections=usable.rejections + wrong + unjudged + left_out,
        gates=(
            *gates_of(recorded, int(kept.sum()), certificate),
            agreement_gate(fitted),
            noise_gate(evidence),
            board_gate(size),
            *stereo_gates(recording, solved.cameras),
            *scale_gates(solved.data, found),
            *((heldout_gate(heldout, fitted),) if heldout else ()),
        ),
        scale_shots=tuple(recording.ids[s] for s in shots_of_kind(recording, "scale")) if solved.data.sightings else (),
        joint=evidence,
        heldout=heldout,
        print_sigma_m=solved.cameras.print_sigma_m if solved.cameras else 0.0,
        board=board_evidence(size, solved.cameras),
        tracker_points=sum(int(good.sum()) for good in found.kept[1:]) if tracked is not None else 0,
        inputs=dict(recording.inputs),
        versions=dict(versions or {}),
    )


def _board_scale(found: Estimate, Ts_base_flange: Floats, mount: str, Ts_head_target: Floats) -> BoardScale:
    """The board's size beside everything else that was estimated."""
    columns, state = found.problem.columns, found.fit.state
    step = np.zeros(columns.size)
    step[columns.lens_slice], step[columns.arm_slice] = state.lens_step, state.arm_step
    prior = np.column_stack([found.problem.prior, found.problem.prior @ step - found.problem.prior_right])
    carriers = Ts_base_flange if mount == EYE_IN_HAND else np.broadcast_to(np.eye(4), Ts_base_flange.shape)
    heads = carriers[:, :3, :3] @ _head(found)[:3, :3]
    linear, kept = found.fit.linear[0], found.kept[0].astype(np.float64)
    return scale_by_joint(
        linear, covariances(linear, found.scales), heads, prior, Ts_head_target=Ts_head_target, kept=kept
    )


def _kinematics(recording: Recording) -> Arm:
    if recording.joints is None or recording.arm is None:
        raise CalibrationError(
            "arm and head together need joint values and the robot's kinematics; this recording has flange poses "
            "only. Record joint values and name the robot, or calibrate the head alone with --solve paper"
        )
    return recording.arm


def _solved(
    recording: Recording,
    nominal: Arm,
    cameras: RigCalibration | None,
    *,
    tracked: TrackerData | None,
    options: SolveOptions,
    rejections: tuple[Rejection, ...],
    progress: Progress,
) -> _Solved:
    """The estimate, its cameras and its shots; lenses that the robot has moved locate the targets anew."""
    offset = np.zeros(len(cameras.covariance) if cameras else 0)
    for round_ in range(LENS_ROUNDS):
        progress.step(STAGE, round_, LENS_ROUNDS + 1)
        usable = usable_shots(recording, cameras, options, rejections)
        seen = motion_of(recording, usable)
        if not seen.complete:
            raise degenerate_motion(seen)
        data = joint_data(recording, nominal, usable, cameras, offset)
        if tracked is not None:
            data = replace(data, measured=tracked.data.measured, probed=tracked.data.probed)
        found = estimate(data, noise=options.noise)
        step = found.fit.state.lens_step
        if cameras is None or not len(step):
            break
        step_in_stds = np.abs(step) / np.sqrt(np.diag(cameras.covariance))
        if step_in_stds.max() < LENS_SETTLED:
            break
        cameras, offset = _with_lens(cameras, step), offset + step
    progress.step(STAGE, LENS_ROUNDS, LENS_ROUNDS + 1)
    found, verdicts = estimate_with_blocks(data, noise=options.noise, base=found)
    progress.step(STAGE, LENS_ROUNDS + 1, LENS_ROUNDS + 1)
    return _Solved(_with_evidence(cameras, found), usable, data, found, verdicts)


def _with_lens(cameras: RigCalibration, step: Floats) -> RigCalibration:
    rig = moved_rig(cameras.rig, cameras.unknowns, step)
    if rig is None:
        raise CalibrationError(
            "robot and images contradict each other about the lens: a focal length would not stay positive; check "
            "the target's size and the robot's unit of length"
        )
    return replace(cameras, rig=rig)


def _with_evidence(cameras: RigCalibration | None, found: Estimate) -> RigCalibration | None:
    """The cameras with the standard deviations of the joint estimate."""
    if cameras is None or not len(cameras.covariance):
        return cameras
    cameras = _with_lens(cameras, found.fit.state.lens_step)
    at = found.problem.columns.lens_slice
    covariance = found.covariance[at, at]
    stds = lens_stds(cameras.unknowns, covariance)
    evidence = tuple(replace(e, std=std) for e, std in zip(cameras.cameras, stds, strict=True))
    return replace(cameras, covariance=covariance, cameras=evidence)


def _in_pixels(noise: NoiseEvidence, cameras: RigCalibration | None) -> NoiseEvidence:
    """Noise of the pixels in pixels: as the images show it, beside what the detector states."""
    if noise.origin != "pixels" or cameras is None:
        return noise
    return NoiseEvidence("pixels", "px", noise.size * cameras.noise_px, cameras.stated_px)


def _head(found: Estimate) -> Floats:
    assert found.fit.state.X is not None  # noqa: S101 - shots have a head
    return found.fit.state.X


def _spread(fitted: Scatter, kept: npt.NDArray[np.bool_]) -> Scatter:
    """Residuals of the kept shots in the places of all; zero for those that were left out."""
    translations_m, rotations_rad = np.zeros(len(kept)), np.zeros(len(kept))
    translations_m[kept], rotations_rad[kept] = fitted.translations_m, fitted.rotations_rad
    return Scatter(translations_m, rotations_rad)


def _part(problem: HeadProblem, kept: npt.NDArray[np.bool_]) -> HeadProblem:
    numbers = np.unique(problem.placements[kept], return_inverse=True)[1]
    return HeadProblem(problem.Ts_outer[kept], problem.Ts_inner[kept], numbers)
