"""Circle grids in images: every disc by its name, sure of what is said, refused by name, and never mirrored.

The truth is the middle of the ellipse as which a disc is seen, fitted to many points of its rim as the simulated lens
shows them; it is not where the disc's centre is seen.
"""

import re
import time
from functools import cache

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.camera import Camera
from sixthlink.simulate.optics import sensor_positions
from sixthlink.simulate.render import Exposure, render_target
from sixthlink.target import AsymmetricCircleGrid, CircleGrid, DotGrid, Drawing, Found, NotFound, turn_names

CIRCLES = CircleGrid(9, 7, 0.02, 0.010)
ASYMMETRIC = AsymmetricCircleGrid(4, 11, 0.015, 0.012)
DOTS = DotGrid(8, 6, 0.022, 0.009, 0.014)
KINDS = {"circles": CIRCLES, "asymmetric": ASYMMETRIC, "dots": DOTS}
LENS = (-0.15, 0.03, 0.001, -0.001, 0.0)


def camera(*, width=800, height=600, focal=900.0, distortion=LENS):
    centre = np.array([(width - 1) / 2, (height - 1) / 2])
    return Camera(width, height, np.array([focal, focal]), centre, np.array(distortion))


def pose(target, *, tilt=0.0, turn=0.0, towards=30.0, distance=0.36):
    """The middle of the target before the camera, tilted towards one side [deg, m]."""
    axis = np.array([np.cos(np.deg2rad(towards)), np.sin(np.deg2rad(towards)), 0.0])
    R = Rotation.from_rotvec(tilt * axis, degrees=True) * Rotation.from_euler("z", turn, degrees=True)
    T_camera_target = np.eye(4)
    T_camera_target[:3, :3] = R.as_matrix()
    middle = 0.5 * (target.points_m.min(axis=0) + target.points_m.max(axis=0))
    T_camera_target[:3, 3] = [0.0, 0.0, distance] - R.as_matrix() @ middle
    return T_camera_target


def middle_of_ellipse(points):
    """Centre of the conic through points: the last row of the singular vectors of its equations."""
    low, size = points.mean(axis=0), points.std()
    x, y = ((points - low) / size).T
    a, b, c, d, e, _ = np.linalg.svd(np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1))[2][-1]
    return low - size * np.linalg.solve([[2 * a, b], [b, 2 * c]], [d, e])


def truth(target, lens, T_camera_target):
    angle = np.arange(120) * (2.0 * np.pi / 120)
    rims = target.circle_radii_m[:, None, None] * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)
    rims = (target.points_m[:, None] + rims) @ T_camera_target[:3, :3].T + T_camera_target[:3, 3]
    return np.array([middle_of_ellipse(rim) for rim in sensor_positions(lens, rims)])


def shot(target, *, seed=0, lens=None, strays=None, exposure=None, **where):
    """An image and the true middles."""
    lens = lens or camera()
    T_camera_target = pose(target, **where)
    drawing = target.drawing
    if strays is not None:
        drawing = Drawing(drawing.paper, discs=np.concatenate([drawing.discs, strays]))
    random = np.random.default_rng(seed)
    image = render_target(drawing, lens, T_camera_target, exposure or Exposure(), random)
    return image, truth(target, lens, T_camera_target)


@cache
def plain(kind):
    """One image of each kind, shared by tests that only read it."""
    return shot(KINDS[kind], tilt=25.0, turn=20.0)


def found(target, image):
    answer = target.find(image)
    assert isinstance(answer, Found), answer
    return answer


def refused(target, image):
    answer = target.find(image)
    assert isinstance(answer, NotFound), answer
    return answer.reason


def errors(target, answer, middles):
    """Errors under the names given, or under those after a turn where these are as good."""
    names = turn_names(target.turn, len(middles))
    return min((answer.pixels - middles[name][answer.points] for name in names), key=lambda off: np.abs(off).max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("tilt", "turn"), [(0.0, 0.0), (30.0, 100.0), (50.0, 200.0), (65.0, 300.0)])
