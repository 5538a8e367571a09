"""What are the rows of eq. (11), and how do they become a triangular factor?

A shot's target pose has three rows for its position, affine in θ = (t, vec R, 1), and nine for its orientation, linear
in vec R. Centred on the mean of their placement and weighed by the square root of its shots, they make eq. (11); an
orthogonal triangularisation keeps every digit of them. This is the direct route: every row is written out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sixthlink.geometry import Floats, Ints

__all__ = ["CHUNK_SHOTS", "Grouping", "Segments", "grouping", "mean_rows", "row_factors", "segments", "triangular"]

CHUNK_SHOTS = 1024
"""Shots read at a time: they bound the memory, stay in the processor's cache, and are too few for threads to pay."""

COLUMNS = 3 * 13 + 9 * 9
"""Numbers in the rows of one shot."""

LEAF_ROWS = 512
"""Rows of one leaf of the QR of QRs: small enough for the cache, large enough to be worth a call."""


@dataclass(frozen=True, eq=False)
class Grouping:
    """The shots in the order of their placements.

    Attributes:
        order: ``(N,)`` shots, placement by placement, or None when they stand so already.
        firsts: ``(P,)`` where each placement begins in that order.
        counts: ``(P,)`` shots of each placement.
    """

    order: Ints | None
    firsts: Ints
    counts: Ints

    @property
    def shots(self) -> int:
        """Number of shots."""
        return int(self.firsts[-1] + self.counts[-1])

    def taken(self, poses: Floats, first: int, last: int) -> Floats:
        """Upper three rows ``(n, 3, 4)`` of the poses from ``first`` to ``last`` in that order."""
        chosen = poses[first:last] if self.order is None else poses.take(self.order[first:last], axis=0)
        return chosen[:, :3]


@dataclass(frozen=True, eq=False)
class Segments:
    """A chunk of the shots, cut where the placement changes.

    Attributes:
        first: First shot of the chunk in the order of placements.
        last: One past its last shot.
        placements: The placements that it touches.
        starts: ``(S,)`` where each begins within the chunk.
        lengths: ``(S,)`` shots of each within the chunk.
        continued: Whether the first of them began in an earlier chunk.
        goes_on: Whether the last of them goes on in the next chunk.
    """

    first: int
    last: int
    placements: slice
    starts: Ints
    lengths: Ints
    continued: bool
    goes_on: bool


def grouping(placements: Ints) -> Grouping:
    """Placements ``(N,)`` in order; a recording that is in order already is not sorted again."""
    order = None
    if (placements[1:] < placements[:-1]).any():
        # Sixteen bits are sorted by counting, which is linear.
        order = np.argsort(placements.astype(np.uint16) if placements.max() < 2**16 else placements, kind="stable")
        placements = placements[order]
    firsts = np.concatenate([[0], 1 + np.flatnonzero(placements[1:] != placements[:-1])])
    return Grouping(order, firsts, np.diff(firsts, append=len(placements)))


def segments(groups: Grouping) -> Iterator[Segments]:
    """All shots, chunk by chunk."""
    shots, firsts = groups.shots, groups.firsts
    for first in range(0, shots, CHUNK_SHOTS):
        last = min(first + CHUNK_SHOTS, shots)
        low, high = (int(v) for v in np.searchsorted(firsts, [first + 1, last]))
        starts = np.maximum(firsts[low - 1 : high] - first, 0)
        lengths = np.diff(starts, append=last - first)
        ends = int(firsts[high - 1] + groups.counts[high - 1])
        yield Segments(first, last, slice(low - 1, high), starts, lengths, firsts[low - 1] < first, ends > last)


