"""Motions that cannot show the whole head: refused by name, and good ones never."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import noisy, random_transforms
from sixthlink.calibrate.head import (
    HeadProblem,
    held_objective,
    objective,
    objective_values,
    observability,
    solve_certified,
)
from sixthlink.calibrate.unobserved import degenerate_motion, what_is_held
from sixthlink.errors import TooFewShotsError

SIGMA_M, SIGMA_RAD = 5e-5, np.deg2rad(0.02)


def turns(kind: str, rng: np.random.Generator, shots: int) -> np.ndarray:
    """Rotation vectors of the flange about its first pose [rad]."""
    axis = Rotation.random(random_state=rng).as_matrix()[0]
    return {
        "good": rng.normal(0.0, 1.0, (shots, 3)) * rng.uniform(0.15, 0.8),
        "pure translation": np.zeros((shots, 3)),
        "identical": np.zeros((shots, 3)),
        "one joint": np.linspace(-1.0, 1.0, shots)[:, None] * axis,
        "parallel axes": rng.uniform(-1.0, 1.0, (shots, 1)) * rng.uniform(0.3, 2.0) * axis,
        "too little rotation": rng.normal(0.0, 1.0, (shots, 3)) * np.deg2rad(rng.uniform(0.0, 0.7)),
    }[kind]


def recorded(
    kind: str,
    rng: np.random.Generator,
    rotvecs: np.ndarray | None = None,
    *,
    sigma_m: float = SIGMA_M,
    sigma_rad: float = SIGMA_RAD,
) -> HeadProblem:
    shots = int(rng.integers(5, 40)) if rotvecs is None else len(rotvecs)
    rotvecs = turns(kind, rng, shots) if rotvecs is None else rotvecs
    outer = np.tile(random_transforms(rng, 1)[0], (shots, 1, 1))
    outer[:, :3, :3] = Rotation.from_rotvec(rotvecs).as_matrix() @ outer[:, :3, :3]
    if kind == "one joint":
        outer[:, :3, 3] = Rotation.from_rotvec(rotvecs).apply([0.5, 0.2, 0.4])
    elif kind != "identical":
        outer[:, :3, 3] = np.array([0.8, 0.0, 0.8]) + rng.uniform(-0.4, 0.4, (shots, 3))
    X, target = random_transforms(rng, 2, 0.3)
    inner = noisy(rng, np.linalg.inv(outer @ X) @ target, sigma_m, sigma_rad)
    return HeadProblem(noisy(rng, outer, sigma_m, sigma_rad), inner, np.zeros(shots, dtype=int))


def words(problem: HeadProblem) -> tuple[str, ...]:
    return observability(problem, carrier="flange").words


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("pure translation", "position in the flange frame, all three"),
        ("identical", "orientation in the flange frame, all three"),
        ("parallel axes", "along the common axis"),
        ("too little rotation", "position"),
    ],
)
def test_degenerate_sets_are_named(kind, expected):
    rng = np.random.default_rng(0)
    for _ in range(50):
        assert any(expected in sentence for sentence in words(recorded(kind, rng)))


def test_good_sets_are_not_refused():
    rng = np.random.default_rng(1)
    assert sum(bool(words(recorded("good", rng))) for _ in range(200)) <= 1


def test_the_named_axis_is_the_common_axis():
    rng = np.random.default_rng(2)
    shots = 12
    outer = np.tile(np.eye(4), (shots, 1, 1))
    outer[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-1, 1, (shots, 1)) * [0.0, 0.0, 1.0]).as_matrix()
    outer[:, :3, 3] = rng.uniform(-0.4, 0.4, (shots, 3))
    X, target = random_transforms(rng, 2, 0.3)
    problem = HeadProblem(outer, np.linalg.inv(outer @ X) @ target, np.zeros(shots, dtype=int))
    assert words(problem) == ("the head's position along the common axis (0.00, 0.00, 1.00) of the flange",)


def test_noise_of_a_degree_does_not_make_the_missing_direction_look_seen():
    rng = np.random.default_rng(4)
    for _ in range(60):
        problem = recorded("parallel axes", rng, sigma_m=2e-3, sigma_rad=np.deg2rad(1.0))
        assert any("along the common axis" in sentence for sentence in words(problem))


def test_noise_of_a_degree_does_not_hide_tilts_of_twenty():
    rng = np.random.default_rng(5)
    refused = 0
    for _ in range(60):
        shots = int(rng.integers(8, 40))
        tilts = np.deg2rad(20.0) * np.c_[np.cos(t := rng.uniform(0, 2 * np.pi, shots)), np.sin(t), np.zeros(shots)]
        refused += bool(words(recorded("good", rng, tilts, sigma_m=2e-3, sigma_rad=np.deg2rad(1.0))))
    assert refused <= 1


def test_shots_paired_with_a_wrong_pose_do_not_make_a_good_motion_look_degenerate():
    rng = np.random.default_rng(6)
    for _ in range(20):
        problem = recorded("good", rng, rng.normal(0.0, 0.5, (20, 3)))
        wrong = problem.Ts_inner.copy()
        wrong[:3] = random_transforms(rng, 3)
        assert words(HeadProblem(problem.Ts_outer, wrong, problem.placements)) == ()


def test_robot_and_head_that_never_agree_are_not_called_a_robot_that_did_not_turn():
    rng = np.random.default_rng(7)
    problem = recorded("good", rng, rng.normal(0.0, 0.5, (20, 3)))
    shuffled = HeadProblem(problem.Ts_outer, problem.Ts_inner[rng.permutation(20)], problem.placements)
    refusal = degenerate_motion(observability(shuffled, carrier="flange"))
    assert "robot and head disagree" in str(refusal)
    assert "paired with the wrong pose" in str(refusal)


def test_two_shots_at_each_of_two_placements_show_the_head():
    rng = np.random.default_rng(8)
    outer = random_transforms(rng, 4)
    X, *targets = random_transforms(rng, 3, 0.3)
    placements = np.array([0, 0, 1, 1])
    inner = np.linalg.inv(outer @ X) @ np.array(targets)[placements]
    problem = HeadProblem(outer, inner, placements)
    assert words(problem) == ()
    np.testing.assert_allclose(solve_certified(objective(problem, 1.0))[0], X, atol=1e-9)


def test_two_shots_of_one_placement_are_too_few_and_say_what_one_motion_hides():
    rng = np.random.default_rng(3)
    Ts = np.tile(np.eye(4), (2, 1, 1))
    Ts[1, :3, :3] = Rotation.from_rotvec([0.0, 0.0, -0.7]).as_matrix()
    with pytest.raises(TooFewShotsError, match=r"at least 3 .* along its axis \(0.00, 0.00, 1.00\)"):
        HeadProblem(Ts, random_transforms(rng, 2), np.zeros(2, dtype=int))


@pytest.mark.parametrize("kind", ["parallel axes", "pure translation", "identical", "one joint"])
def test_the_rest_has_one_proven_minimum_that_does_not_move_along_what_is_unseen(kind):
    rng = np.random.default_rng(9)
    for _ in range(6):
        problem = recorded(kind, rng)
        held, unobserved = what_is_held(problem, observability(problem, carrier="flange"))
        eq11 = held_objective(objective(problem, 1.0), held)
        X, certificate = solve_certified(eq11)
        assert certificate.certified
        np.testing.assert_allclose(held.positions @ held.head(X)[:3, 3], 0.0, atol=1e-12)
        along = X[:3, 3] + held.positions.T @ rng.normal(size=len(held.positions))
        assert objective_values(eq11, X[:3, :3], along) == pytest.approx(certificate.value_m2, rel=1e-9)
        free = objective_values(objective(problem, 1.0), X[:3, :3], held.head(X)[:3, 3])
        assert free <= certificate.value_m2 * (1 + 1e-6)
        assert len(unobserved.motions) == len(held.positions) + len(held.turns)


@pytest.mark.parametrize("carried", [False, True])
def test_what_is_held_may_be_held_in_another_frame(carried):
    rng = np.random.default_rng(10)
    problem = recorded("parallel axes", rng)
    held, _ = what_is_held(problem, observability(problem, carrier="flange"))
    T_link5_flange = random_transforms(rng, 1, 0.3)[0] if carried else np.eye(4)
    moved = HeadProblem(problem.Ts_outer @ np.linalg.inv(T_link5_flange), problem.Ts_inner, problem.placements)
    here = solve_certified(held_objective(objective(problem, 1.0), held))
    there = solve_certified(held_objective(objective(moved, 1.0), held.seen_from(T_link5_flange)))
    assert there[1].value_m2 == pytest.approx(here[1].value_m2, rel=1e-9)
    back = held.head(np.linalg.inv(T_link5_flange) @ there[0])
    np.testing.assert_allclose(back, held.head(here[0]), atol=1e-8)