def test_every_disc_has_its_name_and_its_place_however_it_is_tilted(kind, tilt, turn):
    target = KINDS[kind]
    image, middles = shot(target, tilt=tilt, turn=turn, towards=40.0 + turn)
    answer = found(target, image)
    assert np.array_equal(answer.points, np.arange(len(middles)))
    off = errors(target, answer, middles)
    assert np.sqrt(np.mean(off**2)) < 0.01
    assert np.abs(off).max() < 0.05


def test_the_middle_is_the_ellipses_and_not_the_image_of_the_centre():
    T_camera_target = pose(CIRCLES, tilt=50.0)
    image, middles = shot(CIRCLES, tilt=50.0)
    centres = sensor_positions(camera(), CIRCLES.points_m @ T_camera_target[:3, :3].T + T_camera_target[:3, 3])
    assert np.linalg.norm(centres - middles, axis=1).max() > 0.1
    assert np.abs(errors(CIRCLES, found(CIRCLES, image), middles)).max() < 0.03


def test_the_stated_deviations_are_those_of_the_errors():
    normalised = []
    for seed, (kind, blur, electrons) in enumerate(
        [
            ("circles", 0.5, 40.0),
            ("dots", 0.7, 5.0),
            ("asymmetric", 1.0, 40.0),
            ("circles", 1.5, 5.0),
            ("dots", 1.0, 10),
        ]
    ):
        exposure = Exposure(blur_px=blur, electrons_per_grey=electrons, light=0.9 - 0.1 * seed)
        image, middles = shot(KINDS[kind], seed=seed, tilt=15.0 * seed, turn=70.0 * seed, exposure=exposure)
        answer = found(KINDS[kind], image)
        normalised.append(errors(KINDS[kind], answer, middles) / answer.sigmas_px[:, None])
        assert np.ptp(answer.sigmas_px) > 0.0, "every disc has its own"
    spread = np.concatenate(normalised).std()
    print(f"standard deviation of {2 * len(np.concatenate(normalised))} normalised errors: {spread:.3f}")
    assert 0.9 < spread < 1.1


@pytest.mark.parametrize("kind", KINDS)
def test_strays_dim_light_and_noise_do_no_harm(kind):
    target = KINDS[kind]
    far = target.drawing.paper
    strays = np.array([[far[0] - 0.02, 0.03, 0.005], [far[2] + 0.015, 0.04, 0.006], [far[2] + 0.02, 0.08, 0.004]])
    strays = np.vstack([strays, [[0.04, far[1] - 0.015, 0.005], [0.07, far[3] + 0.02, 0.007]]])
    dim = Exposure(blur_px=1.2, light=0.15, electrons_per_grey=5.0, read_noise_grey=1.0)
    image, middles = shot(target, strays=strays, exposure=dim, tilt=40.0, turn=15.0, distance=0.4)
    answer = found(target, image)
    off = errors(target, answer, middles)
    assert np.abs(off).max() < 0.3
    assert 0.7 < (off / answer.sigmas_px[:, None]).std() < 1.3


def test_a_perforated_plate_beside_the_grid_is_not_taken_for_it():
    image, middles = shot(CIRCLES, tilt=20.0, distance=0.5)
    plate = np.full_like(image, 150)
    for u in range(15, 800, 22):
        for v in (15, 37, 59, 81, 103, 500, 522, 544, 566, 588):
            cv2.circle(plate, (u, v), 6, 20, -1, cv2.LINE_AA)
    rows = np.indices(image.shape)[0]
    image = np.where((rows < 115) | (rows > 485), plate, image)
    assert middles[:, 1].min() > 125.0
    assert middles[:, 1].max() < 475.0
    assert np.abs(errors(CIRCLES, found(CIRCLES, image), middles)).max() < 0.05


