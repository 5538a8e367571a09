"""What is eq. (11) once every shot has been read?

Every shot's target pose is affine in θ = (t, vec R, 1), and the sum over pairs is n times the sum of squares about
the placement's mean. The centred rows leave a 13×13 triangular factor U with

    F(R, t) = Σ_{i<j} |t_i - t_j|² + ℓ² |R_i - R_j|²  =  |U θ|²           (eq. 11; method: docs/theory/factor.md)

whatever the number of shots. ℓ is the length that turns a rotation entry into metres; the paper, counting in
millimetres, has ℓ = 1 mm. The plain normal matrix is never formed: squaring would lose the small residuals. Few shots
go row by row through a QR (rows.py), many through sums that keep the small direction apart (moments.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.moments import moment_factors
from sixthlink.calibrate.head.problem import HeadProblem
from sixthlink.calibrate.head.rows import CHUNK_SHOTS, Grouping, grouping, mean_rows, row_factors, triangular
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
    groups = grouping(problem.placements)
    translation, rotation = _factors(problem.Ts_outer, problem.Ts_inner, groups)
    pairs = int(np.sum(groups.counts * (groups.counts - 1) // 2))
    return objective_from_factors(translation, rotation, rotation_length_m, pairs)


_Piece = tuple[int, tuple[Floats, Floats], tuple[Floats, Floats]]
"""Shots, factors and mean rows of what has been read of one placement."""


class FactorStream:
    """Eq. (11) of shots that arrive in pieces: one pass, and memory that does not grow with the shots.

    Pieces of one placement are merged exactly: the factor of the union is that of both factors and one more row
    block, the difference of their means times √(n₁ n₂ / (n₁ + n₂)) (Chan, Golub, LeVeque 1983).
    """

    def __init__(self) -> None:
        self._placements: dict[int, _Piece] = {}

    def add(self, Ts_outer: Floats, Ts_inner: Floats, placement: int) -> None:
        """Read ``(n, 4, 4)`` outer and inner poses of one placement and forget them."""
        n = len(Ts_outer)
        if n == 0:
            return
        groups = Grouping(None, np.array([0]), np.array([n]))
        translation, rotation = _factors(Ts_outer, Ts_inner, groups)
        factors, means = (triangular(translation), triangular(rotation)), mean_rows(Ts_outer, Ts_inner)
        if placement in self._placements:
            factors, means = _merged(self._placements[placement], (n, factors, means))
            n += self._placements[placement][0]
        self._placements[placement] = (n, factors, means)

    def objective(self, rotation_length_m: float = PAPER_ROTATION_LENGTH_M) -> Objective:
        """Eq. (11) of everything read so far."""
        parts = self._placements.values()
        translation = np.concatenate([np.zeros((0, 13)), *(factors[0] for _, factors, _ in parts)])
        rotation = np.concatenate([np.zeros((0, 9)), *(factors[1] for _, factors, _ in parts)])
        pairs = sum(n * (n - 1) // 2 for n, _, _ in parts)
        return objective_from_factors(translation, rotation, rotation_length_m, pairs)


def objective_from_factors(translation: Floats, rotation: Floats, rotation_length_m: float, pairs: int) -> Objective:
    """Objective of a 13-column translation factor and a 9-column rotation factor, weighed by ℓ."""
    stacked = np.zeros((len(translation) + len(rotation), 13))
    stacked[: len(translation)] = translation
    stacked[len(translation) :, 3:12] = rotation_length_m * rotation
    return Objective(triangular(stacked), rotation_length_m, pairs)


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


def _factors(Ts_outer: Floats, Ts_inner: Floats, groups: Grouping) -> tuple[Floats, Floats]:
    """Centred rows, each times √n of its placement, or factors of them, by the quicker way that loses no digits."""
    quick = moment_factors(Ts_outer, Ts_inner, groups) if groups.shots > CHUNK_SHOTS else None
    return quick or row_factors(Ts_outer, Ts_inner, groups)


def _merged(one: _Piece, other: _Piece) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Factors and means of two pieces of one placement together."""
    (n, factors, means), (m, other_factors, other_means) = one, other
    # A factor carries √n of its own piece; together they carry √(n + m).
    mine, theirs, between = np.sqrt([(n + m) / n, (n + m) / m, n * m])
    both = [
        triangular(np.concatenate([mine * f, theirs * g, between * (b - a)]))
        for f, g, a, b in zip(factors, other_factors, means, other_means, strict=True)
    ]
    middle = [(n * a + m * b) / (n + m) for a, b in zip(means, other_means, strict=True)]
    return (both[0], both[1]), (middle[0], middle[1])


def _homogeneous(rotations: Floats) -> Floats:
    flat = rotations.reshape(*rotations.shape[:-2], 9)
    return np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
