"""How are many small groups of unknowns eliminated, so that a few shared ones remain?

Rows of a linear least-squares problem touch the shared unknowns and the own unknowns of at most one block (a target's
placement, the sockets of one place). One orthogonal factorisation per block removes its own unknowns; what is left of
all blocks is one small triangular factor over the shared unknowns. The work is linear in the rows, and triangular
factors are kept, never normal matrices: the condition number is not squared, and the rank can be read off.

Source: square-root information filtering, Bierman, "Factorization Methods for Discrete Sequential Estimation" (1977).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as sla

from sixthlink.geometry import Floats, Ints

__all__ = ["Equations", "Reduced", "covariance_of_own", "own_steps", "reduced", "triangle"]


@dataclass(frozen=True, eq=False)
class Equations:
    """Whitened rows ``residual + shared @ x + own @ y[block]``, to be made small.

    Attributes:
        residuals: ``(M,)`` residuals [-].
        shared: ``(M, G)`` derivative by the shared unknowns.
        own: ``(M, L)`` derivative by the own unknowns of the row's block; L may be 0.
        blocks: ``(M,)`` block of each row, 0 to B - 1, each present.
    """

    residuals: Floats
    shared: Floats
    own: Floats
    blocks: Ints

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(self.residuals @ self.residuals)


@dataclass(frozen=True, eq=False)
class Reduced:
    """What is left of one or more sets of equations.

    Attributes:
        shared: ``(G + 1, G + 1)`` triangular factor of the shared unknowns and the residual: the last column is the
            right side, the last entry what no shared unknown can explain.
        own: Per set of equations ``(B, L, L + G + 1)``: the rows that give each block's own unknowns back.
    """

    shared: Floats
    own: tuple[Floats, ...]

    @property
    def factor(self) -> Floats:
        """``(G, G)`` triangular factor R of the information RᵀR of the shared unknowns."""
        return self.shared[:-1, :-1]

    @property
    def unexplained(self) -> float:
        """Sum of squares that no step of any unknown removes."""
        return float(self.shared[-1, -1] ** 2)

    @property
    def right(self) -> Floats:
        """``(G,)`` right side: the best shared step solves ``factor @ step = -right``."""
        return self.shared[:-1, -1]


def reduced(sets: Sequence[Sequence[Equations]], prior: Floats | None = None) -> Reduced:
    """Eliminate the own unknowns of every block of every set; one that no row touches stays where it is.

    Args:
        sets: Sets of equations over the same shared unknowns; the parts of a set share their blocks too.
        prior: ``(K, G + 1)`` further rows on the shared unknowns, the residual last.
    """
    pool: list[Floats] = [] if prior is None else [prior]
    own: list[Floats] = []
    for parts in sets:
        L = parts[0].own.shape[1]
        rows = np.concatenate([np.column_stack([p.own, p.shared, p.residuals]) for p in parts])
        if L == 0:
            pool.append(triangle(rows))
            own.append(np.zeros((0, 0, rows.shape[1])))
            continue
        blocks = np.concatenate([p.blocks for p in parts])
        order = np.argsort(blocks, kind="stable")
        starts = np.searchsorted(blocks[order], np.arange(int(blocks.max()) + 2))
        kept = []
        for a, b in pairwise(starts):
            R = triangle(_regular(rows[order[a:b]], L))
            kept.append(R[:L])
            pool.append(R[L:, L:])
        own.append(np.stack(kept))
    return Reduced(triangle(np.concatenate(pool)), tuple(own))


def _regular(rows: Floats, L: int) -> Floats:
    """The rows of a block; an own unknown that none of them touches gets one that keeps it where it is."""
    silent = np.flatnonzero(~rows[:, :L].any(axis=0))
    return np.concatenate([rows, np.eye(rows.shape[1])[silent]]) if len(silent) else rows


def own_steps(factors: Floats, shared_step: Floats) -> Floats:
    """Own steps ``(B, L)`` of every block, given the shared step ``(G,)``."""
    L = factors.shape[1]
    right = factors[:, :, -1] + factors[:, :, L:-1] @ shared_step
    return np.asarray(-np.linalg.solve(factors[:, :, :L], right[:, :, None])[:, :, 0], dtype=np.float64)


def covariance_of_own(factors: Floats, shared_covariance: Floats) -> tuple[Floats, Floats]:
    """Covariance ``(B, L, L)`` of every block's own unknowns, and ``(B, L, G)`` with the shared ones."""
    L = factors.shape[1]
    inverse = np.linalg.inv(factors[:, :, :L])
    carried = -inverse @ factors[:, :, L:-1]
    crossed = carried @ shared_covariance
    return inverse @ np.swapaxes(inverse, 1, 2) + crossed @ np.swapaxes(carried, 1, 2), crossed


def triangle(rows: Floats) -> Floats:
    """Square upper triangular factor of rows, padded with zeros where there are fewer rows than columns."""
    columns = rows.shape[1]
    R = np.asarray(sla.qr(rows, mode="r", check_finite=False)[0][:columns], dtype=np.float64)
    return np.concatenate([R, np.zeros((columns - len(R), columns))]) if len(R) < columns else R
