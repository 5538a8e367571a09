"""How do the paper's swarms do beside the global searches of the field, at equal numbers of evaluations of eq. (11)?

    PYTHONPATH=src .venv-peers/bin/python benchmarks/global_search.py [PAPER_PROBLEMS] [ROBUST_PROBLEMS]  (make bench)

First the paper's six numbers in the paper's box; then everybody gets the quaternion without seams, with the translation
eliminated. A search succeeds when its best F is within 0.1 % of the proven minimum (certified_heads.py has the problems
and the proof). Time is the search without proof and polish, as a multiple of QPSO's.

What each was set to: its documented defaults, the box, a seed, and the evaluations as its only limit. pyswarms: the
c1, c2, w of its own first example, 40 particles (12 in the second table). cma: BIPOP restarts until the evaluations are
spent, the box scaled to one, first step a quarter of it. pymoo: differential evolution, 100 individuals. SciPy:
differential evolution without its own polish and without early stop; dual annealing with its own local search; DIRECT
without tolerances. All but dual annealing and DIRECT judge a population in one call. Two problems run side by side,
one processor core each.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import chdir
from dataclasses import dataclass, field
from multiprocessing import get_context
from tempfile import TemporaryDirectory

import numpy as np

from certified_heads import kind, problem
from sixthlink.calibrate.head import (
    Objective,
    objective,
    objective_values,
    polished,
    rotation_values,
    search_box,
    solve_certified,
)
from sixthlink.calibrate.head.search import paper_rotations, quaternion_rotations
from sixthlink.solvers import Qpso, SwarmBudget

Rotations = Callable[[np.ndarray], np.ndarray]

WITHIN = 1.001
"""A search succeeds within 0.1 % of the proven minimum."""


@dataclass
class Task:
    """A box, a judge of many positions at once that remembers its best, and how many it may judge."""

    lower: np.ndarray
    upper: np.ndarray
    values: Callable[[np.ndarray], np.ndarray]
    evaluations: int
    seed: int
    used: int = 0
    best_value: float = np.inf
    best: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def judge(self, positions: np.ndarray) -> np.ndarray:
        """What is judged beyond the limit does not count."""
        values = self.values(positions)
        flat = values.ravel()[: max(0, self.evaluations - self.used)]
        self.used += values.size
        if flat.size and flat.min() < self.best_value:
            self.best_value = float(flat.min())
            self.best = positions.reshape(-1, len(self.lower))[int(flat.argmin())].copy()
        return values

    def judge_one(self, position: np.ndarray) -> float:
        """For searches that ask one by one."""
        return float(self.judge(np.asarray(position)[None])[0])


def qpso(swarms: int, particles: int, iterations: int) -> Callable[[Task], np.ndarray]:
    def search(task: Task) -> np.ndarray:
        swarm = Qpso(
            task.lower, task.upper, SwarmBudget(swarms, particles, iterations), np.random.default_rng(task.seed)
        )
        while not swarm.done:
            swarm.tell(task.judge(swarm.ask()))
        return swarm.best_positions

    return search


def chance(task: Task) -> None:
    """The control: positions drawn at random, forty at a time."""
    rng = np.random.default_rng(task.seed)
    while task.used < task.evaluations:
        task.judge(rng.uniform(task.lower, task.upper, (40, len(task.lower))))


def pyswarms(particles: int) -> Callable[[Task], None]:
    from pyswarms.single import GlobalBestPSO

    def search(task: Task) -> None:
        np.random.seed(task.seed)  # noqa: NPY002 - it draws from the global generator
        options = {"c1": 0.5, "c2": 0.3, "w": 0.9}
        swarm = GlobalBestPSO(particles, len(task.lower), options, bounds=(task.lower, task.upper))
        swarm.optimize(task.judge, task.evaluations // particles, verbose=False)

    return search


def cma(task: Task) -> None:
    import cma

    width = task.upper - task.lower
    rng = np.random.default_rng(task.seed)
    cma.fmin2(
        None,
        lambda: rng.random(len(width)),
        0.25,
        {"bounds": [0.0, 1.0], "maxfevals": task.evaluations, "seed": task.seed + 1, "verbose": -9},
        restarts=100,
        bipop=True,
        parallel_objective=lambda units: list(task.judge(task.lower + np.array(units) * width)),
    )


def pymoo(task: Task) -> None:
    from pymoo.algorithms.soo.nonconvex.de import DE
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    class Eq11(Problem):
        def _evaluate(self, x, out, *args, **kwargs) -> None:
            out["F"] = task.judge(x)

    box = Eq11(n_var=len(task.lower), n_obj=1, xl=task.lower, xu=task.upper)
    minimize(box, DE(), ("n_eval", task.evaluations), seed=task.seed, verbose=False)


def evolution(task: Task) -> None:
    from scipy.optimize import differential_evolution

    generations = task.evaluations // (15 * len(task.lower)) - 1
    differential_evolution(
        lambda columns: task.judge(columns.T),
        np.column_stack([task.lower, task.upper]),
        maxiter=generations,
        tol=0.0,
        polish=False,
        updating="deferred",
        vectorized=True,
        rng=task.seed,
    )


def annealing(task: Task) -> None:
    from scipy.optimize import dual_annealing

    box = np.column_stack([task.lower, task.upper])
    dual_annealing(task.judge_one, box, maxiter=10**6, maxfun=task.evaluations, rng=task.seed)


def direct(task: Task) -> None:
    from scipy.optimize import direct as scipy_direct

    box = np.column_stack([task.lower, task.upper])
    scipy_direct(task.judge_one, list(box), maxfun=task.evaluations, maxiter=10**6, vol_tol=0.0, len_tol=0.0)


def peers(particles: int) -> dict[str, Callable[[Task], None]]:
    return {
        "chance": chance,
        "pyswarms, global best": pyswarms(particles),
        "cma, BIPOP": cma,
        "pymoo, differential evolution": pymoo,
        "SciPy, differential evolution": evolution,
        "SciPy, dual annealing": annealing,
        "SciPy, DIRECT": direct,
    }


def paper_task(eq11: Objective, half_width_m: float, seed: int) -> tuple[Task, Rotations]:
    upper = np.array([np.pi, np.pi / 2, np.pi, *[half_width_m] * 3])
    sign = np.array([-1.0, -1.0, 1.0])

    def values(numbers: np.ndarray) -> np.ndarray:
        return objective_values(eq11, paper_rotations(numbers), sign * numbers[..., 3:])

    return Task(-upper, upper, values, 40 * 1001, seed), paper_rotations


def robust_task(eq11: Objective, _half_width_m: float, seed: int) -> tuple[Task, Rotations]:
    def values(quaternions: np.ndarray) -> np.ndarray:
        return rotation_values(eq11, quaternion_rotations(quaternions))

    return Task(-np.ones(4), np.ones(4), values, 48 * 41, seed), quaternion_rotations


def outcomes(table: str, number: int) -> dict[str, tuple[bool, bool, int, float]]:
    """Of every search on one problem: success alone, success after the polish, evaluations, seconds."""
    warnings.filterwarnings("ignore")
    paper = table == "paper"
    own = {"QPSO, 1 swarm of 40": qpso(1, 40, 1000)} if paper else {"QPSO, 4 swarms of 12": qpso(4, 12, 40)}
    sample = problem(np.random.default_rng([1, number]), kind(number))
    eq11 = objective(sample, 1.0)
    limit = solve_certified(eq11)[1].bound_m2 * WITHIN
    results = {}
    for name, search in (own | peers(40 if paper else 12)).items():
        task, rotations = (paper_task if paper else robust_task)(eq11, search_box(sample).half_width_m, number)
        start = time.perf_counter()
        search(task)
        seconds = time.perf_counter() - start
        head = polished(eq11, rotations(task.best))
        after = float(rotation_values(eq11, head[:3, :3]))
        results[name] = (task.best_value <= limit, after <= limit, min(task.used, task.evaluations), seconds)
    return results


def compared(table: str, problems: int, pool: ProcessPoolExecutor) -> None:
    """Print one table; the first search sets the unit of time."""
    runs = list(pool.map(outcomes, [table] * problems, range(problems)))
    print(f"\n{table} formulation, {problems} problems\n")
    print("| search | alone | after the polish | evaluations | time |\n|---|---|---|---|---|")
    unit_s = 0.0
    for name in runs[0]:
        alone, after, used, seconds = (np.array(column) for column in zip(*(run[name] for run in runs), strict=True))
        unit_s = unit_s or float(np.median(seconds))
        print(f"| {name} | {alone.sum()} | {after.sum()} | {used.mean():.0f} | {np.median(seconds) / unit_s:.1f} |")


if __name__ == "__main__":
    paper_problems, robust_problems = (int(v) for v in (sys.argv[1:] + ["20", "50"][len(sys.argv) - 1 :])[:2])
    # pyswarms leaves a log file in the folder in which it is imported.
    with TemporaryDirectory() as folder, chdir(folder), ProcessPoolExecutor(2, get_context("spawn")) as workers:
        compared("paper", paper_problems, workers)
        compared("robust", robust_problems, workers)
