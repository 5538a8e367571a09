"""What goes wrong in a sweep is named with numbers, its cause and its cure; a good sweep is never blamed."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.calibrate.tracker import AxisFit, CircleFinding, NoCircleError, Sweep, fit_axis, sweep_of
from sixthlink.geometry import Floats, common_normal, exp_rotation
from sweeps import NOISE_M, angles, circle, good_sweep, seen, true_axis

BOTH = pytest.mark.parametrize("stated", [True, False], ids=["noise stated", "noise unknown"])
SEEDS = range(5)


def fit(points: Floats, seed: int, q: Floats | None, *, stated: bool, reflectors=None) -> AxisFit:
    noise_m = NOISE_M if stated else None
    return fit_axis(sweep_of(seen(points, seed), angles_rad=q, noise_m=noise_m, reflectors=reflectors))


def refused(points: Floats, seed: int, q: Floats | None, *, stated: bool) -> CircleFinding:
    with pytest.raises(NoCircleError) as caught:
        fit(points, seed, q, stated=stated)
    (finding,) = caught.value.findings
    return finding


def only(found: AxisFit, kind: str) -> CircleFinding:
    assert [f.kind for f in found.findings] == [kind], [str(f) for f in found.findings]
    return found.findings[0]


def test_good_sweeps_are_not_blamed():
    """Of 500 sweeps of all arcs and sizes fewer than five have a finding, and none is wrongly refused."""
    blamed, refusals = [], 0
    for seed in range(500):
        rng = np.random.default_rng(seed)
        found = fit_axis(good_sweep(seed, rng.uniform(31.0, 330.0), int(rng.integers(5, 40)), stated=bool(seed % 2)))
        blamed += [str(f) for f in found.findings]
        refusals += not found.usable
        assert found.signed
    assert len(blamed) < 5, blamed
    assert refusals <= 2, blamed


@BOTH
def test_a_short_arc_is_named_with_what_it_leaves_uncertain(stated):
    for seed in SEEDS:
        q = angles(20.0)
        found = fit(circle(q), seed, q, stated=stated)
        finding = only(found, "short arc")
        assert not found.usable
        assert "20° of the circle" in finding.words
        error = float(common_normal(found.axis, true_axis(seed)).angle_rad)
        assert error < 4.0 * finding.figures["direction_uncertainty_rad"] < 8e-3
        assert f"{finding.figures['direction_uncertainty_rad'] * 1e3:.2g} mrad" in finding.words


@BOTH
def test_four_points_hardly_check_each_other_and_three_not_at_all(stated):
    q = angles(points=4)
    finding = only(fit(circle(q), 1, q, stated=stated), "too few points")
    assert finding.grave
    assert "mrad" in finding.words
    q = angles(points=3)
    finding = refused(circle(q), 1, q, stated=stated)
    assert finding.kind == "too few points"
    assert "mrad" in finding.words
    assert refused(circle(q[:1]), 1, q[:1], stated=stated).kind == "too few points"


@BOTH
def test_points_on_one_line_have_no_axis(stated):
    for seed in SEEDS:
        q = angles()
        assert refused(np.outer(q, [0.1, 0.2, 0.3]), seed, None, stated=stated).kind == "collinear"
        finding = refused(circle(q / 400.0), seed, q / 400.0, stated=stated)
        assert finding.kind == "collinear"
        assert finding.figures["direction_uncertainty_rad"] > 0.1


@BOTH
def test_a_reflector_that_stands_still_is_on_the_axis_or_on_another_link(stated):
    q = angles()
    for seed in SEEDS:
        finding = refused(np.zeros((30, 3)), seed, q, stated=stated)
        assert finding.kind == "standing still"
        assert "joint column moves by 120°" in finding.words
    assert "the joint did not turn" in refused(np.zeros((30, 3)), 1, None, stated=stated).words
    with pytest.raises(NoCircleError, match="standing still"):
        fit_axis(sweep_of(np.ones((30, 3))))


@BOTH
def test_a_reflector_near_the_axis_is_named_with_its_radius(stated):
    for seed in SEEDS:
        q = angles()
        found = fit(circle(q, 2e-3), seed, q, stated=stated)
        finding = only(found, "near the axis")
        assert not found.usable
        assert finding.figures["radius_m"] == pytest.approx(2e-3, abs=2e-4)


def test_one_of_two_reflectors_near_the_axis_does_not_hurt():
    q = angles()
    both = np.r_[circle(q), circle(q, 1e-5, 0.2)]
    found = fit(both, 1, np.r_[q, q], stated=True, reflectors=["far"] * 30 + ["near"] * 30)
    assert "near turns on a radius" in only(found, "near the axis").words
    assert found.usable
    assert found.signed


@BOTH
def test_an_outlier_is_named_and_left_out(stated):
    for seed in SEEDS:
        for size_m in (2e-4, 5e-3, 0.5):
            q, rng = angles(), np.random.default_rng(seed)
            points, k = circle(q), int(rng.integers(30))
            spoke, up = np.array([points[k, 0], points[k, 1], 0.0]) / 0.8, np.array([0.0, 0.0, 1.0])
            points[k] += size_m * (0.6 * spoke + 0.8 * up)
            found = fit(points, seed, q, stated=stated)
            finding = only(found, "outliers")
            assert found.usable
            assert np.flatnonzero(~found.kept).tolist() == [k]
            assert f"point {k + 1} (" in finding.words
            assert finding.figures["largest_m"] == pytest.approx(size_m, abs=1e-4)
            clean = fit_axis(sweep_of(seen(circle(q), seed)[np.arange(30) != k]))
            assert np.linalg.norm(found.axis.direction - clean.axis.direction) < 1e-8


@BOTH
def test_outliers_may_be_no_more_than_a_tenth(stated):
    rng, q = np.random.default_rng(3), angles()
    points = circle(q)
    points[[2, 9, 14, 20]] += 0.01 * rng.normal(size=(4, 3))
    found = fit(points, 1, q, stated=stated)
    assert only(found, "outliers").grave
    assert np.flatnonzero(~found.kept).tolist() == [2, 9, 14, 20]


@BOTH
@pytest.mark.parametrize("other", [(0.7, 0.1, 1.0), (0.79, 0.0, 0.3), (0.8, 0.02, 0.3)])
def test_two_reflectors_under_one_name_are_told_apart(stated, other):
    for seed in SEEDS:
        q, rng = angles(), np.random.default_rng(seed)
        second = rng.random(30) < 0.5 if seed else np.arange(30) < 15
        points = np.where(second[:, None], circle(q, *other), circle(q))
        found = fit(points, seed, q, stated=stated)
        finding = only(found, "mixed reflectors")
        assert not found.usable
        counts = {finding.figures["points_1"], finding.figures["points_2"]}
        assert counts == {float(second.sum()), float((~second).sum())}


@BOTH
def test_the_sweeps_of_two_joints_in_one_are_told_from_where_on(stated):
    q = angles(points=15)
    other = circle(q) @ exp_rotation(np.array([1.0, 0.0, 0.0])).T + [0.5, 0.0, 0.0]
    finding = only(fit(np.r_[circle(q), other], 1, None, stated=stated), "moved in between")
    assert "the second from point 16 on" in finding.words
    assert finding.figures["angle_rad"] == pytest.approx(1.0, abs=1e-3)


@BOTH
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0)], ids=["parallel", "across"])
@pytest.mark.parametrize("share", [0.05, 0.3, -0.2])
def test_a_second_joint_that_moves_along_leaves_a_path_beside_the_circle(stated, axis, share):
    q, pivot = angles(), np.array([0.3, 0.2, 0.1])
    turned = exp_rotation(share * q[:, None] * np.array(axis))
    points = np.einsum("nij,nj->ni", turned, circle(q) - pivot) + pivot
    found = fit(points, 2, q, stated=stated)
    finding = only(found, "path beside the circle")
    assert not found.usable
    assert finding.figures["times"] > 3.0
    assert "a second joint moved too" in finding.words


def test_a_slight_path_is_reported_and_does_not_refuse():
    """A bearing that wobbles by 0.06 mm twice a turn."""
    q = angles(330.0)
    points = circle(q) * (1.0 + 6e-5 / 0.8 * np.cos(2.0 * q))[:, None]
    found = fit(points, 3, q, stated=True)
    assert "in the plane" in only(found, "slight path").words
    assert found.usable


@BOTH
def test_reflectors_that_do_not_share_an_axis_are_told_apart(stated):
    """A parallelogram carries the second reflector's link: it runs on a circle beside the axis."""
    q = angles()
    both = np.r_[circle(q), circle(q, 0.6, 0.2) + np.array([0.12, 0.0, 0.0])]
    names = ["lower arm"] * 30 + ["flange"] * 30
    finding = only(fit(both, 1, np.r_[q, q], stated=stated, reflectors=names), "axes differ")
    assert finding.figures["distance_m"] == pytest.approx(0.12, abs=1e-3)
    assert "lower arm and flange turn about axes 120 mm" in finding.words


