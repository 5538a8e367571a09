"""What is eq. (11) once every shot has been read?

Every shot's target pose is affine in θ = (t, vec R, 1), and the sum over pairs is n times the sum of squares about
the placement's mean. One QR of the centred rows leaves a 13×13 triangular factor U with

    F(R, t) = Σ_{i<j} |t_i - t_j|² + ℓ² |R_i - R_j|²  =  |U θ|²           (eq. 11; method: docs/theory/factor.md)

whatever the number of shots. ℓ is the length that turns a rotation entry into metres; the paper, counting in
millimetres, has ℓ = 1 mm. The triangular factor is used, never the normal matrix UᵀU: squaring would lose the small
residuals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.problem import HeadProblem
from sixthlink.geometry import Floats, frozen_floats, transform

__all__ = [
    "PAPER_ROTATION_LENGTH_M",
    "FactorStream",
    "Objective",
    "best_translation",
    "objective",
    "objective_from_factors",
    "objective_values",
    "rotation_values",
]

PAPER_ROTATION_LENGTH_M = 1e-3
"""ℓ of the paper's eq. (11): lengths counted in millimetres beside rotation entries."""


CHUNK_SHOTS = 4096
"""Shots read at a time: bounds the memory that rows need."""

LEAF_ROWS = 512
"""Rows of one leaf of the QR of QRs: small enough for the cache, large enough to be worth a call."""


@dataclass(frozen=True, eq=False)
class Objective:
    """Eq. (11) of one recording in one small matrix.

    Attributes:
        factor: ``(13, 13)`` upper triangular U; columns t (3), vec R row by row (9), 1. |Uθ|² is in m².
        rotation_length_m: ℓ [m].
        pairs: Number of pairs of shots that eq. (11) sums over.
    """

    factor: Floats
    rotation_length_m: float
    pairs: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "factor", frozen_floats(self.factor, (13, 13), "factor"))

    @property
    def rotation_factor(self) -> Floats:
        """``(10, 10)`` U₂ on (vec R, 1): the objective after the best translation."""
        return self.factor[3:, 3:]