def test_overexposed_paper_and_a_shadow_over_half_the_grid_do_no_harm():
    image, middles = shot(CIRCLES, exposure=Exposure(light=1.4))
    assert np.abs(errors(CIRCLES, found(CIRCLES, image), middles)).max() < 0.05
    image, middles = plain("circles")
    shadow = 1.0 / (1.0 + np.exp((np.arange(800) - 400) / 40.0))
    dark = np.rint(image * (0.3 + 0.7 * shadow)).astype(np.uint8)
    assert np.abs(errors(CIRCLES, found(CIRCLES, dark), middles)).max() < 0.1


@pytest.mark.parametrize(("distance", "least"), [(1.3, 2.5), (0.27, 15.0)])
def test_small_and_large_discs_are_found(distance, least):
    image, middles = shot(CIRCLES, tilt=10.0, distance=distance)
    assert 900.0 * CIRCLES.circle_radius_m / distance > least
    off = errors(CIRCLES, found(CIRCLES, image), middles)
    assert np.sqrt(np.mean(off**2)) < 0.02


def test_discs_of_a_hundred_pixels_are_found():
    target = CircleGrid(3, 4, 0.05, 0.025)
    image, middles = shot(target, lens=camera(focal=2000.0), distance=0.6, tilt=10.0)
    assert np.abs(errors(target, found(target, image), middles)).max() < 0.02


def test_sixteen_bits_give_the_same_middles_and_the_image_is_left_alone():
    image, _ = plain("dots")
    deep = image.astype(np.uint16) * 16
    before = deep.copy()
    assert np.abs(found(DOTS, deep).pixels - found(DOTS, image).pixels).max() < 1e-3
    assert np.array_equal(deep, before)


@pytest.mark.parametrize("quarter_turns", [1, 2, 3])
@pytest.mark.parametrize("kind", ["asymmetric", "dots"])
def test_names_follow_the_board_however_the_image_is_turned(kind, quarter_turns):
    image, middles = plain(kind)
    turned = np.ascontiguousarray(np.rot90(image, quarter_turns))
    for _ in range(quarter_turns):
        middles = np.stack([middles[:, 1], image.shape[1] - 1 - middles[:, 0]], axis=1)
        image = np.rot90(image)
    answer = found(KINDS[kind], turned)
    assert np.abs(answer.pixels - middles[answer.points]).max() < 0.05


@pytest.mark.parametrize(
    "target", [DOTS, DotGrid(7, 7, 0.02, 0.008, 0.012, "0,1,14"), AsymmetricCircleGrid(5, 8, 0.015, 0.01)]
)
def test_a_mirrored_board_is_refused_by_name(target):
    image, _ = shot(target, tilt=15.0, turn=40.0)
    found(target, image)
    assert "mirrored" in refused(target, np.ascontiguousarray(image[:, ::-1]))


def test_a_board_that_is_its_own_mirror_image_is_read_right_handed():
    for kind in ("circles", "asymmetric"):
        image, _ = plain(kind)
        target, lattice = KINDS[kind], KINDS[kind].points_m[:, :2]
        pixels = found(target, np.ascontiguousarray(image[:, ::-1])).pixels
        x = np.linalg.lstsq(np.column_stack([lattice, np.ones(len(lattice))]), pixels, rcond=None)[0]
        assert np.linalg.det(x[:2]) > 0.0


