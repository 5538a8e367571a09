"""What are the lenses of the head, and how do its cameras stand to each other?

Given lenses and poses are kept; the rest is refined together over all cameras and shots: k1, k2, p1 and p2, k3 with
twenty views or more, rational or thin-prism terms or a fisheye where unseen views ask for them. Terms beyond k1 have a
prior about zero as wide as lenses are built: where the images say much it does not matter, where they say little a
superfluous term stays small instead of bending the image outside the corners, and the covariance knows both. None of
the usual terms is dropped: leaving out what is not quite zero would bias the others by many of their own standard
deviations.

What the residuals show beyond the noise that the detector states has its share in the weights
(:mod:`sixthlink.calibrate.unexplained`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.board_shape import board_shape
from sixthlink.calibrate.disc_centres import boards_with_disc_centres
from sixthlink.calibrate.fisheye_start import FISHEYE_FREE
from sixthlink.calibrate.lens_choice import lens_choice
from sixthlink.calibrate.lens_evidence import camera_evidence, refuse_uncertain_focal
from sixthlink.calibrate.lens_start import LensStart, beyond_reason, start_lens, view_poses, views_beyond
from sixthlink.calibrate.print_errors import PrintErrors, print_errors
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, refine_rig
from sixthlink.calibrate.rig_start import refusals_of, rejections_of, start_pose, without
from sixthlink.calibrate.unexplained import weighed
from sixthlink.camera import FISHEYE, LENS_NAMES, PLAIN_TERMS, Camera, CameraRig, RigUnknowns
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats, Ints, inverse
from sixthlink.progress import Progress, Silent
from sixthlink.recording import Detections, Recording, Rejection, shots_of_kind
from sixthlink.target import turn_names

__all__ = ["calibrate_rig"]

STAGE = "calibrating cameras"

VIEWS_FOR_K3 = 20
"""Fewer views than this seldom reach the corners of the image in which k3 shows."""

LENS_PRIOR = {"k2": 0.3, "p1": 5e-4, "p2": 5e-4, "k3": 0.3}
LENS_PRIOR |= {"k4": 0.5, "k5": 0.5, "k6": 0.5, "s1": 2e-3, "s2": 2e-3, "s3": 2e-3, "s4": 2e-3}
"""Standard deviations of lens terms about zero, as lenses are built; k1 and what the pinhole knows are left alone."""

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Start:
    """Where the refinement begins."""

    rig: CameraRig
    Ts_head_target: dict[int, Floats]
    detections: Detections
    rejections: list[Rejection]


def calibrate_rig(
    recording: Recording,
    detections: Detections,
    *,
    progress: Progress | None = None,
    flat: bool = False,
    named: bool = False,
) -> RigCalibration:
    """Calibrate what the recording does not give of its cameras.

    Args:
        recording: The recording; its calibration shots are used.
        detections: What the cameras saw.
        progress: Listener.
        flat: Whether the target counts as flat, whatever the images show.
        named: Whether a target that looks the same after a turn is read from the same end in all shots.

    Raises:
        TooFewShotsError: A camera has fewer than three usable views, or fewer than three together with the reference.
        CalibrationError: The views do not determine a lens, or contradict what is given.
    """
    listener = progress or Silent()
    if recording.target is None or not recording.head.cameras:
        raise CalibrationError("the recording describes no target or no camera, so there is no camera to calibrate")
    start = _start(recording, detections, listener)
    listener.step(STAGE, 2, 4)
    given = np.array([d.camera is not None for d in recording.head.cameras])
    free_lens = _first_terms(given, start)
    shots, problem, fit = _refined(recording, start, free_lens)
    if recording.target.circle_radii_m.any():
        start = replace(start, rig=fit.rig, detections=boards_with_disc_centres(recording, start.detections, fit.rig))
        shots, problem, fit = _refined(recording, start, free_lens)
    listener.step(STAGE, 3, 4)
    refused = _contradicting(shots, problem, fit)
    if refused:
        start.rejections.extend(rejections_of(refused, recording.ids, ""))
        kept = {s: T for s, T in start.Ts_head_target.items() if s not in refused}
        start = replace(start, Ts_head_target=kept, detections=without(start.detections, set(refused)))
        shots, problem, fit = _refined(recording, start, free_lens)
    stated_px = problem.sigmas_px
    models, problem, fit = lens_choice(*weighed(problem, fit, stated_px))
    problem, fit = weighed(problem, fit, stated_px)
    target = recording.target
    turn = None if named else target.turn
    shape = None if flat else board_shape(problem, fit, target.points_m, stated_px, turn)
    points_m = target.points_m
    if shape is not None:
        bend, problem, fit = shape
        points_m = points_m + bend.offsets_m
    # A target that may have been read from either end has no corner that is surely the same in all shots.
    printed = print_errors(problem, fit, stated_px) if turn is None else None
    if printed is not None:
        misprints, problem, fit = printed
        points_m = _corrected(points_m, misprints)
    refuse_uncertain_focal(problem, fit)
    listener.step(STAGE, 4, 4)
    return replace(
        _result(start, problem, fit, ~given, stated_px),
        points_m=points_m,
        print_sigma_m=0.0 if printed is None else printed[0].sigma_m,
        shape=None if shape is None else shape[0],
        models=models,
    )


def _start(recording: Recording, detections: Detections, listener: Progress) -> _Start:
    """First lenses, camera poses and target poses, and the detections that survive them."""
    target = recording.target
    assert target is not None  # noqa: S101 - the caller made sure
    wanted = shots_of_kind(recording, "calibrate")
    points_m, turn = target.points_m, target.turn
    cameras, poses, single = _lenses(recording, points_m, detections, wanted)
    listener.step(STAGE, 1, 4)
    Ts_camera_head, pairs = [np.eye(4)], []
    reference = recording.head.cameras[0].name
    for c, description in enumerate(recording.head.cameras[1:], start=1):
        pair = (reference, description.name)
        between = start_pose(pair, poses[0], poses[c], points_m, turn, description.T_camera_head)
        detections = _turned(detections, between.turned, c, turn_names(turn, len(points_m)))
        Ts_camera_head.append(between.T_camera_head)
        pairs.append(between)
    refusals = refusals_of(single, pairs)
    rejections: list[Rejection] = []
    for at, refused in refusals.items():
        name = "" if at is None else recording.head.cameras[at].name
        rejections.extend(rejections_of(refused, recording.ids, name))
        detections = without(detections, set(refused), at)
    rig = CameraRig(tuple(d.name for d in recording.head.cameras), tuple(cameras), np.stack(Ts_camera_head))
    alive = set(detections.shots[np.isin(detections.shots, wanted)].tolist())
    Ts_head_target: dict[int, Floats] = {}
    for c in reversed(range(len(cameras))):  # the reference speaks last
        T_head_camera = inverse(rig.Ts_camera_head[c])
        good = alive - refusals[c].keys()
        Ts_head_target |= {s: T_head_camera @ T for s, T in poses[c].items() if s in good}
    return _Start(rig, Ts_head_target, detections, rejections)


def _lenses(
    recording: Recording, points_m: Floats, detections: Detections, wanted: Ints
) -> tuple[list[Camera], list[dict[int, Floats]], list[dict[int, str]]]:
    """Per camera: its given or first lens, the target's pose in each view, and which views it refused by itself."""
    cameras: list[Camera] = []
    poses: list[dict[int, Floats]] = []
    single: list[dict[int, str]] = []
    for c, description in enumerate(recording.head.cameras):
        seen = _seen(detections, wanted, c)
        lens = LensStart(description.camera, {}) if description.camera else start_lens(description, points_m, seen)
        cameras.append(lens.camera)
        single.append(lens.refused)
        poses.append(view_poses(description.name, lens.camera, points_m, seen))
    return cameras, poses, single


