"""The head as sixth link, and as the paper's six numbers, is the same head again."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.robot import (
    PaperNumbers,
    head_link_from_transform,
    paper_numbers_from_transform,
    transform_from_head_link,
    transform_from_paper_numbers,
)

TABLE_I = PaperNumbers(0.3516, 0.0901, 0.0727, 42.5612e-3, 191.3183e-3, 104.4643e-3)
PRINTED_MATRIX = [
    [0.9933, -0.0723, 0.0900, -42.5612],
    [0.0373, 0.9386, 0.3430, -191.3183],
    [-0.1093, -0.3374, 0.9350, 104.4643],
    [0, 0, 0, 1],
]


def turn(axis, angle):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return T


def shift(x=0.0, y=0.0, z=0.0):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


def chained(link):
    """Rz(θ6) Tz(d6) Tx(a6) Rx(α6) · Rz(φ+γ) Tz(-L), factor by factor."""
    return (
        turn("z", link.theta6_rad)
        @ shift(z=link.d6_m)
        @ shift(x=link.a6_m)
        @ turn("x", link.alpha6_rad)
        @ turn("z", link.phi_gamma_rad)
        @ shift(z=-link.L_m)
    )


def random_heads(count, seed):
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.random(count, rng=rng).as_matrix()
    T[:, :3, 3] = rng.uniform(-0.5, 0.5, (count, 3))
    return T


def test_ten_thousand_random_heads_come_back():
    """The unsigned formulas of the paper miss 97 % of these; the signed ones none.

    Near parallel axes d6 and L grow without bound and take their rounding with them, hence the sine.
    """
    for T in random_heads(10_000, 1):
        link = head_link_from_transform(T)
        again = transform_from_head_link(link)
        tolerance = 1e-12 if link.alpha6_rad > 0.02 and math.pi - link.alpha6_rad > 0.02 else 1e-9
        assert np.abs(again - T).max() < tolerance
        assert 0.0 <= link.alpha6_rad <= math.pi


def test_the_link_is_its_chain_of_six_motions():
    for T in random_heads(200, 2):
        link = head_link_from_transform(T)
        np.testing.assert_allclose(chained(link), T, atol=1e-11)
        np.testing.assert_allclose(transform_from_head_link(link), chained(link), atol=1e-13)


def test_a_link_is_recovered_from_the_head_it_makes():
    rng = np.random.default_rng(3)
    for _ in range(200):
        link = head_link_from_transform(random_heads(1, rng.integers(2**31))[0])
        again = head_link_from_transform(chained(link))
        np.testing.assert_allclose(
            [again.d6_m, again.a6_m, again.alpha6_rad, again.L_m],
            [link.d6_m, link.a6_m, link.alpha6_rad, link.L_m],
            atol=1e-7,
        )


def test_table_one_gives_the_printed_matrix():
    T = transform_from_paper_numbers(TABLE_I)
    T[:3, 3] *= 1e3
    np.testing.assert_allclose(T, PRINTED_MATRIX, atol=0.5e-4)


def test_table_one_as_sixth_link():
    link = head_link_from_transform(transform_from_paper_numbers(TABLE_I))
    angles = [link.theta6_rad, link.alpha6_rad, link.phi_gamma_rad]
    np.testing.assert_allclose(angles, [2.885049, 0.362496, -2.828364], atol=0.5e-6)
    lengths_mm = np.array([link.d6_m, link.a6_m, link.L_m]) * 1e3
    np.testing.assert_allclose(lengths_mm, [620.8887, -7.3767, 552.3169], atol=0.5e-4)
    assert link.remark == ""


@pytest.mark.parametrize("flip", [0.0, math.pi])
@pytest.mark.parametrize("spin", [-2.0, 0.0, 0.3, math.pi])
@pytest.mark.parametrize("place", [(0.1, -0.2, 0.3), (0.0, 0.0, 0.3), (0.0, 0.0, 0.0)])
def test_parallel_and_opposite_axes_have_a_convention(flip, spin, place):
    """The very common straight mounting: the common normal is not unique, the head is ordinary."""
    T = shift(*place) @ turn("x", flip) @ turn("z", spin)
    link = head_link_from_transform(T)
    np.testing.assert_allclose(transform_from_head_link(link), T, atol=1e-15)
    assert link.L_m == 0.0
    assert link.a6_m == pytest.approx(math.hypot(*place[:2]))
    assert link.d6_m == place[2]
    assert link.alpha6_rad == pytest.approx(flip)
    assert "parallel" in link.remark


@pytest.mark.parametrize("tilt_rad", [1e-12, 1e-10, 1e-8, 1e-5, 1e-3, 0.015])
def test_nearly_parallel_axes_still_give_the_head_and_say_so(tilt_rad):
    T = shift(0.1, -0.2, 0.3) @ turn("xyz", [tilt_rad, -tilt_rad / 2, 0.4])
    link = head_link_from_transform(T)
    # d6 and L are near 0.2 / tilt; each carries its own rounding, and the head keeps at most that.
    reach = abs(link.d6_m) + abs(link.L_m) + 1.0
    np.testing.assert_allclose(transform_from_head_link(link), T, atol=4e-16 * reach + 2 * tilt_rad * (tilt_rad < 1e-9))
    assert link.remark


def test_a_head_across_the_flange_axis_is_no_special_case():
    T = shift(0.05, 0.02, 0.1) @ turn("y", math.pi / 2)
    link = head_link_from_transform(T)
    assert link.alpha6_rad == pytest.approx(math.pi / 2)
    assert link.remark == ""
    np.testing.assert_allclose(transform_from_head_link(link), T, atol=1e-15)


def test_the_papers_numbers_come_back():
    rng = np.random.default_rng(4)
    for _ in range(1000):
        alpha, gamma = rng.uniform(-math.pi, math.pi, 2)
        beta = rng.uniform(-1.55, 1.55)
        given = PaperNumbers(alpha, beta, gamma, *rng.normal(size=3))
        expected = shift(-given.x_m, -given.y_m, given.z_m) @ turn("x", -alpha) @ turn("y", beta) @ turn("z", gamma)
        T = transform_from_paper_numbers(given)
        np.testing.assert_allclose(T, expected, atol=1e-15)
        found = paper_numbers_from_transform(T)
        np.testing.assert_allclose(
            [found.alpha_rad, found.beta_rad, found.gamma_rad, found.x_m, found.y_m, found.z_m],
            [alpha, beta, gamma, given.x_m, given.y_m, given.z_m],
            atol=1e-13,
        )
        assert found.remark == ""


@pytest.mark.parametrize("beta", [math.pi / 2, -math.pi / 2])
@pytest.mark.parametrize(("alpha", "gamma"), [(0.0, 0.0), (0.3, -1.2), (-2.0, 2.5)])
def test_beta_at_ninety_degrees_keeps_the_head_and_says_what_is_lost(alpha, beta, gamma):
    T = transform_from_paper_numbers(PaperNumbers(alpha, beta, gamma, 0.1, 0.2, 0.3))
    found = paper_numbers_from_transform(T)
    assert found.gamma_rad == 0.0
    assert abs(found.beta_rad) == pytest.approx(math.pi / 2)
    assert "±90°" in found.remark
    np.testing.assert_allclose(transform_from_paper_numbers(found), T, atol=1e-15)