def test_noise_beyond_what_was_stated_is_named_and_sizes_the_uncertainty():
    q = angles()
    found = fit_axis(sweep_of(seen(circle(q), 1, 2e-4), angles_rad=q, noise_m=NOISE_M))
    assert only(found, "noise").figures["times"] == pytest.approx(10.0, rel=0.2)
    assert not found.noise_known
    alone = fit_axis(sweep_of(seen(circle(q), 1, 2e-4), angles_rad=q))
    assert found.direction_uncertainty_rad == pytest.approx(alone.direction_uncertainty_rad, rel=1e-6)


@pytest.mark.parametrize(
    ("column", "kind", "words"),
    [
        (lambda q, rng: 0.0 * q + 0.4, "wrong joint", "stays at 22.9°"),
        (lambda q, rng: rng.uniform(0.0, 2.0, len(q)), "wrong joint", "not with the joint column"),
        (lambda q, rng: np.sin(3.0 * (q + 0.4)), "wrong joint", "not with the joint column"),
        (lambda q, rng: rng.permutation(q), "out of order", "not in the order of the rows"),
        (lambda q, rng: np.rad2deg(q), "joint scale", "degrees were read as radians"),
        (lambda q, rng: np.deg2rad(q), "joint scale", "radians were read as degrees"),
        (lambda q, rng: 2.0 * q, "joint scale", "turn 0.5 times"),
        (lambda q, rng: 1.03 * q, "joint scale", "turn 0.97"),
    ],
)
def test_a_wrong_joint_column_is_named(column, kind, words):
    for seed in SEEDS:
        q = angles()
        found = fit(circle(q), seed, column(q, np.random.default_rng(seed)), stated=True)
        finding = only(found, kind)
        assert words in finding.words
        assert not found.usable


