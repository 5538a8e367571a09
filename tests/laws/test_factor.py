"""Eq. (11): the small matrix is the double sum, however it was read."""

from __future__ import annotations

import numpy as np
import pytest

from problems import case, noisy, random_transforms
from sixthlink.calibrate.head import FactorStream, HeadProblem, objective, objective_values, solve_certified


def literal(problem: HeadProblem, X: np.ndarray, rotation_length_m: float) -> float:
    """Eq. (11) as printed: every pair of shots of one placement, subtracted before it is squared."""
    M = (problem.Ts_outer @ X @ problem.Ts_inner)[:, :3]
    total = 0.0
    for i in range(len(M) - 1):
        difference = M[i + 1 :][problem.placements[i + 1 :] == problem.placements[i]] - M[i]
        total += np.sum(difference[..., 3] ** 2) + rotation_length_m**2 * np.sum(difference[..., :3] ** 2)
    return float(total)


@pytest.mark.parametrize("rotation_length_m", [1.0, 1e-3, 0.3])
@pytest.mark.parametrize(("shots", "placements"), [(3, 1), (12, 4), (50, 5)])
def test_factor_equals_the_double_sum(shots, placements, rotation_length_m):
    rng = np.random.default_rng(shots)
    problem = case(rng, shots=shots, placements=placements, sigma_m=1e-3, sigma_rad=1e-3).problem
    eq11 = objective(problem, rotation_length_m)
    for X in random_transforms(rng, 5):
        value = objective_values(eq11, X[None, :3, :3], X[None, :3, 3])[0]
        assert value == pytest.approx(literal(problem, X, rotation_length_m), rel=1e-12)


@pytest.mark.parametrize(("shots", "placements"), [(60, 3), (1500, 1), (1500, 4), (1500, 500)])
def test_no_digits_are_lost_at_the_optimum_of_data_with_a_micrometre_of_noise(shots, placements):
    rng = np.random.default_rng(7)
    sample = case(rng, shots=shots, placements=placements, sigma_m=1e-6, sigma_rad=1e-6)
    eq11 = objective(sample.problem, 1.0)
    for X in (sample.X, solve_certified(eq11)[0]):
        value = objective_values(eq11, X[:3, :3], X[:3, 3])
        assert value == pytest.approx(literal(sample.problem, X, 1.0), rel=1e-9)


@pytest.mark.parametrize("length", [1e-6, 1e6])
def test_tiny_and_huge_lengths_change_nothing(length):
    rng = np.random.default_rng(8)
    sample = case(rng, shots=2500, placements=3, sigma_m=1e-6, sigma_rad=1e-6)
    outer, inner, X = (np.array(T) for T in (sample.problem.Ts_outer, sample.problem.Ts_inner, sample.X))
    for T in (outer, inner, X):
        T[..., :3, 3] *= length
    scaled = HeadProblem(outer, inner, sample.problem.placements)
    value = objective_values(objective(scaled, length), X[:3, :3], X[:3, 3])
    assert value == pytest.approx(literal(scaled, X, length), rel=1e-9)


