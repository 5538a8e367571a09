"""Where exactly do four squares meet, and how surely?

Every grey-level gradient near the meeting point stands across an edge that runs through it. The point is therefore
where the lines along all edges meet, each weighted by its squared gradient (Förstner and Gülch 1987):

    A q = b,   A = Σ w g gᵀ,   b = Σ w g gᵀ p

The gradients stay on the pixel grid and only the weights follow the estimate, so nothing is interpolated. To first
order the gradients' noise moves the point, with r = p - q, by

    δq = A⁻¹ Σ w (g rᵀ + gᵀr) δg

Gradients are differences of the smoothed image: their noise is the image's, seen through the same filters, and how
large that is shows where the window is flat.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["LARGEST_HALF_WINDOW_PX", "SMALLEST_HALF_WINDOW_PX", "Saddles", "refine_saddles"]

SMALLEST_HALF_WINDOW_PX, LARGEST_HALF_WINDOW_PX = 3.0, 20.0
"""Below three pixels the lens blur fills the window; beyond twenty the gain no longer pays for bent edges and time."""

SAMPLING_PX, SAMPLING_PX2 = 0.0035, 0.11
"""What pixels of finite size leave even without noise, and what small windows add to it, over the half window: fitted
to the error on rendered boards of several sizes, tilts and blurs."""

DERIVATIVE_SIGMA_PX = 1.0
"""Smoothing before differences are taken: halves the influence of noise in flat areas."""

REACH = 4
"""Pixels to which that smoothing reaches; it ends there."""

FLAT = 0.15
"""Share of a window's steepest gradient below which it is flat: there its noise is read, dark and bright alike."""

WORKED_OUT = 16
"""Windows of an image in which the noise is followed through the filters."""

Singles = npt.NDArray[np.float32]


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


def refine_saddles(image: GreyImage, pixels: npt.ArrayLike, half_window_px: float, reach_px: float) -> Saddles:
    """Saddle points near the given pixels, refined to hundredths of a pixel.

    Args:
        image: ``(height, width)`` grey image; it is not modified.
        pixels: ``(N, 2)`` first estimates [pixel].
        half_window_px: Half the width of the window whose gradients count [pixel]. It should end before the
            neighbouring corners do, at about 0.4 of the smallest square.
        reach_px: A point that moves farther than this from its first estimate was drawn to something else [pixel].
    """
    start = np.array(pixels, dtype=np.float64).reshape(-1, 2)
    n = int(np.ceil(half_window_px))
    height, width = image.shape
    centres = np.rint(start).astype(np.int64)
    refined, good = start.copy(), np.zeros(len(start), dtype=bool)
    sigmas = np.full(len(start), _sampling_px(half_window_px))
    active = _window_inside(centres, n, width, height)
    for _ in range(3):  # once is enough unless the first estimate was more than a pixel off
        rows = np.flatnonzero(active)
        if not len(rows):
            break
        gx, gy, noise = _gradients(image, centres[rows], n)
        offsets, crossing = _solve(gx, gy, refined[rows] - centres[rows], half_window_px)
        found = centres[rows] + offsets
        near = crossing & (np.linalg.norm(found - start[rows], axis=1) <= reach_px)
        refined[rows[near]], good[rows] = found[near], near
        moved = np.abs(offsets).max(axis=1) > 1.0
        last = near & ~moved
        if last.any():
            sigmas[rows[last]] = _sigmas(gx[last], gy[last], offsets[last], noise[last], half_window_px)
        centres[rows[near]] = np.rint(found[near]).astype(np.int64)
        active = np.zeros_like(active)
        active[rows[near & moved]] = True
        inside = _window_inside(centres, n, width, height)
        good &= inside
        active &= inside
    refined[~good] = start[~good]
    return Saddles(refined, sigmas, good)


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
    """Weights ``(N, 2n + 1)`` along u and along v about points ``(N, 2)``; the window's weight is their product."""
    axis = np.arange(-n, n + 1)
    across, down = (np.exp(-2.0 * ((axis - q[:, k, None]) / half_window_px) ** 2).astype(np.float32) for k in (0, 1))
    return across, down


def _sigmas(gx: Singles, gy: Singles, q: Floats, noise: Floats, half_window_px: float) -> Floats:
    """Standard deviation ``(N,)`` of the points per coordinate, the mean of both [pixel].

    How the gradients' noise hangs together is alike in all windows of an image: it is worked out for some, and gives
    the factor on A⁻¹ for all.

    Args:
        gx: ``(N, 2n + 1, 2n + 1)`` gradients along u.
        gy: The same along v.
        q: ``(N, 2)`` the points, from the window's centre [pixel].
        noise: ``(N,)`` standard deviation of the image's grey values.
        half_window_px: As in :func:`refine_saddles`.
    """
    n, N = gx.shape[1] // 2, len(gx)
    axis = np.arange(-n, n + 1, dtype=np.float32)
    across, down = _window(q, n, half_window_px)
    w = down[:, :, None] * across[:, None, :]
    a, b, d = (_sum(w * g) for g in (gx * gx, gx * gy, gy * gy))
    plain = (a + d) / np.maximum(a * d - b * b, np.finfo(np.float64).tiny)
    some = np.unique(np.linspace(0, N - 1, min(N, WORKED_OUT)).round().astype(np.int64))
    rx = (axis - q[some, 0, None].astype(np.float32))[:, None, :]
    ry = (axis - q[some, 1, None].astype(np.float32))[:, :, None]
    exact = _traces(gx[some], gy[some], rx, ry, w[some], 4.0 / half_window_px**2)
    factor = float(np.median(exact / plain[some]))
    return np.hypot(noise * np.sqrt(0.5 * factor * plain), _sampling_px(half_window_px))


