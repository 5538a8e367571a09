"""Lenses and stereo pose from pixels whose truth is known: projected by OpenCV, so no formula is shared."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.calibrate import calibrate_rig, cameras
from sixthlink.calibrate.fisheye_start import FISHEYE_FREE
from sixthlink.camera import (
    LENS_NAMES,
    Camera,
    camera_with_lens,
    lens_vector,
    pixel_jacobian,
    pixels_from_points,
    rays_from_pixels,
)
from sixthlink.errors import CalibrationError, TooFewShotsError
from sixthlink.recording import CameraDescription, Detections, Head, Recording
from sixthlink.target import Chessboard, turn_names

NOISE = 0.05
SIZE = (1200, 960)
BOARD = Chessboard(9, 6, 0.03)
SYMMETRIC = Chessboard(8, 6, 0.03)
RIGHT = Camera(
    *SIZE, np.array([2400.0, 2405.0]), np.array([612.0, 470.0]), np.array([-0.11, 0.3, 1.5e-3, -1.2e-3, 0.0])
)
LEFT = Camera(
    *SIZE, np.array([2420.0, 2418.0]), np.array([590.0, 492.0]), np.array([-0.09, 0.28, -1.4e-3, 1.6e-3, 0.0])
)
T_LEFT_RIGHT = np.eye(4)
T_LEFT_RIGHT[:3, :3] = Rotation.from_euler("yx", [-18.0, 1.0], degrees=True).as_matrix()
T_LEFT_RIGHT[:3, 3] = [0.2, 0.003, 0.03]


@dataclass(frozen=True)
class Rehearsal:
    """A recording of pixels and what is true in it."""

    recording: Recording
    detections: Detections
    Ts_head_target: np.ndarray


def rehearsal(
    shots=14, *, seed=0, target=BOARD, lenses=(RIGHT, LEFT), tilt_deg=25.0, noise=NOISE, spread=0.05
) -> Rehearsal:
    """A target before a stereo head (or its right camera alone), all points seen by all cameras."""
    rng = np.random.default_rng(seed)
    middle = target.points_m.mean(axis=0)
    Ts, rows = np.tile(np.eye(4), (shots, 1, 1)), []
    for s in range(shots):
        angles = [*rng.uniform(-tilt_deg, tilt_deg, 2), rng.uniform(-180.0, 180.0)]
        Ts[s, :3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
        place = np.array([*rng.uniform(-spread, spread, 2), rng.uniform(0.6, 0.8)])
        Ts[s, :3, 3] = place - Ts[s, :3, :3] @ middle
        for c, lens in enumerate(lenses):
            T = (np.eye(4), T_LEFT_RIGHT)[c] @ Ts[s]
            pixels = projected(lens, T, target.points_m) + rng.normal(0.0, noise, (len(target.points_m), 2))
            rows.append((np.full(len(pixels), s), np.full(len(pixels), c), np.arange(len(pixels)), pixels))
    detections = Detections(
        *(np.concatenate(column) for column in zip(*rows, strict=True)), np.full(total(rows), NOISE)
    )
    names = ("right", "left")[: len(lenses)]
    head = Head(tuple(CameraDescription(name, *SIZE) for name in names))
    recording = Recording(
        name="rehearsal",
        mount="eye-in-hand",
        robot="",
        arm=None,
        head=head,
        target=target,
        standard=None,
        ids=tuple(f"s{s}" for s in range(shots)),
        placements=("p",) * shots,
        kinds=("calibrate",) * shots,
        marks=("",) * shots,
        Ts_base_flange=np.tile(np.eye(4), (shots, 1, 1)),
        pixels=detections,
    )
    return Rehearsal(recording, detections, Ts)


def total(rows):
    return sum(len(row[0]) for row in rows)


def projected(lens, T, points_m):
    rotation, _ = cv2.Rodrigues(T[:3, :3])
    if lens.model == "fisheye":
        terms = np.array(lens.written_distortion)
        pixels, _ = cv2.fisheye.projectPoints(points_m[:, None], rotation, T[:3, 3], lens.matrix, terms)
        return np.asarray(pixels).reshape(-1, 2)
    pixels, _ = cv2.projectPoints(points_m, rotation, T[:3, 3], lens.matrix, lens.distortion)
    return np.asarray(pixels).reshape(-1, 2)


def describing(case, **given):
    """The same recording with something given of its cameras: ``right`` and ``left`` descriptions."""
    cameras = tuple(given.get(d.name, d) for d in case.recording.head.cameras)
    return replace(case.recording, head=Head(cameras))


def moved(detections, mask, pixels):
    changed = detections.pixels.copy()
    changed[mask] = pixels
    return replace(detections, pixels=changed)


def exchanged(detections, shots):
    rows = np.isin(detections.shots, shots)
    return replace(detections, cameras=np.where(rows, 1 - detections.cameras, detections.cameras))


def parameters(result):
    """Free parameters of a result that have a truth beside them, minus that truth."""
    truth = {}
    for name, lens in (("right", RIGHT), ("left", LEFT)):
        values = [*lens.focal_px, *lens.centre_px, *lens.distortion]
        truth |= {f"{name}.{key}": value for key, value in zip(LENS_NAMES, values, strict=True)}
    found = {}
    for name, lens in zip(result.rig.names, result.rig.cameras, strict=True):
        values = [*lens.focal_px, *lens.centre_px, *lens.distortion]
        found |= {f"{name}.{key}": v for key, v in zip(LENS_NAMES, values, strict=True)}
    T = result.rig.Ts_camera_head[1]
    turn = Rotation.from_matrix(T[:3, :3] @ T_LEFT_RIGHT[:3, :3].T).as_rotvec()
    found |= {f"left.{axis}": v for axis, v in zip("xyz", T[:3, 3] - T_LEFT_RIGHT[:3, 3], strict=True)}
    found |= {f"left.rotation_{axis}": v for axis, v in zip("xyz", turn, strict=True)}
    return np.array([found[name] - truth.get(name, 0.0) for name in result.names])


@pytest.fixture(scope="module")
def case():
    return rehearsal()


@pytest.fixture(scope="module")
def result(case):
    return calibrate_rig(case.recording, case.detections)


def test_without_noise_the_truth_comes_back():
    exact = rehearsal(24, noise=0.0)
    result = calibrate_rig(exact.recording, outweighing(exact.detections))
    # Detections are exact to double precision, so only k3's absence (true value 0) or presence is rounding.
    assert np.abs(result.rig.Ts_camera_head[1] - T_LEFT_RIGHT).max() < 1e-8
    for lens, truth in zip(result.rig.cameras, (RIGHT, LEFT), strict=True):
        assert np.abs(lens.focal_px - truth.focal_px).max() < 1e-4
        assert np.abs(lens.distortion - truth.distortion).max() < 1e-5
    assert result.noise_px < 1e-6


def outweighing(detections):
    """The same pixels, stated so exact that what is known of lenses beforehand does not count."""
    return replace(detections, sigmas_px=1e-4 * detections.sigmas_px)


def test_errors_are_as_large_as_the_covariance_says():
    """Over many rehearsals the squared errors, whitened by the stated covariance, average to one each."""
    scores = []
    for seed in range(12):
        case = rehearsal(12, seed=seed)
        result = calibrate_rig(case.recording, case.detections)
        assert result.rejections == ()
        error = parameters(result)
        scores.append(error @ np.linalg.solve(result.covariance, error) / len(error))
    assert 0.75 < np.mean(scores) < 1.3, scores


def test_the_noise_is_read_from_the_residuals(result):
    assert result.noise_px == pytest.approx(NOISE, rel=0.04)
    assert result.stereo_rms_px < result.noise_px, "the fitted parameters take their share"


def unequal(case, more, seed=1):
    """The same views, one of five seen ten times as sharply, all off by ``more`` pixels beyond what is stated."""
    exact = rehearsal(len(case.Ts_head_target), noise=0.0).detections
    sigmas = np.where(exact.shots % 5 == 0, 0.1 * NOISE, NOISE)
    size = np.hypot(sigmas, more)[:, None]
    off = size * np.random.default_rng(seed).standard_normal(exact.pixels.shape)
    return replace(exact, pixels=exact.pixels + off, sigmas_px=sigmas)


def test_stated_noise_that_says_it_all_is_believed(case):
    d = unequal(case, 0.0)
    result = calibrate_rig(case.recording, d)
    assert result.detections.sigmas_px == pytest.approx(d.sigmas_px, rel=0.1)
    assert result.noise_ratio == pytest.approx(1.0, abs=0.05)


def test_sharp_views_do_not_outweigh_where_something_else_is_wrong(case):
    """A board that is bent or misprinted is so in sharp views too: all views count nearly alike."""
    d = unequal(case, 20.0 * NOISE)
    result = calibrate_rig(case.recording, d)
    alike = calibrate_rig(case.recording, replace(d, sigmas_px=np.full(len(d), NOISE)))
    assert result.detections.sigmas_px == pytest.approx(20.0 * NOISE, rel=0.05)
    assert result.stated_px == pytest.approx(float(np.sqrt(np.mean(d.sigmas_px**2))))
    stds = np.sqrt(np.diag(alike.covariance))
    assert (np.abs(parameters(result) - parameters(alike)) < 0.05 * stds).all()
    assert np.sqrt(np.diag(result.covariance)) == pytest.approx(stds, rel=0.05)


def test_opencvs_joint_stereo_calibration_agrees(case, monkeypatch):
    """Without what is known of lenses beforehand, of which OpenCV knows nothing."""
    monkeypatch.setattr(cameras, "LENS_PRIOR", {})
    d = case.detections
    result = calibrate_rig(case.recording, d)
    views = [[d.pixels[(d.shots == s) & (d.cameras == c)].astype(np.float32) for s in range(14)] for c in (0, 1)]
    boards = [BOARD.points_m.astype(np.float32)] * 14
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 300, 1e-14)
    flags = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3
    answer = cv2.stereoCalibrate(
        boards,
        views[0],
        views[1],
        RIGHT.matrix,
        RIGHT.distortion.copy(),
        LEFT.matrix,
        LEFT.distortion.copy(),
        SIZE,
        flags=flags,
        criteria=criteria,
    )
    rms, K_right, _, K_left, _, R, t = (np.asarray(value) for value in answer[:7])
    ours = result.stereo_rms_px * np.sqrt(2.0)
    assert ours == pytest.approx(float(rms), rel=1e-3)
    assert ours < float(rms) * (1.0 + 5e-5), "the same minimum, but for the rounding of OpenCV's input"
    if cv2.__version__.startswith("4"):
        return  # it stops half a pixel short of the minimum, though hardly above it
    for lens, K in zip(result.rig.cameras, (K_right, K_left), strict=True):
        assert np.abs(lens.matrix - K).max() < 0.05
    assert np.abs(result.rig.Ts_camera_head[1, :3, :3] - R).max() < 5e-6
    assert np.abs(result.rig.Ts_camera_head[1, :3, 3] - t.ravel()).max() < 5e-6


def test_what_is_given_is_kept_bit_for_bit(case):
    right = CameraDescription("right", *SIZE, RIGHT)
    left = CameraDescription("left", *SIZE, LEFT, T_LEFT_RIGHT)
    result = calibrate_rig(describing(case, right=right, left=left), case.detections)
    for lens, truth in zip(result.rig.cameras, (RIGHT, LEFT), strict=True):
        assert np.array_equal(lens.matrix, truth.matrix)
        assert np.array_equal(lens.distortion, truth.distortion)
    assert np.array_equal(result.rig.Ts_camera_head[1], T_LEFT_RIGHT)
    assert [e.calibrated for e in result.cameras] == [False, False]
    assert result.names == ()
    assert result.noise_px == pytest.approx(NOISE, rel=0.04)


def test_one_given_camera_helps_the_other(case, result):
    mixed = calibrate_rig(describing(case, right=CameraDescription("right", *SIZE, RIGHT)), case.detections)
    assert np.array_equal(mixed.rig.cameras[0].matrix, RIGHT.matrix)
    assert [e.calibrated for e in mixed.cameras] == [False, True]
    assert (mixed.cameras[0].std == 0).all()
    assert mixed.cameras[1].std[0] < result.cameras[1].std[0]
    assert not any(name.startswith("right.") for name in mixed.names)


def test_one_camera_alone_has_no_stereo():
    case = rehearsal(lenses=(RIGHT,))
    result = calibrate_rig(case.recording, case.detections)
    assert result.stereo_rms_px == 0.0
    assert result.rig.names == ("right",)
    assert np.abs(result.rig.cameras[0].focal_px - RIGHT.focal_px).max() < 5 * result.cameras[0].std[0]


def test_lens_terms_that_the_lens_has_not_stay_small_also_outside_the_corners():
    plain = replace(RIGHT, distortion=np.array([-0.11, 0.0, 0.0, 0.0, 0.0]))
    edge = plain.matrix[:2, 2] + np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * np.array(SIZE) / 2
    bends = []
    for seed in range(6):
        case = rehearsal(24, lenses=(plain,), seed=seed)
        found = calibrate_rig(case.recording, case.detections)
        distortion, std = found.rig.cameras[0].distortion[:5], found.cameras[0].std[4:9]
        assert (np.abs(distortion - plain.distortion[:5]) < 4.0 * std).all()
        rays = rays_from_pixels(plain, edge)
        bends.append(np.linalg.norm(pixels_from_points(found.rig.cameras[0], rays) - edge, axis=1).max())
    assert np.median(bends) < 1.0


def test_few_tilted_views_do_not_run_away_into_tangential_terms():
    case = rehearsal(5, lenses=(RIGHT,), seed=2, tilt_deg=12.0, spread=0.01)
    distortion = calibrate_rig(case.recording, case.detections).rig.cameras[0].distortion
    assert distortion[0] == pytest.approx(-0.11, abs=0.01)
    assert np.abs(distortion[2:4]).max() < 1.5e-3


def test_k3_is_kept_where_it_shows_and_enough_views_say_so():
    strong = Camera(*SIZE, np.full(2, 1200.0), RIGHT.centre_px, np.array([-0.25, 0.15, 0.0, 0.0, -0.3]))
    many = rehearsal(30, lenses=(strong,), spread=0.17)
    assert calibrate_rig(many.recording, many.detections).rig.cameras[0].distortion[4] == pytest.approx(-0.3, abs=0.06)
    few = rehearsal(12, lenses=(strong,), spread=0.17)
    assert calibrate_rig(few.recording, few.detections).rig.cameras[0].distortion[4] == 0.0


def test_two_views_are_too_few():
    case = rehearsal(2, lenses=(RIGHT,))
    with pytest.raises(TooFewShotsError, match=r"camera 'right': 2 usable views.*or give the intrinsics") as few:
        calibrate_rig(case.recording, case.detections)
    assert (few.value.needed, few.value.usable) == (3, 2)


def test_views_without_tilt_do_not_make_a_lens():
    case = rehearsal(8, lenses=(RIGHT,), tilt_deg=0.2)
    with pytest.raises(CalibrationError, match=r"do not determine the intrinsics.*tilted by 15° to 30°"):
        calibrate_rig(case.recording, case.detections)


def test_a_spoilt_view_is_named_and_the_rest_is_as_if_it_had_never_been(case):
    d = case.detections
    rows = (d.shots == 5) & (d.cameras == 1)
    shaken = moved(d, rows, d.pixels[rows] + np.random.default_rng(1).normal(0.0, 3.0, (rows.sum(), 2)))
    result = calibrate_rig(case.recording, shaken)
    assert [(r.shot, r.camera) for r in result.rejections] == [("s5", "left")]
    assert "way beyond the median" in result.rejections[0].reason
    assert result.noise_px == pytest.approx(NOISE, rel=0.05)
    assert not ((result.detections.shots == 5) & (result.detections.cameras == 1)).any()
    assert ((result.detections.shots == 5) & (result.detections.cameras == 0)).any()


def test_exchanged_images_of_one_shot_are_named(case):
    result = calibrate_rig(case.recording, exchanged(case.detections, [3]))
    assert [(r.shot, r.camera, r.reason) for r in result.rejections] == [
        ("s3", "", "the images of 'right' and 'left' look exchanged")
    ]
    assert result.noise_px == pytest.approx(NOISE, rel=0.05)


def test_images_exchanged_throughout_contradict_a_given_rig(case):
    right = CameraDescription("right", *SIZE, RIGHT)
    left = CameraDescription("left", *SIZE, LEFT, T_LEFT_RIGHT)
    with pytest.raises(CalibrationError, match=r"look exchanged in 14 of 14 shots.*exchange their image columns"):
        calibrate_rig(describing(case, right=right, left=left), exchanged(case.detections, range(14)))


def test_a_given_pose_that_fits_nothing_is_refused(case):
    wrong = T_LEFT_RIGHT.copy()
    wrong[:3, 3] = [0.2, 0.4, 0.0]
    left = CameraDescription("left", *SIZE, LEFT, wrong)
    right = CameraDescription("right", *SIZE, RIGHT)
    with pytest.raises(CalibrationError, match=r"given pose of camera 'left' fits none of 14 shots"):
        calibrate_rig(describing(case, right=right, left=left), case.detections)


def test_images_of_different_moments_are_named(case):
    d = case.detections
    late, next_shot = (d.shots == 7) & (d.cameras == 1), (d.shots == 8) & (d.cameras == 1)
    result = calibrate_rig(case.recording, moved(d, late, d.pixels[next_shot]))
    assert [r.shot for r in result.rejections] == ["s7"]
    assert "same moment" in result.rejections[0].reason


def test_cameras_that_never_see_the_target_together_are_refused(case):
    d = case.detections
    apart = replace(
        d,
        **{
            name: getattr(d, name)[(d.shots % 2) == d.cameras]
            for name in ("shots", "cameras", "points", "pixels", "sigmas_px")
        },
    )
    with pytest.raises(TooFewShotsError, match="see the target together in 0 shots"):
        calibrate_rig(case.recording, apart)


def test_shots_that_one_camera_missed_still_count(case, result):
    d = case.detections
    kept = ~((d.cameras == 1) & np.isin(d.shots, [0, 1, 2]))
    fewer = Detections(d.shots[kept], d.cameras[kept], d.points[kept], d.pixels[kept], d.sigmas_px[kept])
    partly = calibrate_rig(case.recording, fewer)
    assert [e.images for e in partly.cameras] == [14, 11]
    assert np.abs(partly.rig.Ts_camera_head[1] - result.rig.Ts_camera_head[1]).max() < 1e-3


@pytest.mark.parametrize("target", [SYMMETRIC, Chessboard(6, 6, 0.03)], ids=["half turn", "quarter turn"])
def test_a_symmetric_board_read_from_different_ends_is_put_right(target):
    case = rehearsal(target=target)
    d = case.detections
    names = turn_names(target.turn, len(target.points_m))
    turns = np.zeros(14, dtype=int)
    turns[[1, 4, 5, 9]] = np.array([1, -1, 2, 3]) % len(names)
    mixed = replace(d, points=np.where(d.cameras == 1, names[turns[d.shots], d.points], d.points))
    straight, result = (calibrate_rig(case.recording, seen) for seen in (d, mixed))
    assert result.rejections == ()
    assert np.array_equal(result.detections.points, d.points)
    assert np.abs(result.rig.Ts_camera_head[1] - straight.rig.Ts_camera_head[1]).max() < 1e-9


def test_marks_of_the_length_standard_play_no_part(case, result):
    d = case.detections
    kinds = (*case.recording.kinds[:-1], "verify")
    recording = replace(case.recording, kinds=kinds, marks=(*case.recording.marks[:-1], "A"))
    mark = d.shots != 13
    mark[np.flatnonzero(~mark)[0]] = True
    with_mark = Detections(d.shots[mark], d.cameras[mark], d.points[mark], d.pixels[mark], d.sigmas_px[mark])
    without = calibrate_rig(recording, with_mark)
    assert [e.images for e in without.cameras] == [13, 13]
    assert (without.detections.shots == 13).any(), "its row is handed on untouched"


def test_progress_is_told(case):
    steps = []

    class Listener:
        def step(self, stage, done, total):
            steps.append((stage, done, total))

    calibrate_rig(case.recording, case.detections, progress=Listener())
    assert steps == [("calibrating cameras", k, 4) for k in (1, 2, 3, 4)]


WIDE = Camera(*SIZE, np.full(2, 420.0), np.array([601.0, 478.0]), np.array([0.3, 0.0, 0, 0, 0, 0.8, 0.1, 0.0]))
ASKEW = Camera(
    *SIZE,
    np.full(2, 900.0),
    np.array([601.0, 478.0]),
    np.array([-0.1, 0.02, 0, 0, 0, 0, 0, 0, 2e-2, 2e-2, -1.5e-2, -2e-2]),
)


FISH = Camera(
    *SIZE, np.full(2, 420.0), np.array([601.0, 478.0]), np.array([-0.03, 0.006, -0.002, 0.0003]), model="fisheye"
)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("lens", "models"), [(WIDE, {"rational", "fisheye"}), (ASKEW, {"thin prism"})])
def test_a_lens_that_asks_for_more_terms_gets_them(lens, models, seed):
    """Unseen views choose; with the terms the residuals are the noise again. A fisheye can bend as a wide lens does."""
    seen = rehearsal(30, seed=seed, lenses=(lens,), spread=0.7 if lens is WIDE else 0.3)
    found = calibrate_rig(seen.recording, seen.detections)
    (entered,) = (m.model for m in found.models if m.entered)
    assert entered in models
    assert found.rig.cameras[0].distortion[5:].any()
    assert found.noise_px == pytest.approx(NOISE, rel=0.05)
    off = lens_vector(found.rig.cameras[0]) - lens_vector(lens)
    assert (np.abs(off[:4]) < 4.0 * found.cameras[0].std[:4]).all()


def test_a_plain_lens_is_not_given_more_terms():
    for seed in range(4):
        seen = rehearsal(20, seed=seed, lenses=(RIGHT,))
        assert not any(m.entered for m in calibrate_rig(seen.recording, seen.detections).models)


@pytest.mark.parametrize("reach_m", [0.6, 0.9, 1.3])
def test_a_fisheye_is_told_from_a_pinhole(reach_m):
    """Points up to 50°, 60° and 67° from the axis: only noise is left, the focal length is right within its doubt."""
    seen = rehearsal(30, lenses=(FISH,), spread=reach_m)
    found = calibrate_rig(seen.recording, seen.detections)
    camera, (evidence,) = found.rig.cameras[0], found.cameras
    assert camera.model == "fisheye"
    assert found.noise_px == pytest.approx(NOISE, rel=0.05)
    off = lens_vector(camera) - lens_vector(FISH)
    assert (np.abs(off[:4]) < 4.0 * evidence.std[:4]).all()
    assert not found.rejections


@pytest.mark.parametrize("lens", [RIGHT, WIDE, ASKEW, FISH], ids=["plain", "wide", "askew", "fisheye"])
def test_pixels_are_those_of_opencv_and_rays_lead_back(lens):
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-0.3, 0.3, (50, 2)), rng.uniform(0.8, 1.2, 50)])
    pixels = pixels_from_points(lens, points)
    assert pixels == pytest.approx(projected(lens, np.eye(4), points), abs=1e-9)
    assert rays_from_pixels(lens, pixels) == pytest.approx(points / points[:, 2:], abs=1e-9)


@pytest.mark.parametrize("angle_deg", [0.0, 1e-5, 30.0, 80.0])
def test_fisheyes_see_near_the_axis_and_far_from_it(angle_deg):
    angle = np.deg2rad(angle_deg)
    points = np.array([[np.sin(angle), 0.0, np.cos(angle)], [0.0, -np.sin(angle), np.cos(angle)]])
    pixels = pixels_from_points(FISH, points)
    assert pixels == pytest.approx(projected(FISH, np.eye(4), points), abs=1e-9)
    assert rays_from_pixels(FISH, pixels) == pytest.approx(points / points[:, 2:], abs=1e-9)


@pytest.mark.parametrize("lens", [RIGHT, WIDE, ASKEW, FISH], ids=["plain", "wide", "askew", "fisheye"])
def test_derivatives_are_those_of_the_pixels(lens):
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-0.3, 0.3, (20, 2)), rng.uniform(0.8, 1.2, 20)])
    _, by_point, by_lens = pixel_jacobian(lens, points)
    for k in range(3):
        step = 1e-6 * np.eye(3)[k]
        slope = (pixels_from_points(lens, points + step) - pixels_from_points(lens, points - step)) / 2e-6
        assert by_point[..., k] == pytest.approx(slope, rel=1e-6, abs=1e-4)
    for k in np.flatnonzero(FISHEYE_FREE) if lens is FISH else range(len(LENS_NAMES)):
        ends = []
        for side in (-1.0, 1.0):
            vector = lens_vector(lens)
            vector[k] += side * 1e-5
            ends.append(pixels_from_points(camera_with_lens(lens, vector), points))
        assert by_lens[..., k] == pytest.approx((ends[1] - ends[0]) / 2e-5, rel=1e-5, abs=1e-5)