@pytest.mark.parametrize("kind", ["circles", "asymmetric"])
def test_a_hidden_or_cut_grid_is_refused_with_what_was_seen(kind):
    image, middles = plain(kind)
    target, P = KINDS[kind], len(middles)
    hidden = image.copy()
    u, v = np.rint(middles[P // 2]).astype(int)
    hidden[v - 16 : v + 16, u - 16 : u + 16] = 190
    assert f"{P - 1} of {P} dots seen" in refused(target, hidden)
    cut = np.ascontiguousarray(image[:, : int(np.median(middles[:, 0]))])
    assert f"of {P} dots seen" in refused(target, cut)
    assert "whole target" in refused(target, cut)


def test_larger_dots_name_those_that_are_seen():
    image, middles = plain("dots")
    part = image.copy()
    part[:, 500:] = 70
    answer = found(DOTS, part)
    surely, perhaps = (set(np.flatnonzero(middles[:, 0] < u)) for u in (470.0, 500.0))
    assert surely <= set(answer.points) <= perhaps
    assert len(surely) < 48
    off = np.abs(answer.pixels - middles[answer.points])
    assert np.median(off) < 0.01
    assert (off < 4.5 * answer.sigmas_px[:, None]).all(), "a rim that the cover touches is less certain"
    gone = image.copy()
    u, v = np.rint(middles[0]).astype(int)
    gone[v - 25 : v + 25, u - 25 : u + 25] = 190
    assert "the larger dots are not where origin_dots says" in refused(DOTS, gone)
    assert "of 48 dots seen" in refused(DOTS, np.ascontiguousarray(image[:, :350]))


@pytest.mark.parametrize(
    ("kind", "target", "words"),
    [
        ("circles", CircleGrid(10, 7, 0.02, 0.010), "63 of 70 dots seen"),
        ("circles", CircleGrid(8, 7, 0.02, 0.010), "larger than 8 x 7"),
        ("circles", CircleGrid(9, 7, 0.02, 0.006), "times as large for the spacing as declared"),
        ("circles", AsymmetricCircleGrid(4, 11, 0.02, 0.010), "of 44 dots seen"),
        ("circles", DotGrid(9, 7, 0.02, 0.010, 0.014), "0 larger and 63 smaller"),
        ("asymmetric", AsymmetricCircleGrid(4, 10, 0.015, 0.012), "larger than 4 x 10"),
        ("asymmetric", AsymmetricCircleGrid(5, 11, 0.015, 0.012), "44 of 55 dots seen"),
        ("asymmetric", AsymmetricCircleGrid(4, 11, 0.030, 0.012), "2.0. times as large"),
        ("dots", CircleGrid(8, 6, 0.022, 0.009), "1.5. times as large"),
        ("dots", DotGrid(8, 6, 0.022, 0.009, 0.014, "9"), "1 larger and 47 smaller"),
        ("dots", DotGrid(8, 6, 0.022, 0.009, 0.014, "7"), "mirrored"),
        ("dots", DotGrid(7, 6, 0.022, 0.009, 0.014), "larger than 7 x 6"),
    ],
)
def test_a_wrong_declaration_is_refused_with_what_is_wrong(kind, target, words):
    answer = target.find(plain(kind)[0])
    assert isinstance(answer, NotFound), answer
    assert re.search(words, answer.reason), answer.reason


def test_pictures_without_a_grid_are_refused():
    noise = np.random.default_rng(0).integers(0, 256, (480, 640)).astype(np.uint8)
    for nothing in (np.full((480, 640), 128, np.uint8), noise, 255 - plain("circles")[0], np.zeros((2, 3), np.uint8)):
        for target in KINDS.values():
            assert "dots seen" in refused(target, nothing)


def test_a_blurred_grid_is_found_or_refused_but_never_wrong():
    for blur in (3.0, 6.0):
        image, middles = shot(CIRCLES, tilt=30.0, exposure=Exposure(blur_px=blur, electrons_per_grey=10.0))
        answer = CIRCLES.find(image)
        if answer:
            assert np.abs(errors(CIRCLES, answer, middles)).max() < 0.5


def test_points_are_opencvs_and_the_order_is_that_of_its_detector():
    i, j = np.divmod(np.arange(44), 4)
    expected = 0.015 * np.stack([2 * j + i % 2, i, 0 * i], axis=1)
    assert np.abs(ASYMMETRIC.points_m - expected).max() < 1e-15
    image, _ = shot(ASYMMETRIC)
    ok, corners = cv2.findCirclesGrid(image, (4, 11), flags=cv2.CALIB_CB_ASYMMETRIC_GRID)
    assert ok
    assert np.abs(found(ASYMMETRIC, image).pixels - corners.reshape(-1, 2)).max() < 0.2


def test_the_large_dot_of_ros_industrial_is_the_lower_left_and_its_y_goes_up():
    target = DotGrid(5, 7, 0.022, 0.009, 0.014)  # 5 rows, 7 columns there
    image, _ = shot(target, turn=-90.0)
    pixels = found(target, image).pixels
    assert pixels[0] @ [1.0, -1.0] == (pixels @ [1.0, -1.0]).min()
    up, right = pixels[1] - pixels[0], pixels[5] - pixels[0]
    assert up[1] < -10.0 > -right[0]
    assert max(abs(up[0]), abs(right[1])) < 2.0


@pytest.mark.parametrize(
    "target", [CIRCLES, AsymmetricCircleGrid(4, 8, 0.015, 0.012), AsymmetricCircleGrid(5, 6, 0.015, 0.012)]
)
def test_half_a_turn_is_a_motion_of_the_grid(target):
    turn = target.turn
    assert np.array_equal(turn[turn], np.arange(len(turn)))
    assert np.ptp(target.points_m + target.points_m[turn], axis=0).max() < 1e-15, "every pair has one midpoint"


def test_ends_that_differ_have_no_turn():
    assert ASYMMETRIC.turn is None
    assert DOTS.turn is None
    x, y, _ = ASYMMETRIC.points_m.T
    turned = {(round(a, 6), round(b, 6)) for a, b in zip(x.max() - x, y.max() - y, strict=True)}
    assert turned != {(round(a, 6), round(b, 6)) for a, b in zip(x, y, strict=True)}


def test_radii_and_drawing_are_those_of_the_discs():
    assert DOTS.circle_radius_m == 0.0045
    assert np.flatnonzero(DOTS.circle_radii_m == 0.007).tolist() == [0]
    for target in KINDS.values():
        drawing = target.drawing
        assert np.array_equal(drawing.discs[:, :2], target.points_m[:, :2])
        low = (drawing.discs[:, :2] - drawing.discs[:, 2:]).min(axis=0) - drawing.paper[:2]
        high = drawing.paper[2:] - (drawing.discs[:, :2] + drawing.discs[:, 2:]).max(axis=0)
        assert np.allclose([low, high], target.spacing_m)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: CircleGrid(2, 7, 0.02, 0.01), "at least 3 x 3"),
        (lambda: CircleGrid(9, 7, 0.02, 0.02), "touch"),
        (lambda: CircleGrid(9, 7, 0.02, 0.0), "above 0"),
        (lambda: AsymmetricCircleGrid(4, 11, 0.015, 0.022), "touch"),
        (lambda: DotGrid(8, 6, 0.022, 0.009, 0.010), "1.2 times"),
        (lambda: DotGrid(8, 6, 0.022, 0.012, 0.034), "touch"),
        (lambda: DotGrid(8, 6, 0.022, 0.009, 0.014, "0,47"), "the same after a turn"),
        (lambda: DotGrid(7, 7, 0.022, 0.009, 0.014, "24"), "the same after a turn"),
        (lambda: DotGrid(8, 6, 0.022, 0.009, 0.014, "48"), "of 0 to 47"),
        (lambda: DotGrid(8, 6, 0.022, 0.009, 0.014, "0, 0"), "of 0 to 47"),
        (lambda: DotGrid(8, 6, 0.022, 0.009, 0.014, "corner"), "of 0 to 47"),
        (lambda: DotGrid(8, 6, 0.022, 0.009, 0.014, ""), "of 0 to 47"),
    ],
)
def test_grids_that_cannot_work_are_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_five_megapixels_take_a_tenth_of_a_second():
    lens = camera(width=2452, height=2056, focal=2800.0)
    image, middles = shot(CIRCLES, lens=lens, tilt=30.0, turn=10.0)
    began = time.perf_counter()
    answer = found(CIRCLES, image)
    seconds = time.perf_counter() - began
    off = errors(CIRCLES, answer, middles)
    print(f"2452 x 2056: {1e3 * seconds:.0f} ms, RMS {np.sqrt(np.mean(off**2)):.4f} pixel")
    assert np.sqrt(np.mean(off**2)) < 0.01
    assert seconds < 0.5, "about 60 ms on an idle core"