def _seen(detections: Detections, shots: Ints, camera: int) -> Detections:
    rows = np.isin(detections.shots, shots) & (detections.cameras == camera)
    return _rows(detections, np.flatnonzero(rows), detections.points[rows])


def _turned(detections: Detections, turned: dict[int, int], camera: int, names: Ints) -> Detections:
    """Detections in which one camera's names in some shots are turned."""
    points = detections.points.copy()
    for shot, turns in turned.items():
        rows = (detections.shots == shot) & (detections.cameras == camera)
        points[rows] = names[turns, points[rows]]
    return _rows(detections, np.arange(len(points)), points)


def _rows(d: Detections, rows: Ints, points: Ints) -> Detections:
    return Detections(d.shots[rows], d.cameras[rows], points, d.pixels[rows], d.sigmas_px[rows])


def _first_terms(given: Bools, start: _Start) -> Bools:
    """``(C, 16)`` lens terms that are free to begin with."""
    free = np.repeat(~given[:, None], len(LENS_NAMES), axis=1)
    free[:, LENS_NAMES.index("k4") :] = False
    d = start.detections
    for c, camera in enumerate(start.rig.cameras):
        if given[c]:
            continue
        if camera.model == FISHEYE:
            free[c] = FISHEYE_FREE
        elif camera.distortion[PLAIN_TERMS:].any():
            free[c, LENS_NAMES.index("k3") : LENS_NAMES.index("k6") + 1] = True
        else:
            views = set(d.shots[d.cameras == c].tolist()) & start.Ts_head_target.keys()
            free[c, LENS_NAMES.index("k3")] = len(views) >= VIEWS_FOR_K3
    return free


