"""How often is the global optimum proven, how quickly, and how often do the swarms find it?

    python benchmarks/certified_heads.py [PROBLEMS] [SWARM_RUNS]

Random heads anywhere on the rotation group, 5-60 shots, 1-6 placements, noise up to 1° and 2 mm; every tenth head at
β = ±90° and every tenth on the ±180° seam; for the robust swarm, every sixth. The swarms are judged by the
certificate's bound.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from scipy.spatial.transform import Rotation

from sixthlink.calibrate.head import HeadProblem, objective, search_box, search_head, solve_certified
from sixthlink.progress import Silent
from sixthlink.solvers import SwarmBudget


def transforms(rng: np.random.Generator, n: int, reach_m: float) -> np.ndarray:
    T = np.tile(np.eye(4), (n, 1, 1))
    T[:, :3, :3] = Rotation.random(n, random_state=rng).as_matrix()
    T[:, :3, 3] = rng.uniform(-reach_m, reach_m, (n, 3))
    return T


KINDS = ("β = ±90°", "±180° seam")
ORDINARY = "elsewhere"


def kind(number: int, every: int = 10) -> str:
    return KINDS[number % every] if number % every < len(KINDS) else ORDINARY


def head(rng: np.random.Generator, where: str) -> np.ndarray:
    X = transforms(rng, 1, 0.3)[0]
    alpha, gamma = rng.uniform(-np.pi, np.pi, 2)
    if where == KINDS[0]:
        X[:3, :3] = Rotation.from_euler("XYZ", [alpha, rng.choice([-0.5, 0.5]) * np.pi, gamma]).as_matrix()
    if where == KINDS[1]:
        X[:3, :3] = Rotation.from_euler("XYZ", [np.pi, rng.uniform(-1.5, 1.5), -np.pi]).as_matrix()
    return X


def problem(rng: np.random.Generator, where: str, shots: int | None = None) -> HeadProblem:
    N = shots or int(rng.integers(5, 61))
    P = int(rng.integers(1, min(6, N // 3) + 1))
    placements = np.sort(np.concatenate([np.repeat(np.arange(P), 3), rng.integers(0, P, N - 3 * P)]))
    outer, target = transforms(rng, N, 1.0), transforms(rng, P, 1.0)
    inner = np.linalg.inv(outer @ head(rng, where)) @ target[placements]
    sigma_rad, sigma_m = np.deg2rad(10 ** rng.uniform(-3, 0)), 10 ** rng.uniform(-6, np.log10(2e-3))
    inner[:, :3, :3] = Rotation.from_rotvec(rng.normal(0, sigma_rad, (N, 3))).as_matrix() @ inner[:, :3, :3]
    inner[:, :3, 3] += rng.normal(0, sigma_m, (N, 3))
    return HeadProblem(outer, inner, placements)


def certified(problems: int) -> None:
    rng = np.random.default_rng(0)
    proven, relaxed, worst = 0, 0, 0.0
    for number in range(problems):
        certificate = solve_certified(objective(problem(rng, kind(number)), 1.0))[1]
        proven += certificate.certified
        relaxed += certificate.relaxed
        worst = max(worst, certificate.relative_gap)
    print(f"certified {proven} of {problems}; relaxation needed in {relaxed}; largest relative gap {worst:.1e}")
    times = []
    for number in range(300):
        sample = problem(rng, kind(number), 50)
        start = time.perf_counter()
        solve_certified(objective(sample, 1.0))
        times.append(time.perf_counter() - start)
    print(f"50 shots, factor and proof: median {np.median(times) * 1e3:.2f} ms")


def swarms(runs: int) -> None:
    """The paper's swarm on ``runs`` problems; the robust one on thirty times as many, a third of them on a seam."""
    print("| swarms | heads | problems | within 0.1 % alone | after the polish |\n|---|---|---|---|---|")
    count("paper, 1 of 40 x 1000", "paper", SwarmBudget(1, 40, 1000), length_m=1.0, problems=runs, every=10)
    count(
        "paper in millimetres, 1 of 40 x 1000",
        "paper",
        SwarmBudget(1, 40, 1000),
        length_m=1e-3,
        problems=runs,
        every=10,
    )
    count("robust, 4 of 12 x 40", "robust", SwarmBudget(4, 12, 40), length_m=1.0, problems=30 * runs, every=6)


def count(name: str, variant: str, budget: SwarmBudget, *, length_m: float, problems: int, every: int) -> None:
    """One row per kind of head and one for all; after the polish, the proven minimum to 1e-6 counts."""
    rng = np.random.default_rng(1)
    tally = {where: np.zeros(3, dtype=np.int64) for where in (*KINDS, ORDINARY)}
    for number in range(problems):
        sample = problem(rng, kind(number, every))
        eq11 = objective(sample, length_m)
        limit = solve_certified(eq11)[1].bound_m2
        found = search_head(eq11, search_box(sample), seed=number, budget=budget, progress=Silent(), variant=variant)[1]
        hits = (True, found.best_unpolished_m2 <= limit * 1.001, found.value_m2 <= limit * (1 + 1e-6))
        tally[kind(number, every)] += hits
    for where, row in (*tally.items(), ("all", sum(tally.values()))):
        print(f"| {name} | {where} | {row[0]} | {row[1]} | {row[2]} |")


if __name__ == "__main__":
    certified(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
    swarms(int(sys.argv[2]) if len(sys.argv) > 2 else 100)
