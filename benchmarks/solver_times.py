"""How long does the proven solution take beside OpenCV 4.14's Park and Shah, on the same shots in one process?

    PYTHONPATH=src .venv-cv4/bin/python benchmarks/solver_times.py     (make bench)

Prints medians and ratios; the ratios are what travels from machine to machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import cv2
import numpy as np

from certified_heads import transforms
from sixthlink.calibrate.head import HeadProblem, objective, objective_values, polished, solve_certified
from sixthlink.calibrate.head.certificate import linear_start
from sixthlink.geometry import apply_motion, inverse


def sample(rng: np.random.Generator, shots: int, sigma: float = 1e-3) -> HeadProblem:
    outer, X, target = transforms(rng, shots, 1.0), transforms(rng, 1, 0.3)[0], transforms(rng, 1, 1.0)
    inner = apply_motion(inverse(outer @ X) @ target, rng.normal(0.0, sigma, (shots, 6)))
    return HeadProblem(outer, inner, np.zeros(shots, dtype=np.int64))


def median_ms(run: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return float(np.median(times)) * 1e3


def polished_only(problem: HeadProblem) -> np.ndarray:
    eq11 = objective(problem, 1.0)
    return polished(eq11, linear_start(eq11.rotation_factor))


def beside_opencv(rng: np.random.Generator) -> None:
    print("| shots | proven, ms | Park / proven | Shah / proven | Park / unproven |\n|---|---|---|---|---|")
    for shots in (50, 100, 200, 500, 800):
        p = sample(rng, shots)
        base = inverse(p.Ts_outer)
        hand = (list(p.Ts_outer[:, :3, :3]), list(p.Ts_outer[:, :3, 3]))
        eye = (list(p.Ts_inner[:, :3, :3]), list(p.Ts_inner[:, :3, 3]))
        world = (list(base[:, :3, :3]), list(base[:, :3, 3]))
        park = median_ms(
            lambda h=hand, e=eye: cv2.calibrateHandEye(*h, *e, method=cv2.CALIB_HAND_EYE_PARK), 15 if shots < 200 else 3
        )
        shah = median_ms(
            lambda e=eye, w=world: cv2.calibrateRobotWorldHandEye(*e, *w, method=cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH),
            15,
        )
        proven = median_ms(lambda q=p: solve_certified(objective(q, 1.0)), 100)
        unproven = median_ms(lambda q=p: polished_only(q), 100)
        print(f"| {shots} | {proven:.2f} | {park / proven:.1f} | {shah / proven:.2f} | {park / unproven:.1f} |")


def a_million(rng: np.random.Generator) -> None:
    few = sample(rng, 1000)
    outer, inner = np.repeat(few.Ts_outer, 1000, axis=0), np.repeat(few.Ts_inner, 1000, axis=0)
    product = median_ms(lambda: outer @ inner, 3)
    problem = HeadProblem(outer, inner, np.arange(len(outer)) % 5)
    factor = median_ms(lambda: objective(problem, 1.0), 3)
    print(f"a million shots: factor {factor / 1e3:.2f} s, {factor / product:.1f} times NumPy's A @ B")


def digits(rng: np.random.Generator) -> None:
    p = sample(rng, 400, 1e-6)
    eq11 = objective(p, 1.0)
    X, certificate = solve_certified(eq11)
    M = (p.Ts_outer @ X @ p.Ts_inner)[:, :3]
    literal = len(M) * np.sum((M - M.mean(axis=0)) ** 2)
    value = objective_values(eq11, X[:3, :3], X[:3, 3])
    print(f"1 um of noise: factor against the literal sum {abs(value / literal - 1):.1e} relative")
    print(f"certified {certificate.certified}, relative gap {certificate.relative_gap:.1e}")


if __name__ == "__main__":
    rng = np.random.default_rng(0)
    beside_opencv(rng)
    a_million(rng)
    digits(rng)
