"""Which of the dark blobs in an image stand in one square grid, and how can a pattern be laid over it?

Each ellipse undoes its own foreshortening: where it is a unit circle, the four neighbours on the grid are equally far
and at right angles. A blob with four such neighbours starts a walk that predicts each next place from known places
next to it, so that perspective and lens may bend the grid, and strays and gaps do not stop it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints
from sixthlink.target.blobs import Blobs

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

__all__ = ["readings_of", "step_sizes", "walk_grids"]

Bools = npt.NDArray[np.bool_]

NEAREST, TRIED_STEPS = 14, 3
"""Blobs around a blob among which its four neighbours are looked for, and how many of the nearest may be the first."""

MOST_OFF = 0.35
"""How far from its predicted place a neighbour may be, in steps of the grid."""

MOST_GROWTH = 5.0
"""Ratio of areas of neighbours, one of which may be larger to mark the origin."""

DIRECTIONS = np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])
"""Steps on the grid by row and column."""

FEWEST_BLOBS, WALKS = 6, 12
"""Blobs of the smallest grid, and blobs from which a walk is started at most."""


def walk_grids(blobs: Blobs, longest: int) -> Iterator[tuple[Ints, Ints]]:
    """Square grids among the blobs, those with the clearest beginning first.

    Args:
        blobs: Dark blobs.
        longest: Steps from one end of the grid to the other, at most.

    Yields:
        ``(M, 2)`` column and row of each blob that stands in the grid, counted from anywhere, columns then rows turning
        as x, then y does in the image; and ``(M,)`` which blob it is.
    """
    from scipy.spatial import cKDTree

    if len(blobs.centres) < FEWEST_BLOBS:
        return
    tree, walked = cKDTree(blobs.centres), set[int]()
    crosses = _crosses(blobs, tree)
    for _ in range(WALKS):
        fresh = [k for k, middle in enumerate(crosses[:, 0].tolist()) if middle not in walked]
        if not fresh:
            return
        cells = _walk(blobs, tree, crosses[fresh[0]], longest)
        row, column = np.nonzero(cells >= 0)
        walked.update(cells[row, column].tolist())
        yield np.stack([column, row], axis=1), cells[row, column]


def _crosses(blobs: Blobs, tree: cKDTree) -> Ints:
    """``(C, 5)`` blobs that stand in the middle of four neighbours on a grid, those of the clearest cross first."""
    centres, W = blobs.centres, np.linalg.inv(np.linalg.cholesky(blobs.shapes))
    near = np.asarray(tree.query(centres, min(NEAREST + 1, len(centres)))[1])[:, 1:]
    apart = (centres[near] - centres[:, None]) @ W.swapaxes(1, 2)
    nearest = np.argsort(np.linalg.norm(apart, axis=-1), axis=1)
    every = np.arange(len(centres))
    offs, picks = [], []
    for k in range(TRIED_STEPS):
        step = apart[every, nearest[:, k]]
        beside = step[:, ::-1] * np.array([-1.0, 1.0])
        ends = np.stack([step, beside, -step, -beside], axis=1)
        off = np.linalg.norm(apart[:, None] - ends[:, :, None], axis=-1)
        picks.append(np.take_along_axis(near, off.argmin(axis=2), axis=1))
        offs.append(off.min(axis=2).max(axis=1) / np.linalg.norm(step, axis=1))
    best = np.argmin(offs, axis=0)
    off = np.stack(offs)[best, every]
    crosses = np.column_stack([every, np.stack(picks)[best, every]])
    return crosses[np.argsort(off, kind="stable")[: np.count_nonzero(off < MOST_OFF)]]


def _walk(blobs: Blobs, tree: cKDTree, cross: Ints, longest: int) -> Ints:
    """``(S, S)`` blob in each cell of the grid around one cross, or -1."""
    side = 2 * longest + 5
    m = side // 2
    cells = np.full((side, side), -1, dtype=np.int64)
    cells[[m, m, m + 1, m, m - 1], [m, m + 1, m, m - 1, m]] = cross
    while True:
        filled = cells >= 0
        beside = np.zeros_like(filled)
        for step in DIRECTIONS:
            beside |= np.roll(filled, step, axis=(0, 1))
        row, column = (k + 2 for k in np.nonzero((beside & ~filled)[2:-2, 2:-2]))
        known, blob = _next(blobs, tree, cells, row, column)
        if not len(known):
            return cells
        cells[row[known], column[known]] = blob


def _next(blobs: Blobs, tree: cKDTree, cells: Ints, row: Ints, column: Ints) -> tuple[Ints, Ints]:
    """Which of the empty cells have a blob where the cells around predict it, and which blob that is."""
    centres = np.vstack([blobs.centres, [np.nan, np.nan]])  # cell -1 is nowhere
    guesses, sources = [], []
    for dr, dc in DIRECTIONS:
        source = cells[row - dr, column - dc]
        guesses.append(2.0 * centres[source] - centres[cells[row - 2 * dr, column - 2 * dc]])
        sources.append(source)
        for fr, fc in ((dc, dr), (-dc, -dr)):
            along = centres[cells[row + fr, column + fc]] - centres[cells[row - dr + fr, column - dc + fc]]
            guesses.append(centres[source] + along)
            sources.append(source)
    known = ~np.isnan(np.stack(guesses)[..., 0])
    some = np.flatnonzero(known.any(axis=0))
    known, source = known[:, some], np.stack(sources)[known.argmax(axis=0), np.arange(len(row))][some]
    place = np.where(known[..., None], np.stack(guesses)[:, some], 0.0).sum(axis=0) / known.sum(axis=0)[:, None]
    if not len(some):
        return some, some
    near = np.asarray(tree.query(place, 4)[1])
    W = np.linalg.inv(np.linalg.cholesky(blobs.shapes[source])).swapaxes(1, 2)
    off = np.linalg.norm((centres[near] - place[:, None]) @ W, axis=-1)
    off /= np.linalg.norm((place - centres[source])[:, None] @ W, axis=-1)
    growth = np.log(np.linalg.det(blobs.shapes[near]) / np.linalg.det(blobs.shapes[source])[:, None])
    off[np.isin(near, cells) | (np.abs(growth) > 2.0 * np.log(MOST_GROWTH))] = np.inf
    cell, pick = np.nonzero(off <= np.minimum(off.min(axis=1), MOST_OFF)[:, None])
    order = np.argsort(off[cell, pick], kind="stable")
    # A blob that two cells ask for goes to the nearer one.
    blob, first = np.unique(near[cell, pick][order], return_index=True)
    return some[cell[order][first]], blob


def readings_of(places: Ints, pattern: Ints) -> tuple[Ints, Bools]:
    """All ways to lay a pattern over dots so that one box holds the other, along the columns as along the rows.

    Args:
        places: ``(M, 2)`` column and row of each dot, counted from anywhere.
        pattern: ``(P, 2)`` column and row of each point of the pattern.

    Returns:
        ``(R, P)`` dot at each point or -1, of the pattern in its four quarter turns, then mirrored in four more;
        ``(R,)`` whether it is mirrored.
    """
    if not len(places):
        return np.zeros((0, len(pattern)), dtype=np.int64), np.zeros(0, dtype=np.bool_)
    low, box = places.min(axis=0), np.ptp(places, axis=0)
    P = np.ptp(pattern, axis=0).max()
    table = np.full(box + 1 + 2 * P, -1, dtype=np.int64)
    table[tuple((places - low + P).T)] = np.arange(len(places))
    readings, mirrored = [], []
    for turn in range(8):
        turned = pattern * np.array([1 if turn < 4 else -1, 1])
        for _ in range(turn % 4):
            turned = turned[:, ::-1] * np.array([-1, 1])
        turned = turned - turned.min(axis=0)
        spare = box - turned.max(axis=0)
        ranges = [np.arange(min(k, 0), max(k, 0) + 1) for k in spare]
        shifts = np.stack(np.meshgrid(*ranges), axis=-1).reshape(-1, 2)
        readings.append(table[tuple(np.moveaxis(shifts[:, None] + turned + P, -1, 0))])
        mirrored.append(np.full(len(shifts), turn >= 4))
    return np.concatenate(readings), np.concatenate(mirrored)


def step_sizes(places: Ints, pixels: Floats) -> Floats:
    """``(M,)`` root of the area of the grid's cells at each dot [pixel].

    The homography H from places to pixels magnifies areas by |det H| / w³, w being the third coordinate it gives.
    """
    (x, y), (u, v) = (((k - k.mean(axis=0)) / k.std()).T for k in (places, pixels))
    p = np.stack([x, y, np.ones_like(x)], axis=1)
    none = np.zeros_like(p)
    equations = np.block([[p, none, -u[:, None] * p], [none, p, -v[:, None] * p]])
    H = np.linalg.svd(equations, full_matrices=False)[2][-1].reshape(3, 3)
    w = np.abs(p @ H[2])
    return np.sqrt(np.abs(np.linalg.det(H)) / w**3) * (pixels.std() / places.std())