@pytest.mark.parametrize("sizes", [(3, 1), (3, 2, 1, 1), (1, 3, 2) * 400, (1023, 2), (1, 1024, 1, 1025)])
def test_placements_of_any_size_in_any_order(sizes):
    rng = np.random.default_rng(9)
    number = rng.permutation(np.repeat(np.arange(len(sizes)), sizes))
    outer, X, target = random_transforms(rng, len(number)), random_transforms(rng, 1)[0], random_transforms(rng, 1201)
    inner = noisy(rng, np.linalg.inv(outer @ X) @ target[number], 1e-4, 1e-4)
    problem = HeadProblem(outer, inner, number)
    eq11 = objective(problem, 0.3)
    assert eq11.pairs == sum(n * (n - 1) // 2 for n in sizes)
    for head in (X, *random_transforms(rng, 2)):
        value = objective_values(eq11, head[:3, :3], head[:3, 3])
        assert value == pytest.approx(literal(problem, head, 0.3), rel=1e-11)


@pytest.mark.parametrize("placements", [1, 300])
def test_data_without_noise_have_their_minimum_at_rounding(placements):
    rng = np.random.default_rng(10)
    sample = case(rng, shots=3000, placements=placements)
    eq11 = objective(sample.problem, 1.0)
    value = objective_values(eq11, sample.X[:3, :3], sample.X[:3, 3])
    assert value <= 1e-28 * np.sum(eq11.factor**2)
    np.testing.assert_allclose(solve_certified(eq11)[0], sample.X, atol=1e-13)


def narrow(rng: np.random.Generator, shots: int, turn_rad: float) -> np.ndarray:
    """A robot that hardly turns: poses within a small angle of the first."""
    still = np.tile(random_transforms(rng, 1)[0], (shots, 1, 1))
    return noisy(rng, still, 0.1, turn_rad)


@pytest.mark.parametrize("turn_rad", [0.3, 1e-2, 1e-4, 0.0])
def test_weak_motions_keep_their_digits_too(turn_rad):
    rng = np.random.default_rng(11)
    sample = case(rng, placements=2, sigma_m=1e-6, sigma_rad=1e-6, Ts_outer=narrow(rng, 2000, turn_rad))
    value = objective_values(objective(sample.problem, 1.0), sample.X[:3, :3], sample.X[:3, 3])
    assert value == pytest.approx(literal(sample.problem, sample.X, 1.0), rel=1e-9)


def test_matrices_that_are_only_nearly_rotations_count_as_they_are():
    rng = np.random.default_rng(12)
    exact = case(rng, shots=2000, placements=2, sigma_m=1e-4, sigma_rad=1e-4).problem
    printed = HeadProblem(np.round(exact.Ts_outer, 5), np.round(exact.Ts_inner, 5), exact.placements)
    eq11 = objective(printed, 1.0)
    X = solve_certified(eq11)[0]
    value = objective_values(eq11, X[:3, :3], X[:3, 3])
    assert value == pytest.approx(literal(printed, X, 1.0), rel=1e-11)


def test_a_first_shot_that_is_far_off_costs_no_digits():
    rng = np.random.default_rng(13)
    sample = case(rng, shots=2000, placements=2, sigma_m=1e-6, sigma_rad=1e-6)
    inner = sample.problem.Ts_inner.copy()
    inner[:2] = random_transforms(rng, 2)
    spoiled = HeadProblem(sample.problem.Ts_outer, inner, sample.problem.placements)
    value = objective_values(objective(spoiled, 1.0), sample.X[:3, :3], sample.X[:3, 3])
    assert value == pytest.approx(literal(spoiled, sample.X, 1.0), rel=1e-11)


@pytest.mark.parametrize(("shots", "pieces"), [(400, 37), (400, 400), (5000, 3), (5000, 40)])
def test_streaming_in_pieces_in_any_order_equals_reading_at_once(shots, pieces):
    rng = np.random.default_rng(3)
    problem = case(rng, shots=shots, placements=2, sigma_m=1e-4, sigma_rad=1e-4).problem
    stream = FactorStream()
    stream.add(np.zeros((0, 4, 4)), np.zeros((0, 4, 4)), 0)
    for piece in np.array_split(rng.permutation(shots), pieces):
        for p in np.unique(problem.placements[piece]):
            members = piece[problem.placements[piece] == p]
            stream.add(problem.Ts_outer[members], problem.Ts_inner[members], int(p))
    X = np.concatenate([random_transforms(rng, 20), solve_certified(objective(problem, 1.0))[0][None]])
    values = objective_values(objective(problem, 1.0), X[:, :3, :3], X[:, :3, 3])
    streamed = objective_values(stream.objective(1.0), X[:, :3, :3], X[:, :3, 3])
    np.testing.assert_allclose(streamed, values, rtol=1e-12)


def test_the_base_frame_does_not_matter():
    rng = np.random.default_rng(5)
    problem = case(rng, sigma_m=1e-3, sigma_rad=1e-3).problem
    moved = HeadProblem(random_transforms(rng, 1)[0] @ problem.Ts_outer, problem.Ts_inner, problem.placements)
    X = random_transforms(rng, 1)[0]
    values = [objective_values(objective(p, 1.0), X[:3, :3], X[:3, 3]) for p in (problem, moved)]
    assert values[0] == pytest.approx(values[1], rel=1e-12)
