"""Is the ℓ that a recording gives itself the likeliest one, and does each proof judge the sum it was made for?"""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.calibrate.head import HeadProblem, certificate_of, objective, scatter, solve_certified
from sixthlink.calibrate.head.compare import LIKELIEST, solvers
from sixthlink.calibrate.head.weights import likeliest_objective
from sixthlink.geometry import Floats, apply_motion, exp_rotation, inverse, rotation_angle, transform


def _problem(seed: int, shots: int = 30, noise: tuple[float, float] = (1e-3, 3e-3), scale: float = 1.0) -> HeadProblem:
    """Shots whose flange errs by noise [m, rad] about each axis; lengths times scale."""
    rng = np.random.default_rng(seed)
    turns = exp_rotation(rng.uniform(-0.6, 0.6, (shots, 3)))
    B = transform(turns, rng.uniform([-0.1, -0.1, 0.4], [0.1, 0.1, 0.8], (shots, 3)))
    Z = transform(exp_rotation(rng.normal(size=(2, 3))), rng.uniform(-1, 1, (2, 3)))
    where = np.arange(shots) % 2
    # The noise moves the target, as eq. (11) imagines it.
    seen = apply_motion(Z[where], rng.normal(size=(shots, 6)) * np.repeat(noise, 3))
    A = seen @ inverse(B) @ inverse(_head())
    A[:, :3, 3] *= scale
    B[:, :3, 3] *= scale
    return HeadProblem(A, B, where)


def _head() -> Floats:
    return transform(exp_rotation(np.array([0.3, -0.8, 1.9])), [0.05, -0.1, 0.15])


def test_exact_shots_give_the_exact_head() -> None:
    X = solve_certified(likeliest_objective(_problem(1, noise=(0.0, 0.0))))[0]
    assert np.abs(X - _head()).max() < 1e-9


@pytest.mark.parametrize("scale", [1e3, 1e-3])
def test_unit_of_length_does_not_matter(scale: float) -> None:
    X = solve_certified(likeliest_objective(_problem(2)))[0]
    scaled = solve_certified(likeliest_objective(_problem(2, scale=scale)))[0]
    assert rotation_angle(X[:3, :3].T @ scaled[:3, :3]) < 1e-8
    assert np.abs(scaled[:3, 3] / scale - X[:3, 3]).max() < 1e-8


def test_no_other_length_is_likelier() -> None:
    """Both standard deviations unknown, the likelihood falls with the sum of the logarithms of both scatters."""
    problem = _problem(3)
    length_m = likeliest_objective(problem).rotation_length_m
    surprise = []
    for factor in (0.7, 0.9, 1.0, 1.1, 1.4):
        found = scatter(problem, solve_certified(objective(problem, factor * length_m))[0])
        surprise.append(np.log(found.rms_translation_m) + np.log(found.rms_rotation_rad))
    assert int(np.argmin(surprise)) == 2


@pytest.mark.parametrize("noise", [(1e-3, 3e-3), (3e-3, 1e-3)])
def test_length_is_the_ratio_of_the_noises(noise: tuple[float, float]) -> None:
    """A turn of δ changes the entries of a rotation by √2 |δ|."""
    found = likeliest_objective(_problem(4, shots=400, noise=noise))
    assert found.rotation_length_m == pytest.approx(noise[0] / noise[1] / np.sqrt(2.0), rel=0.07)


def test_every_proof_judges_its_own_sum() -> None:
    problem = _problem(5)
    for name, solver in solvers(0).items():
        if name.startswith("certified"):
            assert certificate_of(solver.weigh(problem), solver.solve(problem)[:3, :3]).certified
    lengths = [solvers(0)[n].weigh(problem).rotation_length_m for n in (LIKELIEST, "certified-metres", "park")]
    assert lengths[0] == likeliest_objective(problem).rotation_length_m
    assert lengths[1:] == [1.0, 1.0]