def _traces(gx: Singles, gy: Singles, rx: Singles, ry: Singles, w: Singles, pull: float) -> Floats:  # noqa: PLR0917
    """Trace ``(N,)`` of the points' covariances per variance of a grey value [pixel²]."""
    along = gx * rx + gy * ry
    # How Σ w g gᵀ r follows the point. The weights move with it and take their share; from noise they take all.
    moving = pull * w * along
    A = np.array([[_sum(w * g * h - moving * g * r) for h, r in ((gx, rx), (gy, ry))] for g in (gx, gy)])
    # How each grey value of the image enters the sum: the filters of the gradients, the other way round.
    u = _seen_through(w * (gx * rx + along), w * gx * ry)
    v = _seen_through(w * gy * rx, w * (gy * ry + along))
    U = np.array([[_sum(x * y) for y in (u, v)] for x in (u, v)])
    inverse = np.linalg.pinv(np.moveaxis(A, 2, 0))
    return np.trace(inverse @ np.moveaxis(U, 2, 0) @ np.swapaxes(inverse, 1, 2), axis1=1, axis2=2)


def _sum(values: Singles) -> Floats:
    return np.sum(values, axis=(1, 2), dtype=np.float64)


def _sampling_px(half_window_px: float) -> float:
    return float(np.hypot(SAMPLING_PX, SAMPLING_PX2 / half_window_px))


def _seen_through(fx: Singles, fy: Singles) -> Singles:
    """Adjoint of smoothing and differences: weights of the image's pixels for weights of its gradients."""
    N, size, _ = fx.shape
    wide = np.zeros((2, N, size + 2 * REACH + 2, size + 2 * REACH + 2), dtype=np.float32)
    inner = slice(REACH + 1, REACH + 1 + size)
    wide[0, :, inner, inner], wide[1, :, inner, inner] = fx, fy
    smooth = _smoothed(wide.reshape(2 * N, *wide.shape[2:])).reshape(wide.shape)
    seen = np.zeros_like(wide[0])
    seen[:, :, 1:-1] += 0.5 * (smooth[0, :, :, :-2] - smooth[0, :, :, 2:])
    seen[:, 1:-1, :] += 0.5 * (smooth[1, :, :-2, :] - smooth[1, :, 2:, :])
    return seen


def _gradients(image: GreyImage, centres: npt.NDArray[np.int64], n: int) -> tuple[Singles, Singles, Floats]:
    """Gradients ``(N, 2n+1, 2n+1)`` along u and v of the slightly smoothed image, and its noise in each window."""
    height, width = image.shape
    window = np.arange(-n - 1 - REACH, n + 2 + REACH)
    rows = np.clip(centres[:, 1, None] + window, 0, height - 1)
    columns = np.clip(centres[:, 0, None] + window, 0, width - 1)
    patches = image[rows[:, :, None], columns[:, None, :]].astype(np.float32)
    smooth = _smoothed(patches)[:, REACH:-REACH, REACH:-REACH]
    gx = 0.5 * (smooth[:, 1:-1, 2:] - smooth[:, 1:-1, :-2])
    gy = 0.5 * (smooth[:, 2:, 1:-1] - smooth[:, :-2, 1:-1])
    inner = patches[:, REACH:-REACH, REACH:-REACH]
    return gx, gy, _noise(inner, gx * gx + gy * gy)


def _smoothed(patches: Singles) -> Singles:
    """Patches ``(N, s, s)`` smoothed; what is within ``REACH`` of their border has seen their neighbours."""
    import cv2

    N, size, _ = patches.shape
    kernel = 2 * REACH + 1
    tall = np.ascontiguousarray(patches.reshape(N * size, size))
    smooth = cv2.GaussianBlur(tall, (kernel, kernel), DERIVATIVE_SIGMA_PX, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(smooth, dtype=np.float32).reshape(N, size, size)


def _noise(patches: Singles, steepness: Singles) -> Floats:
    """Standard deviation ``(N,)`` of the grey values, from second differences where the window is flat.

    The mask [1 -2 1]ᵀ [1 -2 1] has no answer to shades that change evenly, and 36 times the variance to noise
    (Immerkær 1996). Rounding to whole grey values is noise too.
    """
    along = patches[:, :, :-2] - 2.0 * patches[:, :, 1:-1] + patches[:, :, 2:]
    mask = along[:, :-2] - 2.0 * along[:, 1:-1] + along[:, 2:]
    N = len(patches)
    flat = steepness <= FLAT**2 * steepness.reshape(N, -1).max(axis=1)[:, None, None]
    power = np.sum(mask * mask * flat, axis=(1, 2), dtype=np.float64) / (36.0 * np.maximum(flat.sum(axis=(1, 2)), 1))
    return np.asarray(np.sqrt(np.maximum(power, 1.0 / 12.0)), dtype=np.float64)
