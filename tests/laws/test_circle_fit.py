"""The axis of a sweep: exact where the points are, the same from anywhere, and as certain as it says."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.calibrate.tracker import AxisFit, axis_covariance, circle_covariance, fit_axis, sweep_of
from sixthlink.calibrate.tracker.coaxial import Coaxial, phase_rows, phases_of, whitened
from sixthlink.geometry import Floats, across_axes, common_normal, distances_to_line, transform_points
from sweeps import NOISE_M, RADIUS_M, angles, anywhere, circle, good_sweep, seen, true_axis

MM = 1e-3


@pytest.mark.parametrize("arc_deg", [30.0, 31.0, 45.0, 90.0, 180.0, 270.0, 330.0, 360.0])
def test_exact_points_give_the_exact_axis(arc_deg):
    """P20."""
    for points in (5, 6, 20):
        q = angles(arc_deg, points)
        for seed in range(3):
            fit = fit_axis(sweep_of(seen(circle(q), seed, 0.0), angles_rad=q))
            truth = true_axis(seed)
            assert np.linalg.norm(fit.axis.direction - truth.direction) < 1e-10
            assert distances_to_line(truth, fit.axis.point_m) < 1e-7 * MM
            assert fit.circles[0].radius_m == pytest.approx(RADIUS_M, abs=1e-10)
            assert fit.findings == ()


@pytest.mark.parametrize("stated", [True, False])
def test_the_axis_moves_with_the_points(stated):
    """P19: a rigid motion and a scale of points and noise carry axis, covariance and residuals along."""
    for seed in range(4):
        sweep, T, scale = good_sweep(seed, stated=stated), anywhere(seed + 50), 2.5
        here = fit_axis(sweep)
        there = fit_axis(
            sweep_of(
                scale * transform_points(T, sweep.points_m),
                angles_rad=sweep.angles_rad,
                noise_m=scale * NOISE_M if stated else None,
            )
        )
        assert np.linalg.norm(there.axis.direction - T[:3, :3] @ here.axis.direction) < 1e-11
        assert np.abs(there.axis.point_m - scale * transform_points(T, here.axis.point_m)).max() < 1e-9 * MM
        assert there.deviations_m == pytest.approx(scale * here.deviations_m, abs=1e-9 * MM)
        units = np.diag(np.r_[np.full(3, scale), np.ones(3)])
        turned = np.kron(np.eye(2), T[:3, :3])
        expected = turned @ units @ axis_covariance(here) @ units @ turned.T
        assert np.abs(axis_covariance(there) - expected).max() < 1e-7 * np.abs(expected).max()


def test_the_order_of_the_points_does_not_matter():
    """P19, also with an outlier."""
    for seed in range(4):
        sweep = good_sweep(seed)
        points = sweep.points_m.copy()
        points[7] += [3e-3, 1e-3, -2e-3]
        order = np.random.default_rng(seed).permutation(30)
        first = fit_axis(sweep_of(points, angles_rad=sweep.angles_rad, noise_m=NOISE_M))
        second = fit_axis(sweep_of(points[order], angles_rad=sweep.angles_rad[order], noise_m=NOISE_M))
        assert np.abs(first.axis.point_m - second.axis.point_m).max() < 1e-9 * MM
        assert np.linalg.norm(first.axis.direction - second.axis.direction) < 1e-11
        assert (first.kept[order] == second.kept).all()


@pytest.mark.parametrize("with_angles", [True, False])
def test_a_sweep_run_backwards_only_flips_the_axis(with_angles):
    """P19: with angles that fall where they grew; without, with points in the reverse order."""
    sweep = good_sweep(1)
    if with_angles:
        first, second = sweep, sweep_of(sweep.points_m, angles_rad=-sweep.angles_rad, noise_m=NOISE_M)
    else:
        first, second = (sweep_of(p, noise_m=NOISE_M) for p in (sweep.points_m, sweep.points_m[::-1]))
    a, b = fit_axis(first), fit_axis(second)
    assert np.linalg.norm(a.axis.direction + b.axis.direction) < 1e-12
    assert np.abs(a.axis.point_m - b.axis.point_m).max() < 1e-12
    assert a.signed is b.signed is with_angles


def test_growing_angles_turn_points_by_the_right_hand():
    for seed in range(6):
        for arc in (30.0, 120.0, 330.0):
            fit = fit_axis(good_sweep(seed, arc))
            assert fit.signed
            assert fit.axis.direction @ true_axis(seed).direction > 0.999


def test_angles_tell_the_phase_of_the_reflector_and_the_scale_of_the_joint():
    q = angles()
    fit = fit_axis(sweep_of(seen(circle(q), 1), angles_rad=1.0004 * q, noise_m=NOISE_M))
    assert fit.turning.scale == pytest.approx(1.0 / 1.0004, abs=4.0 * fit.turning.scale_uncertainty)
    assert fit.turning.scale_uncertainty < 1e-4
    exact = fit_axis(sweep_of(seen(circle(q), 1), angles_rad=q, noise_m=NOISE_M))
    assert np.sqrt(np.mean(exact.tangential_m**2)) < 1.5 * NOISE_M


def test_several_reflectors_share_one_axis_and_know_it_better():
    q = angles()
    both = np.r_[circle(q), circle(q, 0.5, 0.3, 1.7)]
    names = ["near"] * 30 + ["far"] * 30
    points = seen(both, 5)
    one = fit_axis(sweep_of(points[:30], angles_rad=q, noise_m=NOISE_M))
    two = fit_axis(sweep_of(points, angles_rad=np.r_[q, q], reflectors=names, noise_m=NOISE_M))
    assert two.findings == ()
    assert [float(c.radius_m) for c in two.circles] == pytest.approx([0.8, 0.5], abs=1e-4)
    gap = two.circles[1].centre_m - two.circles[0].centre_m
    assert gap == pytest.approx(0.3 * two.axis.direction, abs=1e-4)
    assert two.direction_uncertainty_rad < one.direction_uncertainty_rad
    assert common_normal(two.axis, true_axis(5)).angle_rad < 5.0 * two.direction_uncertainty_rad


def _coaxial(seed: int) -> Coaxial:
    rng = np.random.default_rng(seed)
    frame = across_axes(rng.normal(size=3))
    return Coaxial(frame, rng.uniform(-1, 1, 3), rng.uniform(-0.2, 0.2, 2), rng.uniform(0.3, 1.0, 2))


def _stepped(c: Coaxial, step: Floats) -> Coaxial:
    """The same small motion without the code's own bookkeeping: frames turned by their rows, not made anew."""
    e1, e2, n = c.frame
    tilted = n + step[2] * e1 + step[3] * e2
    tilted = tilted / np.linalg.norm(tilted)
    turned = np.stack([e1 - (e1 @ tilted) * tilted, e2 - (e2 @ tilted) * tilted, tilted])
    origin = c.origin_m + step[0] * e1 + step[1] * e2
    return Coaxial(turned, origin, c.heights_m + step[4::2], c.radii_m + step[5::2])


