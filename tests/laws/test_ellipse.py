"""Ellipses of dark discs: exact where the image is, the same however the image is presented, and sure of what it says.

The images are painted here: the exact area of each ellipse in each pixel, from chords on scanlines.
"""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from sixthlink.target.ellipse import fit_discs

WIDTH, HEIGHT, DARK, BRIGHT = 360, 300, 20.0, 200.0
ROOM = 1.7


def lattice(a, rng):
    """Middles far enough from each other and from the edge, nowhere in particular within their pixels."""
    u, v = np.meshgrid(np.arange(2 * a + 4, WIDTH - 2 * a - 4, 4 * a), np.arange(2 * a + 4, HEIGHT - 2 * a - 4, 4 * a))
    return np.stack([u, v], axis=-1).reshape(-1, 2) + rng.uniform(-0.5, 0.5, (u.size, 2))


def ellipses(N, a, b, rng):
    turn = rng.uniform(0.0, np.pi, N)
    R = np.stack([np.stack([np.cos(turn), -np.sin(turn)], -1), np.stack([np.sin(turn), np.cos(turn)], -1)], -2)
    return R @ np.diag([a * a, b * b]) @ R.swapaxes(1, 2)


def painted(centres, shapes, *, blur=0.7, lines=32):
    """Grey values without noise: each pixel is covered by the part of its area that the ellipse fills."""
    covered = np.zeros((HEIGHT, WIDTH))
    u = np.arange(WIDTH)
    for (x, y), E in zip(centres, np.linalg.inv(shapes), strict=True):
        reach = int(1.0 / np.sqrt(np.linalg.eigvalsh(E)[0])) + 2
        rows = np.arange(int(y) - reach, int(y) + reach + 1)
        v = rows[:, None] + (np.arange(lines) + 0.5) / lines - 0.5 - y
        root = (E[0, 1] * v) ** 2 - E[0, 0] * (E[1, 1] * v * v - 1.0)
        half = np.sqrt(np.maximum(root, 0.0)) / E[0, 0]
        middle = x - E[0, 1] * v / E[0, 0]
        chord = np.minimum(u + 0.5, (middle + half)[..., None]) - np.maximum(u - 0.5, (middle - half)[..., None])
        covered[rows] += np.clip(chord, 0.0, 1.0).mean(axis=1)
    return gaussian_filter(BRIGHT + (DARK - BRIGHT) * covered, blur, truncate=6.0)


def recorded(grey, noise, rng):
    return np.clip(np.rint(grey + noise * rng.normal(size=grey.shape)), 0, 255).astype(np.uint8)


def fitted(image, centres, shapes, *, rng=None, off=0.5):
    """Fit from first estimates that are off by as much as they may be."""
    rng = rng or np.random.default_rng(7)
    N = len(centres)
    size = 1.0 + rng.uniform(-off, off, N) / np.linalg.det(shapes) ** 0.25
    first = centres + rng.uniform(-off, off, (N, 2))
    return fit_discs(image, first, shapes * size[:, None, None] ** 2, np.full(N, ROOM), off)


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(1)
    centres = lattice(12, rng)
    shapes = ellipses(len(centres), 12, 8, rng)
    return centres, shapes, recorded(painted(centres, shapes), 1.5, rng)


@pytest.mark.parametrize(("a", "b", "most"), [(30, 22, 0.004), (12, 8, 0.006), (8, 4, 0.008), (5, 2.5, 0.015)])
def test_middle_and_shape_are_those_of_the_ellipse(a, b, most):
    rng = np.random.default_rng(2)
    centres = lattice(a, rng)
    shapes = ellipses(len(centres), a, b, rng)
    found = fitted(np.rint(painted(centres, shapes)).astype(np.uint8), centres, shapes)
    assert found.good.all()
    assert np.sqrt(np.mean((found.centres - centres) ** 2)) < most
    assert np.abs(np.sqrt(np.linalg.eigvalsh(found.shapes)) - [b, a]).max() < 0.12
    assert np.abs(found.radii_px - np.sqrt(a * b)).max() < 0.05


def test_uneven_light_does_not_pull_the_middle(scene):
    centres, shapes, _ = scene
    light = 1.0 - 0.6 * np.arange(WIDTH) / WIDTH
    found = fitted(np.rint(painted(centres, shapes) * light).astype(np.uint8), centres, shapes)
    assert np.abs((found.centres - centres).mean(axis=0)).max() < 0.002


def test_a_shift_of_the_image_shifts_the_middles(scene):
    centres, shapes, image = scene
    shift = np.array([5, -3])
    moved = fit_discs(np.roll(image, (-3, 5), axis=(0, 1)), centres + shift, shapes, np.full(len(centres), ROOM), 0.5)
    here = fit_discs(image, centres, shapes, np.full(len(centres), ROOM), 0.5)
    assert np.abs(moved.centres - shift - here.centres).max() < 1e-4
    assert np.allclose(moved.covariances, here.covariances, rtol=1e-2)


def test_rows_and_columns_are_treated_alike(scene):
    centres, shapes, image = scene
    swap = np.array([[0.0, 1.0], [1.0, 0.0]])
    room = np.full(len(centres), ROOM)
    turned = fit_discs(np.ascontiguousarray(image.T), centres[:, ::-1], swap @ shapes @ swap, room, 0.5)
    here = fit_discs(image, centres, shapes, room, 0.5)
    assert np.abs(turned.centres[:, ::-1] - here.centres).max() < 2e-3, "places on rays may round to other pixels"
    assert np.allclose(turned.sigmas_px, here.sigmas_px, rtol=0.1)


