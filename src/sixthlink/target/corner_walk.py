"""Which corners of a chessboard does an image show where only a part of the board is in it?

Every corner is a saddle of the grey values, and the saddle says along which two lines its edges run and on which side
they are bright; its neighbours lie on those lines and have the bright sides exchanged. So a walk from saddle to saddle,
each step as the one before it, collects the corners of one board with their columns and rows.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.coarse import full_pixels, reduced_image
from sixthlink.target.target import GreyImage

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

__all__ = ["walk_corners"]

SADDLE_SIGMA_PX = 1.5
"""Smoothing of the saddle search, in pixels of the reduced image."""

CANDIDATES, LEAST_STRENGTH = 1500, 0.02
"""Strongest saddles that are looked at, and how weak they may be against the strongest ones."""

STEPS = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
"""Ways to go on the grid, as column and row."""

SEEDS, ENOUGH = 12, 60
"""Saddles from which a walk starts at most, and corners with which it ends the search."""

CONE = 0.25
"""How far beside an edge's line the first neighbours may be, as a share of their distance."""

MOST_OFF = 0.3
"""How far a corner may be from where the last step leads, in steps."""

MOST_PARALLEL = 0.7
"""Cosine between the bright directions of neighbours: they should be across each other."""

LEAST_CONTRAST = 0.4
"""Difference of the bright and the dark squares around a corner, against the grid's usual one."""


@dataclass(frozen=True, eq=False)
class _Saddles:
    """Saddles of an image, strongest first.

    Attributes:
        places: ``(N, 2)`` where they are [pixel].
        edges: ``(N, 2, 2)`` unit vectors along their two edges.
        bright: ``(N, 2)`` unit vectors into their bright sides.
    """

    places: Floats
    edges: Floats
    bright: Floats


def walk_corners(image: GreyImage, width_px: int) -> Floats | None:
    """Corners ``(R, C, 2)`` of the largest part of a chessboard, right-handed, NaN where there is none [pixel].

    Args:
        image: ``(height, width)`` grey image.
        width_px: Width to which it is reduced for the search; the corners are right to about a pixel of that.
    """
    from scipy.spatial import cKDTree

    reduced = reduced_image(image, width_px)
    saddles = _saddles(reduced)
    if len(saddles.places) < 9:
        return None
    tree = cKDTree(saddles.places)
    best: dict[tuple[int, int], int] = {}
    walked: set[int] = set()
    starts = 0
    for seed in range(len(saddles.places)):
        if starts >= SEEDS or len(best) >= ENOUGH:
            break
        cross = None if seed in walked else _cross(saddles, tree, seed)
        if cross is not None:
            starts += 1
            cells = _walk(saddles, tree, cross)
            walked.update(cells.values())
            best = max(best, cells, key=len)
    if len(best) < 9:
        return None
    grid = _grid(saddles, best)
    grid[~_alternate(reduced, grid)] = np.nan
    return full_pixels(grid, reduced, image).reshape(grid.shape)


def _saddles(grey: npt.NDArray[np.uint8]) -> _Saddles:
    """The strongest saddles of an image."""
    import cv2

    smooth = np.asarray(cv2.GaussianBlur(grey.astype(np.float32), (0, 0), SADDLE_SIGMA_PX), dtype=np.float32)
    xx, yy, xy = (cv2.Sobel(smooth, cv2.CV_32F, dx, dy) for dx, dy in ((2, 0), (0, 2), (1, 1)))
    strength = np.asarray(xy * xy - xx * yy, dtype=np.float32)
    highest = np.asarray(cv2.dilate(strength, np.ones((5, 5), np.uint8)))
    v, u = np.nonzero((strength >= highest) & (strength > 0.0))
    order = np.argsort(-strength[v, u], kind="stable")[:CANDIDATES]
    v, u = v[order], u[order]
    usual = float(np.median(strength[v, u][:20])) if len(v) else 0.0
    v, u = (k[strength[v, u] > LEAST_STRENGTH * usual] for k in (v, u))
    curvature = np.stack([xx[v, u], xy[v, u], xy[v, u], yy[v, u]], axis=1).reshape(-1, 2, 2).astype(np.float64)
    values, vectors = np.linalg.eigh(curvature)
    # Along the edges the second derivative is nought.
    part = np.arctan2(np.sqrt(np.maximum(values[:, 1], 0.0)), np.sqrt(np.maximum(-values[:, 0], 0.0)))
    dark, bright = vectors[:, :, 0], vectors[:, :, 1]
    along, across = np.cos(part)[:, None] * bright, np.sin(part)[:, None] * dark
    return _Saddles(np.stack([u, v], axis=1).astype(np.float64), np.stack([along + across, along - across], 1), bright)


