"""Where exactly do four squares meet, and how surely?

Every grey-level gradient near the meeting point stands across an edge that runs through it. The point is therefore
where the lines along all edges meet, each weighted by its squared gradient (Förstner and Gülch 1987):

    A q = b,   A = Σ w g gᵀ,   b = Σ w g gᵀ p

The gradients stay on the pixel grid and only the weights follow the estimate, so nothing is interpolated. What uneven
light does to the point is taken off (:mod:`sixthlink.target.uneven_light`). To first order noise moves the point, with
r = p - q, by

    δq = K⁻¹ (Σ w (g rᵀ + gᵀr) δg - 2 G Σ w r I δI)

Gradients are differences of the smoothed image: their noise is the image's, seen through the same filters, and how
large that is shows where the window is flat, dark and bright.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.gradients import REACH, Singles, smooth_gradients, smoothed
from sixthlink.target.target import GreyImage
from sixthlink.target.uneven_light import Light, uneven_light

__all__ = ["LARGEST_HALF_WINDOW_PX", "SMALLEST_HALF_WINDOW_PX", "Saddles", "refine_saddles", "rough_saddles"]

SMALLEST_HALF_WINDOW_PX, LARGEST_HALF_WINDOW_PX = 5.0, 20.0
"""Below five pixels the lens blur fills the window; beyond twenty the gain no longer pays for bent edges and time."""

SAMPLING_PX, SAMPLING_PX2 = 0.001, 0.03
"""What pixels of finite size leave even without noise, and what small windows add to it, over the half window: fitted
to the error on rendered boards of several sizes, tilts and blurs."""

MOST_SHIFT_PX = 0.2
"""Light that shifts a point farther than this is none: something else is in the window. The point stays where its edges
meet, and is as uncertain as that."""

WORKED_OUT = 16
"""Windows of an image in which the noise is followed through the filters."""


@dataclass(frozen=True, eq=False)
class Saddles:
    """Refined points.

    Attributes:
        pixels: ``(N, 2)`` where they are; the first estimate where they cannot be trusted [pixel].
        sigmas_px: ``(N,)`` standard deviation of each coordinate, by the image's own noise [pixel].
        good: ``(N,)`` whether each can be trusted: its window lies inside the image, two edges cross in it and the
            point stayed within reach.
    """

    pixels: Floats
    sigmas_px: Floats
    good: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Windows:
    """Smoothed grey values and their gradients ``(N, 2n + 1, 2n + 1)``, and the points ``(N, 2)`` from the middles."""

    grey: Singles
    gx: Singles
    gy: Singles
    q: Floats
    half_px: float


def refine_saddles(image: GreyImage, pixels: npt.ArrayLike, half_window_px: float, reach_px: float) -> Saddles:
    """Saddle points near the given pixels, refined to hundredths of a pixel.

    Args:
        image: ``(height, width)`` grey image; it is not modified.
        pixels: ``(N, 2)`` first estimates [pixel].
        half_window_px: Half the width of the window whose gradients count [pixel]. It should end before the
            neighbouring corners' edges begin (:mod:`sixthlink.target.rooms`).
        reach_px: A point that moves farther than this from its first estimate was drawn to something else [pixel].
    """
    centres, good, settled = _settled(image, pixels, half_window_px, reach_px)
    sigmas = np.full(len(centres), _sampling_px(half_window_px))
    for rows, windows, noise in settled:
        light = uneven_light(windows.grey, windows.gx, windows.gy, windows.q, half_window_px)
        far = np.linalg.norm(light.shifts, axis=1)
        believed = good[rows] & (far <= MOST_SHIFT_PX)
        centres[rows[believed]] += light.shifts[believed]
        sigmas[rows] = np.hypot(_sigmas(windows, light, noise), np.where(far <= MOST_SHIFT_PX, 0.0, far))
    return Saddles(centres, sigmas, good)


def rough_saddles(
    image: GreyImage, pixels: npt.ArrayLike, half_window_px: float, reach_px: float
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """The same to tenths of a pixel, whatever the light: ``pixels`` and ``good`` of :class:`Saddles`."""
    centres, good, _ = _settled(image, pixels, half_window_px, reach_px)
    return centres, good


def _settled(
    image: GreyImage, pixels: npt.ArrayLike, half_window_px: float, reach_px: float
) -> tuple[Floats, npt.NDArray[np.bool_], list[tuple[npt.NDArray[np.int64], _Windows, Floats]]]:
    """Where the edges meet, which points can be trusted, and of which rows these are the windows and their noise."""
    start = np.array(pixels, dtype=np.float64).reshape(-1, 2)
    n = int(np.ceil(half_window_px))
    height, width = image.shape
    centres = np.rint(start).astype(np.int64)
    refined, good = start.copy(), np.zeros(len(start), dtype=bool)
    active = _window_inside(centres, n, width, height)
    settled = []
    for _ in range(3):  # once is enough unless the first estimate was more than a pixel off
        rows = np.flatnonzero(active)
        if not len(rows):
            break
        grey, gx, gy, noise = smooth_gradients(image, centres[rows], n)
        offsets, crossing = _solve(gx, gy, refined[rows] - centres[rows], half_window_px)
        found = centres[rows] + offsets
        near = crossing & (np.linalg.norm(found - start[rows], axis=1) <= reach_px)
        refined[rows[near]], good[rows] = found[near], near
        moved = np.abs(offsets).max(axis=1) > 1.0
        last = near & ~moved
        if last.any():
            windows = _Windows(grey[last], gx[last], gy[last], offsets[last], half_window_px)
            settled.append((rows[last], windows, noise[last]))
        centres[rows[near]] = np.rint(found[near]).astype(np.int64)
        active = np.zeros_like(active)
        active[rows[near & moved]] = True
        inside = _window_inside(centres, n, width, height)
        good &= inside
        active &= inside
    refined[~good] = start[~good]
    return refined, good, settled


def _window_inside(centres: npt.NDArray[np.int64], n: int, width: int, height: int) -> npt.NDArray[np.bool_]:
    margin = n + 1
    low = (centres >= margin).all(axis=1)
    return np.asarray(low & (centres[:, 0] < width - margin) & (centres[:, 1] < height - margin))


def _solve(gx: Singles, gy: Singles, start: Floats, half_window_px: float) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Offsets ``(N, 2)`` of the saddles from the window centres [pixel], and whether two edges cross there."""
    n = gx.shape[1] // 2
    axis = np.arange(-n, n + 1, dtype=np.float32)
    gxx, gxy, gyy = gx * gx, gx * gy, gy * gy
    bx = gxx * axis + gxy * axis[:, None]
    by = gxy * axis + gyy * axis[:, None]
    moments = np.stack([gxx, gxy, gyy, bx, by], axis=1)
    q = start.copy()
    for _ in range(8):
        across, down = _window(q, n, half_window_px)
        rows = (moments @ across[:, None, :, None])[..., 0]
        a, b, d, e, f = (rows * down[:, None]).sum(axis=-1, dtype=np.float64).T
        determinant = a * d - b * b
        # The smaller eigenvalue against the larger one: near zero when all edges in the window are parallel.
        crossing = determinant > 0.02 * (a + d) ** 2
        safe = np.where(crossing, determinant, 1.0)
        step = np.stack([(d * e - b * f) / safe, (a * f - b * e) / safe], axis=1) - q
        q += np.where(crossing[:, None], np.clip(step, -n, n), 0.0)
        if np.abs(step[crossing]).max(initial=0.0) < 1e-4:
            break
    return q, crossing


