"""What does uneven light do to the point where four squares meet?

Opposite squares are alike, so that a window looks the same after half a turn about the point q, but for the light: it
is brighter on one side. That shifts the steepest part of blurred edges, by hundredths of a pixel where a lens darkens
towards the corners of the image. With light 1 + l·r at r = p - q the grey values I without it would be I (1 - l·r), the
same after half a turn: against odd weights their squares add up to nought,

    o = L l,   o = Σ w r I²,   L = 2 Σ w r rᵀ I²,

and their gradients would be g - (g (l·r) + I l), to first order. Such a change of gradients moves the point as noise
does, by (A - M)⁻¹ C l (:mod:`sixthlink.target.saddle`), and a moved point finds another light, o + D δq. Both at once:

    δq = -K⁻¹ C L⁻¹ o,   K = A - M + C L⁻¹ D

As evenness says where the middle is, too, this is also less sensitive to noise than the gradients alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.geometry import Floats
from sixthlink.target.gradients import Singles

__all__ = ["Light", "uneven_light"]


@dataclass(frozen=True, eq=False)
class Light:
    """Uneven light in windows.

    Attributes:
        shifts: ``(N, 2)`` what is to be added to the points [pixel].
        A: ``(N, 2, 2)`` weighted sum of the squared gradients.
        K: ``(N, 2, 2)`` how the sum that makes the points follows them.
        G: ``(N, 2, 2)`` C L⁻¹: how much of o enters that sum.
    """

    shifts: Floats
    A: Floats
    K: Floats
    G: Floats


def uneven_light(grey: Singles, gx: Singles, gy: Singles, q: Floats, half_window_px: float) -> Light:
    """How far points are off because of the light, and what that does to noise.

    Args:
        grey: ``(N, 2 n + 1, 2 n + 1)`` smoothed grey values of the windows.
        gx: Their gradients along u.
        gy: Their gradients along v.
        q: ``(N, 2)`` the points, from the window's middle [pixel].
        half_window_px: Where the weights 1 - (r / h)² along u and along v end [pixel].
    """
    n = grey.shape[1] // 2
    r = (np.arange(-n, n + 1) - q[:, :, None]) / half_window_px
    inside = np.abs(r) < 1.0
    w, slope = np.where(inside, 1.0 - r**2, 0.0), np.where(inside, 2.0 * r, 0.0)
    factors = np.stack([w, w * r, w * r**2, slope, slope * r], axis=3).astype(np.float32)
    across, down = factors[:, 0], np.swapaxes(factors[:, 1], 1, 2)
    # Sums s[i, j] over the window of factor i along v times factor j along u; lengths are in half windows.
    xx, xy, yy, square = (
        np.moveaxis(down @ (product @ across), 0, 2).astype(np.float64)
        for product in (gx * gx, gx * gy, gy * gy, grey * grey)
    )
    x, y = (np.moveaxis(down[:, :2] @ ((grey * g) @ across[:, :, :2]), 0, 2).astype(np.float64) for g in (gx, gy))
    L = 2.0 * _table(square[0, 2], square[1, 1], square[1, 1], square[2, 0])
    o = np.stack([square[0, 1], square[1, 0]], axis=1)
    D = _table(square[0, 4] - square[0, 0], square[3, 1], square[1, 3], square[4, 0] - square[0, 0]) / half_window_px
    A = _table(xx[0, 0], xy[0, 0], xy[0, 0], yy[0, 0])
    M = _table(xx[0, 4] + xy[1, 3], xx[3, 1] + xy[4, 0], xy[0, 4] + yy[1, 3], xy[3, 1] + yy[4, 0])
    dimmed = _table(xx[0, 2] + xy[1, 1], xx[1, 1] + xy[2, 0], xy[0, 2] + yy[1, 1], xy[1, 1] + yy[2, 0])
    added = _table(2.0 * x[0, 1] + y[1, 0], x[1, 0], y[0, 1], x[0, 1] + 2.0 * y[1, 0])
    G = (2.0 * half_window_px * dimmed + added) @ np.linalg.pinv(L)
    K = A - M + G @ D
    return Light(-(np.linalg.pinv(K) @ G @ o[:, :, None])[:, :, 0], A, K, G)


def _table(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Matrices ``(N, 2, 2)`` of their entries, row by row."""
    return np.stack([a, b, c, d], axis=1).reshape(-1, 2, 2)
