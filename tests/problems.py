"""Random head problems with known truth, made by plain matrix products."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sixthlink.calibrate.head import HeadProblem


@dataclass(frozen=True)
class Case:
    problem: HeadProblem
    X: np.ndarray


def random_transforms(rng: np.random.Generator, n: int, reach_m: float = 1.0) -> np.ndarray:
    T = np.tile(np.eye(4), (n, 1, 1))
    T[:, :3, :3] = Rotation.random(n, random_state=rng).as_matrix()
    T[:, :3, 3] = rng.uniform(-reach_m, reach_m, (n, 3))
    return T


def noisy(rng: np.random.Generator, Ts: np.ndarray, sigma_m: float, sigma_rad: float) -> np.ndarray:
    moved = Ts.copy()
    turns = Rotation.from_rotvec(rng.normal(0.0, 1.0, (len(Ts), 3)) * sigma_rad).as_matrix()
    moved[:, :3, :3] = turns @ Ts[:, :3, :3]
    moved[:, :3, 3] += rng.normal(0.0, 1.0, (len(Ts), 3)) * sigma_m
    return moved


def case(
    rng: np.random.Generator,
    *,
    shots: int = 50,
    placements: int = 5,
    sigma_m: float = 0.0,
    sigma_rad: float = 0.0,
    head: np.ndarray | None = None,
    Ts_outer: np.ndarray | None = None,
) -> Case:
    """Shots of a head on a robot that reaches everywhere; noise on the target poses."""
    X = random_transforms(rng, 1, 0.3)[0] if head is None else head
    outer = random_transforms(rng, shots) if Ts_outer is None else Ts_outer
    number = np.arange(len(outer)) % placements
    target = random_transforms(rng, placements)
    inner = np.linalg.inv(outer @ X) @ target[number]
    return Case(HeadProblem(outer, noisy(rng, inner, sigma_m, sigma_rad), number), X)