def test_the_jacobians_are_those_of_finite_differences():
    rng = np.random.default_rng(4)
    circles = _coaxial(1)
    sweep = sweep_of(rng.uniform(-1, 1, (12, 3)), reflectors=["a", "b"] * 6)
    J, P = whitened(circles, sweep)[2], phase_rows(circles, sweep)
    for k, step in enumerate(1e-6 * np.eye(8)):
        forward, backward = _stepped(circles, step), _stepped(circles, -step)
        slope = (whitened(forward, sweep)[0] - whitened(backward, sweep)[0]) / 2e-6
        assert np.abs(slope - J[:, :, k]).max() < 1e-8
        if k < 4:
            turned = (phases_of(forward, sweep) - phases_of(backward, sweep)) / 2e-6
            assert np.abs(turned - P[:, k]).max() < 1e-7


def _misses(fit: AxisFit, seed: int) -> tuple[Floats, Floats]:
    """What is off in shift, tilt, height and radius, and what the fit holds for its standard uncertainty."""
    truth = true_axis(seed)
    tilt = fit.frame[:2] @ (truth.direction / (truth.direction @ fit.axis.direction))
    gap = truth.point_m - fit.axis.point_m
    shift = fit.frame[:2] @ (
        gap - truth.direction * (gap @ fit.axis.direction) / (truth.direction @ fit.axis.direction)
    )
    centre = (truth.point_m - fit.circles[0].centre_m) @ fit.axis.direction
    off = np.r_[shift, tilt, centre, RADIUS_M - fit.circles[0].radius_m]
    return off, np.sqrt(np.diag(fit.covariance))