def test_rows_that_changed_places_and_angles_that_are_wrong_are_named():
    for seed in SEEDS:
        q = angles()
        exchanged = q.copy()
        exchanged[[4, 9]] = q[[9, 4]]
        found = fit(circle(q), seed, exchanged, stated=True)
        assert "points 5 (-20.7° off), 10 (20.7° off)" in only(found, "out of order").words
        assert found.usable
        late = q.copy()
        late[7] += 0.05
        finding = only(fit(circle(q), seed, late, stated=True), "wrong angles")
        assert "point 8 (-2.8" in finding.words
        assert not finding.grave


def test_every_finding_says_what_to_do():
    q = angles()
    points = circle(q)
    points[3] += 5e-3
    for found in (fit(points, 1, 2.0 * q, stated=True), fit(circle(q / 6), 1, q / 6, stated=False)):
        assert found.findings
        for finding in found.findings:
            assert any(verb in finding.words for verb in ("look", "sweep", "mount", "correct", "measure", "check"))
            assert finding.figures
            assert str(finding).startswith(finding.kind)


def test_what_cannot_be_a_sweep_is_refused_in_words():
    q = angles()
    with pytest.raises(ValueError, match="shape"):
        sweep_of(circle(q), angles_rad=q[:-1])
    with pytest.raises(ValueError, match="reflectors"):
        Sweep(circle(q), np.zeros(30), ("a", "b"))
    with pytest.raises(NoCircleError, match="0 points"):
        fit_axis(sweep_of(np.zeros((0, 3))))
    with pytest.raises(ValueError, match="not finite"):
        sweep_of(np.full((6, 3), np.nan))
    with pytest.raises(ValueError, match="positive"):
        sweep_of(circle(q), noise_m=0.0)
    with pytest.raises(ValueError, match="twice"):
        sweep_of(circle(q), noise_m=1e-5, covariances_m2=np.tile(np.eye(3), (30, 1, 1)))
    with pytest.raises(ValueError, match="positive definite"):
        sweep_of(circle(q), covariances_m2=np.zeros((30, 3, 3)))


def test_a_point_far_off_cannot_swing_a_short_arc_to_itself():
    """Two points 0.2 and 0.4 m off leave all thirty of a 32° arc off alike, by 27 mm."""
    q = angles(32.2)
    for seed in SEEDS:
        points = circle(q)
        spokes = points * [1.25, 1.25, 0.0]
        for k, size_m, angle in ((26, 0.216, 6.06), (3, 0.384, 5.73)):
            points[k] += size_m * (np.cos(angle) * spokes[k] + np.sin(angle) * np.array([0.0, 0.0, 1.0]))
        found = fit(points, seed, q, stated=False)
        assert np.flatnonzero(~found.kept).tolist() == [3, 26]
        assert found.usable
