"""Eq. (11): the small matrix is the double sum, however it was read."""

from __future__ import annotations

import numpy as np
import pytest

from problems import case, random_transforms
from sixthlink.calibrate.head import FactorStream, HeadProblem, objective, objective_values


def literal(problem: HeadProblem, X: np.ndarray, rotation_length_m: float) -> float:
    """Eq. (11) as printed: a double loop over pairs of shots of one placement."""
    M = problem.Ts_outer @ X @ problem.Ts_inner
    total = 0.0
    for i in range(len(M)):
        for j in range(i + 1, len(M)):
            if problem.placements[i] == problem.placements[j]:
                difference = M[i] - M[j]
                total += np.sum(difference[:3, 3] ** 2) + rotation_length_m**2 * np.sum(difference[:3, :3] ** 2)
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


def test_no_digits_are_lost_at_the_optimum_of_data_with_a_micrometre_of_noise():
    rng = np.random.default_rng(7)
    sample = case(rng, shots=60, placements=3, sigma_m=1e-6, sigma_rad=1e-6)
    value = objective_values(objective(sample.problem, 1.0), sample.X[:3, :3], sample.X[:3, 3])
    assert value == pytest.approx(literal(sample.problem, sample.X, 1.0), rel=1e-9)


def test_streaming_in_pieces_equals_reading_at_once():
    rng = np.random.default_rng(3)
    problem = case(rng, shots=400, placements=2, sigma_m=1e-4, sigma_rad=1e-4).problem
    stream = FactorStream()
    for piece in np.array_split(np.argsort(rng.random(400)), 37):
        for p in np.unique(problem.placements[piece]):
            members = piece[problem.placements[piece] == p]
            stream.add(problem.Ts_outer[members], problem.Ts_inner[members], int(p))
    X = random_transforms(rng, 20)
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