def test_brightness_and_contrast_do_not_matter_and_the_image_is_left_alone(scene):
    centres, shapes, image = scene
    here = fitted(image, centres, shapes)
    for black, most in ((0, 1e-4), (5000, 1e-3)):  # uneven light is a factor, so that black may matter a little
        deep = image.astype(np.uint16) * 200 + np.uint16(black)
        before = deep.copy()
        stretched = fitted(deep, centres, shapes)
        assert stretched.good.all()
        assert np.abs(stretched.centres - here.centres).max() < most
        assert np.allclose(stretched.sigmas_px, here.sigmas_px, rtol=0.03)
        assert np.array_equal(deep, before)


def test_bright_discs_and_plain_ground_are_refused_and_keep_their_first_estimates(scene):
    centres, shapes, image = scene
    for other in (255 - image, np.full_like(image, 180), recorded(np.full(image.shape, 180.0), 3.0, np.random)):
        found = fit_discs(other, centres, shapes, np.full(len(centres), ROOM), 0.5)
        assert not found.good.any()
        assert np.array_equal(found.centres, centres)
        assert np.isinf(found.sigmas_px).all()


def test_a_disc_at_the_edge_is_refused_and_its_neighbours_are_not(scene):
    centres, shapes, image = scene
    cut = int(centres[0, 0]) + 3
    found = fit_discs(
        np.ascontiguousarray(image[:, cut:]), centres - [cut, 0], shapes, np.full(len(centres), ROOM), 0.5
    )
    gone = centres[:, 0] - 12 < cut + 1
    assert not found.good[gone].any()
    assert found.good[centres[:, 0] - 14 > cut].all()


def test_a_disc_that_is_partly_covered_is_refused_or_unsure(scene):
    centres, shapes, image = scene
    covered = image.copy()
    u, v = np.rint(centres[0]).astype(int)
    covered[v - 14 : v + 14, u : u + 14] = 110
    found = fitted(covered, centres, shapes)
    assert not found.good[0]
    assert found.good[1:].all()


def test_dark_things_beyond_the_room_of_a_disc_do_not_matter(scene):
    centres, shapes, image = scene
    beside = image.copy()
    u, v = np.indices(image.shape)[::-1]
    q = np.stack([u, v], axis=-1)[..., None, :] - centres
    far = np.einsum("hwni,nij,hwnj->hwn", q, np.linalg.inv(shapes), q).min(axis=-1) > (ROOM + 0.05) ** 2
    beside[far] = 10
    assert np.array_equal(fitted(beside, centres, shapes).centres, fitted(image, centres, shapes).centres)


def test_nothing_to_fit_is_no_error(scene):
    found = fit_discs(scene[2], np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0), 0.5)
    assert len(found.centres) == len(found.good) == len(found.sigmas_px) == 0


def test_the_stated_deviations_are_those_of_the_errors():
    rng, normalised = np.random.default_rng(5), []
    for a, b in ((14, 11), (8, 4), (6, 3)):
        centres = lattice(a, rng)
        shapes = ellipses(len(centres), a, b, rng)
        for blur in (0.5, 1.0, 1.5):
            grey = painted(centres, shapes, blur=blur, lines=16)
            for noise in (1.5, 6.0):
                found = fitted(recorded(grey, noise, rng), centres, shapes, rng=rng)
                assert found.good.all()
                normalised.append((found.centres - centres) / found.sigmas_px[:, None])
    spread = np.concatenate(normalised).std()
    print(f"standard deviation of {2 * len(np.concatenate(normalised))} normalised errors: {spread:.3f}")
    assert 0.93 < spread < 1.07


def test_the_covariance_has_the_direction_of_the_errors():
    rng = np.random.default_rng(6)
    centres = lattice(8, rng)
    shapes = np.tile(np.diag([100.0, 9.0]), (len(centres), 1, 1))
    grey = painted(centres, shapes)
    errors, stated = [], []
    for _ in range(4):
        found = fitted(recorded(grey, 5.0, rng), centres, shapes, rng=rng)
        errors.append((found.centres - centres)[found.good])
        stated.append(found.covariances[found.good].mean(axis=0))
    seen, said = np.concatenate(errors).std(axis=0), np.sqrt(np.diag(np.mean(stated, axis=0)))
    assert seen[0] > 1.3 * seen[1], "a narrow ellipse has more rim to tell its height than its width"
    assert np.allclose(seen, said, rtol=0.15)


def test_noise_that_neighbouring_pixels_share_is_told_from_noise_they_do_not():
    rng = np.random.default_rng(8)
    centres = lattice(14, rng)
    shapes = ellipses(len(centres), 14, 12, rng)
    grey, ratios = painted(centres, shapes), []
    for _ in range(3):
        white = rng.normal(size=grey.shape)
        shared = gaussian_filter(white, 1.0)
        alone, together = (
            fitted(np.clip(np.rint(grey + 4.0 * noise / noise.std()), 0, 255).astype(np.uint8), centres, shapes)
            for noise in (white, shared)
        )
        ratios.append(together.sigmas_px.mean() / alone.sigmas_px.mean())
    assert np.mean(ratios) > 1.5
