"""The mark at an end of the length standard: one disc of quarters, found whatever lies around it."""

import re

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from painting import BLACK, WHITE, chessboard, painted, quadrants, view
from sixthlink.target import Found, NotFound, find_quadrant_mark

RADIUS = 0.012
ORIGIN = np.zeros((1, 3))


def clutter(height, width, seed):
    """Soft blobs, hard bars and fine texture, without any disc of quarters."""
    rng = np.random.default_rng(seed)
    grey = gaussian_filter(rng.normal(0.0, 1.0, (height, width)), 12)
    grey = 110.0 + 55.0 * grey / grey.std()
    for _ in range(12):
        row, column = rng.integers(0, height - 40), rng.integers(0, width - 40)
        grey[row : row + rng.integers(4, 40), column : column + rng.integers(4, 200)] = rng.uniform(20, 230)
    return np.clip(grey + rng.normal(0.0, 6.0, grey.shape), 0, 255).astype(np.uint8)


def reason(image):
    answer = find_quadrant_mark(image)
    assert isinstance(answer, NotFound), answer
    return answer.reason


@pytest.mark.parametrize("seed", range(6))
def test_the_centre_is_where_the_painter_put_it(seed):
    rng = np.random.default_rng(seed)
    seen = view(
        (0.0, 0.0),
        angles_deg=(*rng.uniform(-30, 30, 2), rng.uniform(-180, 180)),
        aside_m=tuple(rng.uniform(-0.05, 0.05, 2)),
        focal=rng.uniform(1000, 2500),
    )
    answer = find_quadrant_mark(painted(quadrants(RADIUS, turn=rng.uniform(0, 3)), seen, seed=seed))
    assert isinstance(answer, Found), answer
    assert answer.points.tolist() == [0]
    assert np.abs(answer.pixels - seen.pixels(ORIGIN)).max() < 0.04


def test_clutter_around_the_bar_does_not_matter():
    seen = view((0.0, 0.0), angles_deg=(10.0, -20.0, 40.0), width=1200, height=960, focal=2400.0)
    bar = painted(quadrants(RADIUS), seen, rays=2)
    for seed in range(2):
        around = clutter(*bar.shape, seed)
        at = np.hypot(*(np.indices(bar.shape)[::-1] - seen.pixels(ORIGIN)[0][:, None, None]))
        image = np.where(at < 1.35 * 2400 * RADIUS / 0.6, bar, around)
        answer = find_quadrant_mark(image)
        assert isinstance(answer, Found), answer
        assert np.abs(answer.pixels - seen.pixels(ORIGIN)).max() < 0.04


def test_sixteen_bits_and_uneven_light():
    seen = view((0.0, 0.0), angles_deg=(0.0, 25.0, 10.0))
    image = painted(quadrants(RADIUS), seen)
    light = np.linspace(0.5, 1.0, image.shape[1])
    deep = (image.astype(float) * light * 200.0).astype(np.uint16)
    answer = find_quadrant_mark(deep)
    assert isinstance(answer, Found), answer
    assert np.abs(answer.pixels - seen.pixels(ORIGIN)).max() < 0.1


def test_no_mark_is_said_so():
    assert "no quadrant mark" in reason(np.full((480, 640), 90, np.uint8))
    assert "no quadrant mark" in reason(clutter(640, 800, 5))


def test_two_marks_are_both_named():
    seen = view((0.03, 0.0))
    image = painted(quadrants(RADIUS, centres=((0.0, 0.0), (0.06, 0.0))), seen, rays=2)
    words = reason(image)
    named = np.array(re.findall(r"\((\d+), (\d+)\)", words), dtype=float)
    truth = seen.pixels(np.array([[0.0, 0.0, 0.0], [0.06, 0.0, 0.0]]))
    assert np.abs(named[np.argsort(named[:, 0])] - truth).max() < 1.5
    assert "leave one mark in view" in words


def test_a_chessboard_is_no_mark():
    assert "two places" in reason(painted(chessboard(9, 6, 0.02), view((0.08, 0.05)), rays=2))


def test_a_mark_of_a_few_pixels_is_refused():
    small = painted(quadrants(RADIUS), view((0.0, 0.0), focal=250.0), blur=0.4)
    assert "wide, expected at least 14" in reason(small) or "no quadrant mark" in reason(small)


def test_a_mark_cut_by_the_edge_is_refused():
    seen = view((0.0, 0.0), aside_m=(0.148, 0.0))
    assert seen.pixels(ORIGIN)[0, 0] > seen.width - 8
    assert reason(painted(quadrants(RADIUS), seen, rays=2))


def test_a_plain_disc_or_a_half_disc_is_no_mark():
    def half(x, y):
        return np.where(x * x + y * y < RADIUS**2, np.where(x > 0, BLACK, WHITE), 120.0)

    def plain(x, y):
        return np.where(x * x + y * y < RADIUS**2, BLACK, 120.0)

    for paint in (half, plain):
        assert "no quadrant mark" in reason(painted(paint, view((0.0, 0.0)), rays=2))
