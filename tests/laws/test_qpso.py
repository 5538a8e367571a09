"""The swarm: eq. (6)-(9) as printed, repeatable, inside its box, never getting worse."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import case
from sixthlink.calibrate.head import certificate_of, objective, search_box, search_head
from sixthlink.progress import Silent
from sixthlink.solvers import Qpso, SwarmBudget, contraction


def sphere(positions: np.ndarray) -> np.ndarray:
    return np.sum((positions - 0.3) ** 2, axis=-1)


def run(seed: int, budget: SwarmBudget, judge=sphere) -> tuple[Qpso, list[float]]:
    swarm = Qpso([-1.0] * 3, [1.0] * 3, budget, np.random.default_rng(seed))
    history = []
    while not swarm.done:
        positions = swarm.ask()
        assert (np.abs(positions) <= 1.0).all()
        swarm.tell(judge(positions))
        history.append(swarm.best_values.min())
    return swarm, history


def test_contraction_falls_from_one_to_a_half():
    assert contraction(0, 100) == 1.0
    assert contraction(100, 100) == 0.5


def test_one_step_follows_the_printed_equations():
    budget = SwarmBudget(swarms=1, particles=5, iterations=10)
    swarm = Qpso([-9.0] * 2, [9.0] * 2, budget, np.random.default_rng(4))
    start = swarm.ask()
    swarm.tell(sphere(start))
    moved = swarm.ask()
    rng = np.random.default_rng(4)
    rng.uniform(-9.0, 9.0, start.shape)
    phi, u, coin = rng.random(start.shape), 1.0 - rng.random(start.shape), rng.random(start.shape)
    best = start[0, np.argmin(sphere(start)[0])]
    for i in range(5):
        for j in range(2):
            C = start[0, :, j].mean()
            p = phi[0, i, j] * start[0, i, j] + (1 - phi[0, i, j]) * best[j]
            step = 1.0 * abs(C - start[0, i, j]) * np.log(1 / u[0, i, j])
            expected = p + step if coin[0, i, j] < 0.5 else p - step
            assert moved[0, i, j] == pytest.approx(np.clip(expected, -9, 9), abs=1e-12)


def test_the_best_never_gets_worse_and_reaches_the_bottom():
    swarm, history = run(0, SwarmBudget(2, 20, 200))
    assert (np.diff(history) <= 0).all()
    np.testing.assert_allclose(swarm.best_positions, 0.3, atol=1e-6)


def test_same_seed_same_search_other_seed_another():
    budget = SwarmBudget(2, 10, 30)
    assert np.array_equal(run(5, budget)[0].best_positions, run(5, budget)[0].best_positions)
    assert not np.array_equal(run(5, budget)[0].best_positions, run(6, budget)[0].best_positions)


def test_a_value_that_is_no_number_counts_as_the_worst():
    def holes(positions: np.ndarray) -> np.ndarray:
        return np.where(positions[..., 0] < 0.0, np.nan, sphere(positions))

    swarm, _ = run(1, SwarmBudget(1, 20, 100), holes)
    assert np.isfinite(swarm.best_values).all()
    np.testing.assert_allclose(swarm.best_positions, 0.3, atol=1e-3)


@pytest.mark.parametrize(
    ("lower", "upper", "words"),
    [([0.0], [0.0], "below"), ([1.0], [0.0], "below"), ([-np.inf], [0.0], "finite")],
)
def test_impossible_boxes_are_refused(lower, upper, words):
    with pytest.raises(ValueError, match=words):
        Qpso(lower, upper, SwarmBudget(), np.random.default_rng(0))


@pytest.mark.parametrize("budget", [{"particles": 1}, {"iterations": 0}, {"swarms": 0}])
def test_impossible_budgets_are_refused(budget):
    with pytest.raises(ValueError, match="at least"):
        SwarmBudget(**budget)


@pytest.mark.parametrize("angles_deg", [(30, 90, 50), (-120, -90, 10), (180, 20, -180), (180, 0, 180), (0, 0, 0)])
def test_the_robust_swarm_and_its_polish_know_no_seam(angles_deg):
    """β = ±90° is the gimbal lock of the paper's angles, ±180° their wall; the certificate judges the answer."""
    head = np.eye(4)
    head[:3, :3] = Rotation.from_euler("XYZ", angles_deg, degrees=True).as_matrix()
    rng = np.random.default_rng(3)
    for seed in range(5):
        problem = case(rng, shots=15, placements=2, sigma_m=1e-3, sigma_rad=1e-2, head=head).problem
        eq11 = objective(problem, 1.0)
        budget = SwarmBudget(4, 12, 40)
        X, report = search_head(
            eq11, search_box(problem), seed=seed, budget=budget, progress=Silent(), variant="robust"
        )
        certificate = certificate_of(eq11, X[:3, :3])
        assert certificate.certified
        assert report.value_m2 == pytest.approx(certificate.value_m2, rel=1e-9)
