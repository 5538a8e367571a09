"""How often is the global optimum proven, how quickly, and how often do the swarms find it?

    python benchmarks/certified_heads.py [PROBLEMS] [SWARM_RUNS]

Random heads anywhere on the rotation group, 5-60 shots, 1-6 placements, noise up to 1° and 2 mm; every tenth head at
β = ±90° and every tenth on the ±180° seam. The swarms are judged by the certificate's bound.
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


def head(rng: np.random.Generator, number: int) -> np.ndarray:
    X = transforms(rng, 1, 0.3)[0]
    alpha, gamma = rng.uniform(-np.pi, np.pi, 2)
    if number % 10 == 0:
        X[:3, :3] = Rotation.from_euler("XYZ", [alpha, rng.choice([-0.5, 0.5]) * np.pi, gamma]).as_matrix()
    if number % 10 == 1:
        X[:3, :3] = Rotation.from_euler("XYZ", [np.pi, rng.uniform(-1.5, 1.5), -np.pi]).as_matrix()
    return X


def problem(rng: np.random.Generator, number: int, shots: int | None = None) -> HeadProblem:
    N = shots or int(rng.integers(5, 61))
    P = int(rng.integers(1, min(6, N // 3) + 1))
    placements = np.sort(np.concatenate([np.repeat(np.arange(P), 3), rng.integers(0, P, N - 3 * P)]))
    outer, target = transforms(rng, N, 1.0), transforms(rng, P, 1.0)
    inner = np.linalg.inv(outer @ head(rng, number)) @ target[placements]
    sigma_rad, sigma_m = np.deg2rad(10 ** rng.uniform(-3, 0)), 10 ** rng.uniform(-6, np.log10(2e-3))
    inner[:, :3, :3] = Rotation.from_rotvec(rng.normal(0, sigma_rad, (N, 3))).as_matrix() @ inner[:, :3, :3]
    inner[:, :3, 3] += rng.normal(0, sigma_m, (N, 3))
    return HeadProblem(outer, inner, placements)


def certified(problems: int) -> None:
    rng = np.random.default_rng(0)
    proven, relaxed, worst = 0, 0, 0.0
    for number in range(problems):
        certificate = solve_certified(objective(problem(rng, number), 1.0))[1]
        proven += certificate.certified
        relaxed += certificate.relaxed
        worst = max(worst, certificate.relative_gap)
    print(f"certified {proven} of {problems}; relaxation needed in {relaxed}; largest relative gap {worst:.1e}")
    times = []
    for number in range(300):
        sample = problem(rng, number, 50)
        start = time.perf_counter()
        solve_certified(objective(sample, 1.0))
        times.append(time.perf_counter() - start)
    print(f"50 shots, factor and proof: median {np.median(times) * 1e3:.2f} ms")


def swarms(runs: int) -> None:
    budgets = {
        "paper, 1 swarm of 40 x 1000": ("paper", SwarmBudget(1, 40, 1000), 1.0),
        "paper in millimetres, 1 swarm of 40 x 1000": ("paper", SwarmBudget(1, 40, 1000), 1e-3),
        "robust, 4 swarms of 12 x 40": ("robust", SwarmBudget(4, 12, 40), 1.0),
    }
    for name, (variant, budget, length_m) in budgets.items():
        rng = np.random.default_rng(1)
        alone, polished, total = 0, 0, runs if variant == "paper" else 30 * runs
        for number in range(total):
            sample = problem(rng, number)
            eq11 = objective(sample, length_m)
            limit = solve_certified(eq11)[1].bound_m2
            _, found = search_head(
                eq11, search_box(sample), seed=number, budget=budget, progress=Silent(), variant=variant
            )
            alone += found.best_unpolished_m2 <= limit * 1.001
            polished += found.value_m2 <= limit * (1 + 1e-6)
        print(f"{name}: within 0.1 % alone {alone} of {total}, after the polish {polished} of {total}")


if __name__ == "__main__":
    certified(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
    swarms(int(sys.argv[2]) if len(sys.argv) > 2 else 100)