def row_factors(Ts_outer: Floats, Ts_inner: Floats, groups: Grouping) -> tuple[Floats, Floats]:
    """Centred rows ``(m, 13)`` and ``(m, 9)``, each times √n of its placement; of many shots the triangular factor."""
    if groups.shots <= CHUNK_SHOTS:
        table = _table(*(groups.taken(Ts, 0, groups.shots) for Ts in (Ts_outer, Ts_inner)))
        sums = np.add.reduceat(table, groups.firsts, axis=0)
        return _centred(table, sums / groups.counts[:, None], groups.counts, groups.counts)
    sums = np.zeros((len(groups.counts), COLUMNS))
    for cut, table in _tables(Ts_outer, Ts_inner, groups):
        sums[cut.placements] += np.add.reduceat(table, cut.starts, axis=0)
    means = sums / groups.counts[:, None]
    translation, rotation = np.zeros((0, 13)), np.zeros((0, 9))
    for cut, table in _tables(Ts_outer, Ts_inner, groups):
        new = _centred(table, means[cut.placements], groups.counts[cut.placements], cut.lengths)
        translation = triangular(np.concatenate([translation, new[0]]))
        rotation = triangular(np.concatenate([rotation, new[1]]))
    return translation, rotation


def mean_rows(Ts_outer: Floats, Ts_inner: Floats) -> tuple[Floats, Floats]:
    """Means ``(3, 13)`` and ``(9, 9)`` of the rows of shots of one placement, without writing the rows out."""
    n = len(Ts_outer)
    turns = Ts_outer[:, :3, :3].reshape(n, 9).T
    entries = (turns @ Ts_inner[:, :3].reshape(n, 12) / n).reshape(3, 3, 3, 4)
    translation = np.empty((3, 13))
    translation[:, :3] = turns.mean(axis=1).reshape(3, 3)
    translation[:, 3:12] = entries[..., 3].reshape(3, 9)
    translation[:, 12] = Ts_outer[:, :3, 3].mean(axis=0)
    return translation, entries[..., :3].transpose(0, 3, 1, 2).reshape(9, 9)


def triangular(rows: Floats) -> Floats:
    """Square triangular factor of tall rows: a QR of QRs, leaf by leaf, so that it stays in the processor's cache."""
    columns = rows.shape[1]
    while len(rows) > 2 * LEAF_ROWS:
        leaves = -(-len(rows) // LEAF_ROWS)
        padded = np.zeros((leaves * LEAF_ROWS, columns))
        padded[: len(rows)] = rows
        rows = _qr_factor(padded.reshape(leaves, LEAF_ROWS, columns)).reshape(-1, columns)
    R = _qr_factor(rows)
    return np.concatenate([R, np.zeros((columns - len(R), columns))]) if len(R) < columns else R


def _tables(Ts_outer: Floats, Ts_inner: Floats, groups: Grouping) -> Iterator[tuple[Segments, Floats]]:
    for cut in segments(groups):
        yield cut, _table(*(groups.taken(Ts, cut.first, cut.last) for Ts in (Ts_outer, Ts_inner)))


def _table(Ts_outer: Floats, Ts_inner: Floats) -> Floats:
    """Rows ``(n, 120)``: 3 x 13 of θ for R_out (R t_in + t) + t_out, then 9 x 9 of vec R for R_out R R_in."""
    n = len(Ts_outer)
    table = np.empty((n, COLUMNS))
    translation, rotation = table[:, :39].reshape(n, 3, 13), table[:, 39:].reshape(n, 3, 3, 3, 3)
    R_out, R_in = Ts_outer[:, :, :3], Ts_inner[:, :, :3]
    translation[..., :3] = R_out
    translation[..., 3:12] = (R_out[..., None] * Ts_inner[:, None, None, :, 3]).reshape(n, 3, 9)
    translation[..., 12] = Ts_outer[:, :, 3]
    np.multiply(R_out[:, :, None, :, None], np.swapaxes(R_in, 1, 2)[:, None, :, None, :], out=rotation)
    return table


def _centred(table: Floats, means: Floats, counts: Ints, lengths: Ints) -> tuple[Floats, Floats]:
    """Rows minus the mean of their placement, times √n of it."""
    table -= means.repeat(lengths, axis=0)
    table *= np.sqrt(counts).repeat(lengths)[:, None]
    return table[:, :39].reshape(-1, 13), table[:, 39:].reshape(-1, 9)


def _qr_factor(rows: Floats) -> Floats:
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)