def _window(q: Floats, n: int, half_window_px: float) -> tuple[Singles, Singles]:
    """Weights ``(N, 2n + 1)`` along u and along v about points ``(N, 2)``; the window's weight is their product.

    They end at nought: a window that cuts off an edge's blurred cross-section somewhere would pull the point sideways.
    """
    away = (np.arange(-n, n + 1) - q[:, :, None]) / half_window_px
    across, down = np.moveaxis(np.maximum(1.0 - away**2, 0.0).astype(np.float32), 1, 0)
    return across, down


def _sigmas(windows: _Windows, light: Light, noise: Floats) -> Floats:
    """Standard deviation ``(N,)`` of the points per coordinate, the mean of both [pixel].

    How the noise hangs together is alike in all windows of an image: it is worked out for some, and gives the factor
    on K⁻¹ A K⁻ᵀ for all.

    Args:
        windows: The windows.
        light: What uneven light does in them.
        noise: ``(N, 2)`` variance of the image's grey values where they are dark and where they are bright.
    """
    N = len(windows.q)
    inverse = np.asarray(np.linalg.pinv(light.K), dtype=np.float64)
    plain = _trace(inverse, light.A)
    some = np.unique(np.linspace(0, N - 1, min(N, WORKED_OUT)).round().astype(np.int64))
    exact = _trace(inverse[some], _variances(windows, some, light.G[some], noise[some]))
    factor = float(np.median(exact / np.maximum(plain[some], np.finfo(np.float64).tiny)))
    return np.hypot(np.sqrt(0.5 * factor * plain * noise.mean(axis=1)), _sampling_px(windows.half_px))