@pytest.mark.parametrize(("arc_deg", "stated"), [(30.0, True), (120.0, False), (330.0, True)])
def test_intervals_cover_as_often_as_they_say(arc_deg, stated):
    """95 % of the intervals of all six numbers, and the size of the joint error of the axis."""
    trials, q = 500, angles(arc_deg, 12)
    inside, squares = np.zeros(6), 0.0
    for seed in range(trials):
        fit = fit_axis(sweep_of(seen(circle(q), seed), noise_m=NOISE_M if stated else None))
        off, uncertainty = _misses(fit, seed)
        inside += np.abs(off) < fit.expansion() * uncertainty
        squares += off[:4] @ np.linalg.solve(fit.covariance[:4, :4], off[:4])
    # 95 % within three standard errors of a share of 500.
    assert (np.abs(inside / trials - 0.95) < 0.03).all()
    dof = 2 * len(q) - 6
    expected = 4.0 if stated else 4.0 * dof / (dof - 2.0)
    assert squares / trials == pytest.approx(expected, rel=0.12)


def test_points_are_weighed_by_their_covariances():
    """A tracker that ranges ten times better than it points: stated covariances bring the axis nearer."""
    q, weighed, equal, squares = angles(90.0, 20), 0.0, 0.0, 0.0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        exact = seen(circle(q), seed, 0.0)
        sight = exact / np.linalg.norm(exact, axis=1, keepdims=True)
        covariances = (1e-4) ** 2 * np.eye(3) + ((1e-5) ** 2 - (1e-4) ** 2) * np.einsum("ni,nj->nij", sight, sight)
        noise = np.einsum("nij,nj->ni", np.linalg.cholesky(covariances), rng.normal(size=exact.shape))
        fit = fit_axis(sweep_of(exact + noise, covariances_m2=covariances))
        off, _ = _misses(fit, seed)
        squares += off @ np.linalg.solve(fit.covariance, off)
        weighed += off[:2] @ off[:2]
        off, _ = _misses(fit_axis(sweep_of(exact + noise)), seed)
        equal += off[:2] @ off[:2]
    assert weighed < 0.8 * equal
    assert squares / 100 == pytest.approx(6.0, rel=0.15)


def test_the_axis_is_within_a_tenth_of_a_milliradian():
    """E3: 120°, 0.02 mm, 0.8 m; twenty points do in nineteen of twenty sweeps."""
    q = angles(120.0, 20)
    errors = [
        float(common_normal(fit_axis(sweep_of(seen(circle(q), s), angles_rad=q)).axis, true_axis(s)).angle_rad)
        for s in range(100)
    ]
    assert np.quantile(errors, 0.95) < 1e-4


def test_the_covariance_of_a_circle_is_that_of_its_six_numbers():
    """The centre of a circle off the foot has the tilt's lever as well."""
    q = angles()
    both = np.r_[circle(q), circle(q, 0.5, 0.6, 1.7)]
    centres = []
    for seed in range(150):
        rng = np.random.default_rng(seed)
        points = transform_points(anywhere(1), both) + NOISE_M * rng.normal(size=both.shape)
        fit = fit_axis(sweep_of(points, reflectors=["a"] * 30 + ["b"] * 30, noise_m=NOISE_M))
        centres.append(fit.circles[1].centre_m)
    stated = np.sqrt(np.trace(circle_covariance(fit, 1)[:3, :3]))
    assert np.sqrt(np.trace(np.cov(np.array(centres).T))) == pytest.approx(stated, rel=0.12)