def objective(problem: HeadProblem, rotation_length_m: float = PAPER_ROTATION_LENGTH_M) -> Objective:
    """Read every shot and leave eq. (11) as a triangular factor; linear in the shots.

    Args:
        problem: The shots.
        rotation_length_m: ℓ, the metres that one unit of a rotation entry counts [m].
    """
    order = np.argsort(problem.placements, kind="stable")
    placements = problem.placements[order]
    firsts = np.flatnonzero(np.r_[True, np.diff(placements) > 0])
    counts = np.diff(np.r_[firsts, len(placements)])
    group = np.repeat(np.arange(len(firsts)), counts)
    sums = [np.zeros((len(firsts), *shape)) for shape in ((3, 13), (9, 9))]
    for part in _chunks(len(order)):
        for total, rows in zip(sums, _rows(problem.Ts_outer[order[part]], problem.Ts_inner[order[part]]), strict=True):
            starts = np.flatnonzero(np.r_[True, np.diff(group[part]) > 0])
            total[group[part][starts]] += np.add.reduceat(rows, starts, axis=0)
    means = [total / counts[:, None, None] for total in sums]
    weights = np.sqrt(counts)[group][:, None, None]
    factors = [np.zeros((0, 13)), np.zeros((0, 9))]
    for part in _chunks(len(order)):
        both = _rows(problem.Ts_outer[order[part]], problem.Ts_inner[order[part]])
        for k, rows in enumerate(both):
            centred = (rows - means[k][group[part]]) * weights[part]
            factors[k] = _triangular(np.concatenate([factors[k], centred.reshape(-1, rows.shape[-1])]))
    pairs = int(np.sum(counts * (counts - 1) // 2))
    return objective_from_factors(factors[0], factors[1], rotation_length_m, pairs)


class FactorStream:
    """Eq. (11) of shots that arrive in pieces: one pass, and memory that does not grow with the shots.

    Pieces of one placement are merged exactly: the factor of the union is that of both factors and one more row
    block, the difference of their means times √(n₁ n₂ / (n₁ + n₂)) (Chan, Golub, LeVeque 1983).
    """

    def __init__(self) -> None:
        self._placements: dict[int, tuple[int, tuple[Floats, Floats], tuple[Floats, Floats]]] = {}

    def add(self, Ts_outer: Floats, Ts_inner: Floats, placement: int) -> None:
        """Read ``(n, 4, 4)`` outer and inner poses of one placement and forget them."""
        both = _rows(Ts_outer, Ts_inner)
        means = tuple(rows.mean(axis=0) for rows in both)
        centred = tuple((r - m).reshape(-1, r.shape[-1]) for r, m in zip(both, means, strict=True))
        n = len(Ts_outer)
        if placement in self._placements:
            before, old_factors, old_means = self._placements[placement]
            weight = np.sqrt(before * n / (before + n))
            centred = tuple(
                np.concatenate([f, c, weight * (m - o)])
                for f, c, m, o in zip(old_factors, centred, means, old_means, strict=True)
            )
            means = tuple((before * o + n * m) / (before + n) for o, m in zip(old_means, means, strict=True))
            n += before
        factors = (_triangular(centred[0]), _triangular(centred[1]))
        self._placements[placement] = (n, factors, (means[0], means[1]))

    def objective(self, rotation_length_m: float = PAPER_ROTATION_LENGTH_M) -> Objective:
        """Eq. (11) of everything read so far."""
        parts = self._placements.values()
        translation = np.concatenate([np.zeros((0, 13)), *(np.sqrt(n) * factors[0] for n, factors, _ in parts)])
        rotation = np.concatenate([np.zeros((0, 9)), *(np.sqrt(n) * factors[1] for n, factors, _ in parts)])
        pairs = sum(n * (n - 1) // 2 for n, _, _ in parts)
        return objective_from_factors(translation, rotation, rotation_length_m, pairs)


def objective_from_factors(translation: Floats, rotation: Floats, rotation_length_m: float, pairs: int) -> Objective:
    """Objective of a 13-column translation factor and a 9-column rotation factor, weighed by ℓ."""
    stacked = np.zeros((len(translation) + len(rotation), 13))
    stacked[: len(translation)] = translation
    stacked[len(translation) :, 3:12] = rotation_length_m * rotation
    return Objective(_triangular(stacked), rotation_length_m, pairs)


def objective_values(objective: Objective, rotations: Floats, translations_m: Floats) -> Floats:
    """F of many candidates at once.

    Args:
        objective: Eq. (11).
        rotations: ``(..., 3, 3)`` rotations of the head.
        translations_m: ``(..., 3)`` translations of the head [m].

    Returns:
        ``(...)`` values [m²].
    """
    theta = np.concatenate([translations_m, _homogeneous(rotations)], axis=-1)
    return np.sum((theta @ objective.factor.T) ** 2, axis=-1)


def rotation_values(objective: Objective, rotations: Floats) -> Floats:
    """F of many rotations ``(..., 3, 3)``, each with its best translation [m²]."""
    return np.sum((_homogeneous(rotations) @ objective.rotation_factor.T) ** 2, axis=-1)


def best_translation(objective: Objective, rotation: Floats) -> Floats:
    """Head ``(4, 4)`` of a rotation ``(3, 3)`` with the translation that minimises F: the factor's first three rows.

    Directions of the translation that the data cannot see are left at zero.
    """
    U = objective.factor
    right = -U[:3, 3:] @ _homogeneous(rotation)
    t = np.linalg.lstsq(U[:3, :3], right, rcond=1e-12)[0]
    return transform(rotation, t)


def _rows(Ts_outer: Floats, Ts_inner: Floats) -> tuple[Floats, Floats]:
    """Rows of θ ``(n, 3, 13)`` for R_out (R t_in + t) + t_out, and of vec R ``(n, 9, 9)`` for R_out R R_in."""
    n = len(Ts_outer)
    R_out, R_in = Ts_outer[:, :3, :3], Ts_inner[:, :3, :3]
    translation = np.empty((n, 3, 13))
    translation[..., :3] = R_out
    translation[..., 3:12] = (R_out[..., None] * Ts_inner[:, None, None, :3, 3]).reshape(n, 3, 9)
    translation[..., 12] = Ts_outer[:, :3, 3]
    rotation = R_out[:, :, None, :, None] * np.swapaxes(R_in, 1, 2)[:, None, :, None, :]
    return translation, rotation.reshape(n, 9, 9)


def _chunks(shots: int) -> list[slice]:
    return [slice(start, start + CHUNK_SHOTS) for start in range(0, shots, CHUNK_SHOTS)]


def _triangular(rows: Floats) -> Floats:
    """Square triangular factor of tall rows: a QR of QRs, leaf by leaf, so that it stays in the processor's cache."""
    columns = rows.shape[1]
    while len(rows) > LEAF_ROWS:
        leaves = -(-len(rows) // LEAF_ROWS)
        padded = np.zeros((leaves * LEAF_ROWS, columns))
        padded[: len(rows)] = rows
        rows = _qr_factor(padded.reshape(leaves, LEAF_ROWS, columns)).reshape(-1, columns)
    R = _qr_factor(rows)
    return np.concatenate([R, np.zeros((columns - len(R), columns))]) if len(R) < columns else R


def _qr_factor(rows: Floats) -> Floats:
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)


def _homogeneous(rotations: Floats) -> Floats:
    flat = rotations.reshape(*rotations.shape[:-2], 9)
    return np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