def _refined(recording: Recording, start: _Start, free_lens: Bools) -> tuple[list[int], RigProblem, RigFit]:
    """The refinement over all shots with a first pose: their indices, the problem and its answer."""
    assert recording.target is not None  # noqa: S101 - the caller made sure
    d = start.detections
    shots = sorted(start.Ts_head_target.keys() & set(d.shots.tolist()))
    if not shots:
        raise CalibrationError(
            "no calibration shot shows the target well enough to locate it; "
            "check the images and the target's description"
        )
    rows = np.flatnonzero(np.isin(d.shots, shots))
    rows = rows[np.argsort(d.shots[rows], kind="stable")]
    free_pose = np.array([c > 0 and e.T_camera_head is None for c, e in enumerate(recording.head.cameras)])
    problem = RigProblem(
        slots=np.searchsorted(shots, d.shots[rows]),
        cameras=d.cameras[rows],
        points=d.points[rows],
        points_target=recording.target.points_m[d.points[rows]],
        pixels=d.pixels[rows],
        sigmas_px=d.sigmas_px[rows],
        unknowns=RigUnknowns(free_lens, free_pose),
        lens_prior=np.tile([LENS_PRIOR.get(name, np.inf) for name in LENS_NAMES], (len(free_pose), 1)),
    )
    return shots, problem, refine_rig(problem, start.rig, np.stack([start.Ts_head_target[s] for s in shots]))


def _contradicting(shots: list[int], problem: RigProblem, fit: RigFit) -> dict[int, str]:
    """Shots whose pixels the common answer explains far worse than those of the others."""
    squares = np.bincount(problem.slots, weights=np.sum(fit.residuals_px**2, axis=1))
    rms = np.sqrt(squares / (2.0 * np.bincount(problem.slots)))
    return {shots[k]: beyond_reason(float(rms[k]), float(np.median(rms))) for k in views_beyond(rms)}


def _corrected(points_m: Floats, found: PrintErrors) -> Floats:
    """Points of the target where the images show them."""
    corrected = points_m.copy()
    corrected[found.points, :2] += found.offsets_m
    return corrected


def _result(start: _Start, problem: RigProblem, fit: RigFit, calibrated: Bools, stated_px: Floats) -> RigCalibration:
    seen = np.zeros((len(fit.Ts_head_target), len(calibrated)), dtype=bool)
    seen[problem.slots, problem.cameras] = True
    shared = (seen.sum(axis=1) > 1)[problem.slots]
    unexplained_px = float(np.sqrt(problem.sigmas_px[0] ** 2 - stated_px[0] ** 2))
    return RigCalibration(
        rig=fit.rig,
        cameras=camera_evidence(problem, fit, calibrated),
        stereo_rms_px=float(np.sqrt(np.mean(fit.residuals_px[shared] ** 2))) if shared.any() else 0.0,
        noise_px=fit.noise_px,
        stated_px=float(np.sqrt(np.mean(stated_px**2))),
        noise_ratio=fit.noise_px / float(np.sqrt(np.mean(problem.sigmas_px**2))),
        detections=replace(start.detections, sigmas_px=np.hypot(start.detections.sigmas_px, unexplained_px)),
        rejections=tuple(start.rejections),
        unknowns=problem.unknowns,
        covariance=fit.covariance,
    )
