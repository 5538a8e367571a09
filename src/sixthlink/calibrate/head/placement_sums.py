"""How are sums over shots taken placement by placement, and least squares made small?"""

from __future__ import annotations

import numpy as np

from sixthlink.geometry import Floats, Ints

__all__ = ["centred", "means", "triangular", "without_nuisance"]


def means(values: Floats, placements: Ints) -> Floats:
    """Mean ``(P, ...)`` of values ``(N, ...)`` over each placement, numbered 0 to P - 1 without gaps."""
    counts = np.bincount(placements)
    sums = np.zeros((len(counts), *values.shape[1:]))
    np.add.at(sums, placements, values)
    return sums / counts.reshape(-1, *[1] * (values.ndim - 1))


def centred(values: Floats, placements: Ints) -> Floats:
    """Values ``(N, ...)`` minus their mean over the shots of the same placement."""
    return values - means(values, placements)[placements]


def triangular(rows: Floats) -> Floats:
    """Triangular factor of tall rows: the same least squares in as many rows as columns."""
    factor: Floats = np.asarray(np.linalg.qr(rows, mode="r"))
    return factor


def without_nuisance(rows: Floats, placements: Ints, columns: int) -> Floats:
    """Rows ``(m, k)`` on what all placements share, after the best value of what each has for itself.

    Args:
        rows: ``(N, r, columns + k)`` rows of each shot; the first columns belong to unknowns of its placement.
        placements: ``(N,)`` placement of each shot, numbered without gaps.
        columns: Number of those columns.
    """
    width = rows.shape[-1]
    parts = [
        triangular(rows[placements == p].reshape(-1, width))[columns:, columns:]
        for p in range(int(placements.max()) + 1)
    ]
    return np.concatenate(parts)