def _cross(saddles: _Saddles, tree: cKDTree, seed: int) -> dict[tuple[int, int], int] | None:
    """A saddle and its four neighbours by column and row, or None where it is not in the middle of four."""
    first, second = saddles.edges[seed]
    if first[0] * second[1] < first[1] * second[0]:
        second = -second
    near = np.asarray(tree.query(saddles.places[seed], min(16, len(saddles.places)))[1])[1:]
    offsets = saddles.places[near] - saddles.places[seed]
    across = np.abs(saddles.bright[near] @ saddles.bright[seed]) < MOST_PARALLEL
    cells, lengths = {(0, 0): seed}, []
    for step, way in zip(STEPS.tolist(), (first, second, -first, -second), strict=True):
        along = offsets @ way
        beside = np.linalg.norm(offsets - along[:, None] * way, axis=1)
        fits = np.flatnonzero(across & (along > 0.0) & (beside < CONE * along))
        if not len(fits):
            return None
        cells[step[0], step[1]] = int(near[fits[0]])
        lengths.append(along[fits[0]])
    uneven = max(lengths[0] / lengths[2], lengths[2] / lengths[0], lengths[1] / lengths[3], lengths[3] / lengths[1])
    return cells if uneven < 2.0 and len(set(cells.values())) == 5 else None


def _walk(saddles: _Saddles, tree: cKDTree, cross: dict[tuple[int, int], int]) -> dict[tuple[int, int], int]:
    """The saddles that steps from a cross lead to, by column and row."""
    cells = dict(cross)
    used, waiting = set(cells.values()), deque(cells)
    while waiting:
        here = waiting.popleft()
        for step in STEPS.tolist():
            there = (here[0] + step[0], here[1] + step[1])
            guess = None if there in cells else _guess(saddles.places, cells, here, step)
            if guess is None:
                continue
            reach = MOST_OFF * float(np.linalg.norm(guess - saddles.places[cells[here]]))
            bright = saddles.bright[cells[here]]
            for far, k in zip(*tree.query(guess, 3, distance_upper_bound=reach), strict=True):
                if np.isfinite(far) and k not in used and abs(saddles.bright[k] @ bright) < MOST_PARALLEL:
                    cells[there] = int(k)
                    used.add(int(k))
                    waiting.append(there)
                    break
    return cells


def _guess(places: Floats, cells: dict[tuple[int, int], int], here: tuple[int, int], step: list[int]) -> Floats | None:
    """Where a step from a cell leads, by the step before it and by those beside it; None where there are none."""
    i, j = here
    di, dj = step
    ways = [((i - di, j - dj), here)]
    ways += [((i + li, j + lj), (i + li + di, j + lj + dj)) for li, lj in ((dj, di), (-dj, -di))]
    taken = [places[cells[b]] - places[cells[a]] for a, b in ways if a in cells and b in cells]
    return places[cells[here]] + np.mean(taken, axis=0) if taken else None


def _grid(saddles: _Saddles, cells: dict[tuple[int, int], int]) -> Floats:
    """The places ``(R, C, 2)`` of the cells, NaN where there is none."""
    at = np.array(list(cells))
    low, high = at.min(axis=0), at.max(axis=0)
    grid = np.full((high[1] - low[1] + 1, high[0] - low[0] + 1, 2), np.nan)
    grid[at[:, 1] - low[1], at[:, 0] - low[0]] = saddles.places[list(cells.values())]
    return grid


def _alternate(grey: npt.NDArray[np.uint8], grid: Floats) -> npt.NDArray[np.bool_]:
    """Whether bright and dark squares meet at each corner ``(R, C)`` as they must on one board."""
    import warnings

    from scipy.ndimage import map_coordinates

    padded = np.pad(grid, ((1, 1), (1, 1), (0, 0)), constant_values=np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a corner without neighbours has no step
        across = np.nanmean([padded[1:-1, 2:] - grid, grid - padded[1:-1, :-2]], axis=0)
        down = np.nanmean([padded[2:, 1:-1] - grid, grid - padded[:-2, 1:-1]], axis=0)
    row, column = np.indices(grid.shape[:2])
    turn = np.where((row + column) % 2 == 0, 1.0, -1.0)[..., None]
    places = np.stack([grid + 0.3 * (a * across + b * down) for a, b in ((1, 1), (-1, -1), (1, -1), (-1, 1))], axis=2)
    known = np.isfinite(places).all(axis=(2, 3))
    at = np.where(known[..., None, None], places, 0.0)
    seen = map_coordinates(grey, [at[..., 1], at[..., 0]], order=1, output=np.float64, mode="nearest")
    one, other = turn * seen[..., :2], turn * seen[..., 2:]
    contrast = one.mean(axis=-1) - other.mean(axis=-1)
    usual = float(np.median(contrast[known])) if known.any() else 0.0
    sign = np.sign(usual)
    gap = np.where(sign > 0, one.min(axis=-1) - other.max(axis=-1), other.min(axis=-1) - one.max(axis=-1))
    return np.asarray(
        known & (sign * contrast > LEAST_CONTRAST * abs(usual)) & (gap > 0.5 * LEAST_CONTRAST * abs(usual))
    )
