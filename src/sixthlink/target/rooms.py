"""How large may an upright window about a corner of squares be before it shows anything but the corner's own edges?

Squares are seen as parallelograms with the sides a and b. The next line along a, one b away, enters a window of half
width h where h (|aₓ| + |aᵧ|) is more than |a × b|: a window stands upright, whatever the board does.
"""

from __future__ import annotations

import numpy as np

from sixthlink.geometry import Floats

__all__ = ["cell_sides", "marker_room_px", "square_room_px"]

MARKER_SIDE_POINTS = 9
"""Points of a marker's side at which its distance is taken."""


def cell_sides(grid: Floats) -> tuple[Floats, Floats]:
    """Sides ``(K, 2)`` along the columns and along the rows of those squares of a grid ``(R, C, 2)`` that are known."""
    a, b = np.diff(grid, axis=1)[:-1], np.diff(grid, axis=0)[:, :-1]
    known = np.isfinite(a).all(axis=2) & np.isfinite(b).all(axis=2)
    return a[known], b[known]


def square_room_px(a: Floats, b: Floats) -> float:
    """Half width of the smallest of the windows that just touch the next lines of squares with these sides [pixel]."""
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    widest = np.maximum(np.abs(a).sum(axis=1), np.abs(b).sum(axis=1))
    return float((area / widest).min(initial=np.inf))


def marker_room_px(a: Floats, b: Floats, gap: float) -> float:
    """The same for windows that just touch a marker in a square, ``gap`` squares from its sides [pixel]."""
    along = np.linspace(gap, 1.0 - gap, MARKER_SIDE_POINTS)
    x, y = np.r_[along, np.full_like(along, gap)], np.r_[np.full_like(along, gap), along]
    rooms = [
        np.abs(x[:, None] * a[:, None] + turn * y[:, None] * b[:, None]).max(axis=2).min(axis=1) for turn in (1.0, -1.0)
    ]
    return float(np.min(rooms, initial=np.inf))
