"""The certificate: proves the global minimum, and refuses to prove anything else."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import case, random_transforms
from sixthlink.calibrate.head import (
    certificate_of,
    objective,
    objective_values,
    polished,
    rotation_values,
    solve_certified,
)
from sixthlink.calibrate.head.relaxation import orthogonality_matrices, solve_relaxation


def test_every_rotation_satisfies_the_constraints_and_a_reflection_does_not():
    rng = np.random.default_rng(0)
    A = orthogonality_matrices()
    for R in Rotation.random(50, random_state=rng).as_matrix():
        x = np.append(R.ravel(), 1.0)
        assert np.abs(x @ A @ x).max() < 1e-14
        mirrored = np.append(-R.ravel(), 1.0)
        assert np.abs(mirrored @ A @ mirrored).max() > 0.5


@pytest.mark.parametrize("rotation_length_m", [1.0, 1e-3])
def test_random_heads_are_solved_and_proven(rotation_length_m):
    rng = np.random.default_rng(1)
    for _ in range(150):
        shots = int(rng.integers(6, 60))
        sample = case(
            rng,
            shots=shots,
            placements=int(rng.integers(1, min(6, shots // 3) + 1)),
            sigma_m=10 ** rng.uniform(-6, -2.7),
            sigma_rad=np.deg2rad(10 ** rng.uniform(-3, 0)),
        )
        eq11 = objective(sample.problem, rotation_length_m)
        X, certificate = solve_certified(eq11)
        assert certificate.certified, certificate
        truth = objective_values(eq11, sample.X[:3, :3], sample.X[:3, 3])
        assert certificate.bound_m2 <= certificate.value_m2 <= truth * (1 + 1e-9)
        assert objective_values(eq11, X[:3, :3], X[:3, 3]) == pytest.approx(certificate.value_m2, rel=1e-6)


def test_no_rotation_is_ever_below_the_bound():
    rng = np.random.default_rng(2)
    eq11 = objective(case(rng, shots=8, placements=1, sigma_m=0.05, sigma_rad=0.5).problem, 1.0)
    _, certificate = solve_certified(eq11)
    starts = Rotation.random(300, random_state=rng).as_matrix()
    values = rotation_values(eq11, np.stack([polished(eq11, R)[:3, :3] for R in starts]))
    assert values.min() >= certificate.bound_m2 * (1 - 1e-9)


def test_a_wrong_answer_is_not_certified():
    rng = np.random.default_rng(3)
    for _ in range(20):
        sample = case(rng, shots=12, placements=2, sigma_m=1e-3, sigma_rad=1e-3)
        eq11 = objective(sample.problem, 1.0)
        off = Rotation.from_rotvec(rng.normal(0, 0.02, 3)).as_matrix() @ sample.X[:3, :3]
        judged = certificate_of(eq11, off)
        assert not judged.certified
        assert judged.bound_m2 <= solve_certified(eq11)[1].value_m2 * (1 + 1e-6)


def test_the_relaxation_is_tight_and_agrees_with_the_direct_certificate():
    rng = np.random.default_rng(4)
    eq11 = objective(case(rng, shots=20, placements=2, sigma_m=1e-3, sigma_rad=5e-3).problem, 1.0)
    X, _ = solve_certified(eq11)
    scale = np.sum(eq11.rotation_factor**2)
    matrix, _ = solve_relaxation(eq11.rotation_factor.T @ eq11.rotation_factor / scale)
    eigenvalues, vectors = np.linalg.eigh(matrix)
    assert eigenvalues[-2] / eigenvalues[-1] < 1e-6
    x = vectors[:, -1] / vectors[-1, -1]
    np.testing.assert_allclose(x[:9].reshape(3, 3), X[:3, :3], atol=1e-4)


@pytest.mark.parametrize("beta_rad", [np.pi / 2, -np.pi / 2, 0.3])
@pytest.mark.parametrize("alpha_rad", [np.pi, -np.pi + 1e-9, 0.0])
def test_seams_of_the_euler_angles_mean_nothing_to_the_solver(alpha_rad, beta_rad):
    rng = np.random.default_rng(5)
    head = np.eye(4)
    head[:3, :3] = Rotation.from_euler("XYZ", [-alpha_rad, beta_rad, 1.0]).as_matrix()
    sample = case(rng, shots=10, placements=2, head=head)
    X, certificate = solve_certified(objective(sample.problem, 1.0))
    assert certificate.certified
    np.testing.assert_allclose(X, head, atol=1e-9)


def test_heavy_noise_brings_the_relaxation_in_and_still_bounds_the_minimum():
    rng = np.random.default_rng(6)
    relaxed = 0
    for _ in range(20):
        sample = case(rng, shots=5, placements=1, sigma_m=0.3, sigma_rad=1.5)
        eq11 = objective(sample.problem, 1.0)
        _, certificate = solve_certified(eq11)
        relaxed += certificate.relaxed
        starts = random_transforms(rng, 30)[:, :3, :3]
        best = rotation_values(eq11, np.stack([polished(eq11, R)[:3, :3] for R in starts])).min()
        assert certificate.bound_m2 <= best * (1 + 1e-6)
    assert relaxed > 0