def _trace(inverse: Floats, inner: Floats) -> Floats:
    return np.asarray(np.trace(inverse @ inner @ np.swapaxes(inverse, 1, 2), axis1=1, axis2=2))


def _variances(windows: _Windows, some: npt.NDArray[np.int64], G: Floats, noise: Floats) -> Floats:
    """Variance ``(S, 2, 2)`` of the sums that make some points, over the mean variance of dark and bright pixels."""
    grey, gx, gy = windows.grey[some], windows.gx[some], windows.gy[some]
    n = gx.shape[1] // 2
    across, down = _window(windows.q[some], n, windows.half_px)
    w = down[:, :, None] * across[:, None, :]
    axis = np.arange(-n, n + 1, dtype=np.float32)
    q = windows.q[some].astype(np.float32)
    rx, ry = (axis - q[:, 0, None])[:, None, :], (axis - q[:, 1, None])[:, :, None]
    along = gx * rx + gy * ry
    # How each grey value of the image enters the sums: the filters of the gradients, the other way round.
    P, Q = (2.0 / windows.half_px) * w * grey * rx, (2.0 / windows.half_px) * w * grey * ry
    g = G.astype(np.float32)[:, :, :, None, None]
    u = _seen_through(w * (gx * rx + along), w * gx * ry, -g[:, 0, 0] * P - g[:, 0, 1] * Q)
    v = _seen_through(w * gy * rx, w * (gy * ry + along), -g[:, 1, 0] * P - g[:, 1, 1] * Q)
    # Counted photons make bright pixels noisier than dark ones.
    dark, bright = (noise / noise.mean(axis=1, keepdims=True)).astype(np.float32).T[:, :, None, None]
    low, high = (end(grey, axis=(1, 2), keepdims=True) for end in (np.min, np.max))
    own = dark + (bright - dark) * (grey - low) / np.maximum(high - low, np.float32(1e-6))
    margin = REACH + 1
    own = np.pad(own, ((0, 0), (margin, margin), (margin, margin)), mode="edge")
    return np.moveaxis(np.array([[_sum(x * y * own) for y in (u, v)] for x in (u, v)]), 2, 0)


def _sum(values: Singles) -> Floats:
    return np.sum(values, axis=(1, 2), dtype=np.float64)


def _sampling_px(half_window_px: float) -> float:
    return float(np.hypot(SAMPLING_PX, SAMPLING_PX2 / half_window_px))


def _seen_through(fx: Singles, fy: Singles, f: Singles) -> Singles:
    """Adjoint of smoothing and differences: weights of the image's pixels for those of its gradients and of itself."""
    N, size, _ = fx.shape
    inner, margin = slice(REACH + 1, REACH + 1 + size), REACH + 1
    wide = np.zeros((N, size + 2 * margin, size + 2 * margin), dtype=np.float32)
    wide[:, inner, inner] = f
    for step, weights, axis in ((1, fx, 2), (1, fy, 1)):
        for sign in (1, -1):
            shifted = [inner, inner]
            shifted[axis - 1] = slice(inner.start + sign * step, inner.stop + sign * step)
            wide[:, shifted[0], shifted[1]] += np.float32(0.5 * sign) * weights
    return smoothed(wide.reshape(-1, wide.shape[2])).reshape(wide.shape)
