"""How long does the proven solution take beside OpenCV 4.14's Park and Shah, on the same shots in one process?

And how do time and memory of the factor grow with the shots?

    PYTHONPATH=src .venv-cv4/bin/python benchmarks/solver_times.py     (make bench)

Prints medians and ratios; the ratios are what travels from machine to machine.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable

import cv2
import numpy as np

from certified_heads import transforms
from sixthlink.calibrate.head import FactorStream, HeadProblem, objective, objective_values, polished, solve_certified
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


def repeated(rng: np.random.Generator, shots: int, placements: int) -> HeadProblem:
    few = sample(rng, 1000)
    outer, inner = (np.repeat(Ts, shots // 1000, axis=0) for Ts in (few.Ts_outer, few.Ts_inner))
    return HeadProblem(outer, inner, np.arange(shots) % placements)


def linearity(rng: np.random.Generator) -> None:
    """Each factor is timed beside a product over the same poses, turn by turn, so that a busy machine slows both."""
    print("| shots | placements, interleaved | factor, ms | per shot, us | factor / A @ B |\n|---|---|---|---|---|")
    for shots, placements in (
        (1000, 1),
        (10_000, 1),
        (100_000, 1),
        (1_000_000, 1),
        (1_000_000, 5),
        (1_000_000, 10_000),
    ):
        p = repeated(rng, shots, placements)
        factors, products = [], []
        for _ in range(max(5, 100_000 // shots)):
            products.append(median_ms(lambda q=p: q.Ts_outer @ q.Ts_inner, 1))
            factors.append(median_ms(lambda q=p: objective(q, 1.0), 1))
        factor, ratio = np.median(factors), np.median(factors) / np.median(products)
        print(f"| {shots} | {placements} | {factor:.1f} | {factor * 1e3 / shots:.2f} | {ratio:.1f} |")


def memory(rng: np.random.Generator, piece: int = 10_000) -> None:
    """Peak of what is allocated while pieces are read, beside the piece itself; and by one call with all shots."""
    print("| shots | streamed, peak MB | at once, peak MB | the poses, MB |\n|---|---|---|---|")
    for shots in (100_000, 1_000_000):
        few = sample(rng, piece)
        p = repeated(rng, shots, 5)
        tracemalloc.start()
        stream = FactorStream()
        for k in range(shots // piece):
            stream.add(few.Ts_outer, few.Ts_inner, k % 5)
        stream.objective(1.0)
        streamed = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.reset_peak()
        held = tracemalloc.get_traced_memory()[0] / 1e6
        objective(p, 1.0)
        at_once = tracemalloc.get_traced_memory()[1] / 1e6 - held
        tracemalloc.stop()
        print(f"| {shots} | {streamed:.1f} | {at_once:.1f} | {(p.Ts_outer.nbytes + p.Ts_inner.nbytes) / 1e6:.0f} |")


def digits(rng: np.random.Generator) -> None:
    for shots in (400, 20_000):
        p = sample(rng, shots, 1e-6)
        eq11 = objective(p, 1.0)
        X, certificate = solve_certified(eq11)
        M = (p.Ts_outer @ X @ p.Ts_inner)[:, :3]
        literal = len(M) * np.sum((M - M.mean(axis=0)) ** 2)
        value = objective_values(eq11, X[:3, :3], X[:3, 3])
        print(f"1 um of noise, {shots} shots: factor against the literal sum {abs(value / literal - 1):.1e} relative,")
        print(f"certified {certificate.certified}, relative gap {certificate.relative_gap:.1e}")


if __name__ == "__main__":
    rng = np.random.default_rng(0)
    beside_opencv(rng)
    linearity(rng)
    memory(rng)
    digits(rng)
