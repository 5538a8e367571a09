"""Where exactly do four squares meet?

Every grey-level gradient near the meeting point stands across an edge that runs through it. The point is therefore
where the lines along all edges meet, each weighted by its squared gradient (Förstner and Gülch 1987):

    (Σ w g gᵀ) q = Σ w g gᵀ p

The gradients stay on the pixel grid and only the weights follow the estimate, so nothing is interpolated.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["LARGEST_HALF_WINDOW_PX", "SIGMA_PX", "SMALLEST_HALF_WINDOW_PX", "refine_saddles"]

SMALLEST_HALF_WINDOW_PX, LARGEST_HALF_WINDOW_PX = 3.0, 20.0
"""Below three pixels the lens blur fills the window; beyond twenty the gain no longer pays for bent edges and time."""

SIGMA_PX = 0.05
"""Standard deviation that is stated for a refined corner: above the 0.01 to 0.03 pixel of clean rendered images,
because ink and light are not clean. Camera calibration replaces it by what the recording itself shows."""

DERIVATIVE_SIGMA_PX = 1.0
"""Smoothing before differences are taken: halves the influence of noise in flat areas."""


def refine_saddles(
    image: GreyImage, pixels: npt.ArrayLike, half_window_px: float, reach_px: float
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Saddle points near the given pixels, refined to hundredths of a pixel.

    Args:
        image: ``(height, width)`` grey image; it is not modified.
        pixels: ``(N, 2)`` first estimates [pixel].
        half_window_px: Half the width of the window whose gradients count [pixel]. It should end before the
            neighbouring corners do, at about 0.4 of the smallest square.
        reach_px: A point that moves farther than this from its first estimate was drawn to something else [pixel].

    Returns:
        ``(N, 2)`` refined pixels, and ``(N,)`` whether each can be trusted: its window lies inside the image, two
        edges cross in it and the point stayed within reach. Where false the pixel is the first estimate.
    """
    start = np.array(pixels, dtype=np.float64).reshape(-1, 2)
    n = int(np.ceil(half_window_px))
    height, width = image.shape
    centres = np.rint(start).astype(np.int64)
    refined, good = start.copy(), np.zeros(len(start), dtype=bool)
    active = _window_inside(centres, n, width, height)
    for _ in range(3):  # once is enough unless the first estimate was more than a pixel off
        rows = np.flatnonzero(active)
        if not len(rows):
            break
        offsets, crossing = _solve(image, centres[rows], refined[rows] - centres[rows], n, half_window_px)
        found = centres[rows] + offsets
        near = crossing & (np.linalg.norm(found - start[rows], axis=1) <= reach_px)
        refined[rows[near]], good[rows] = found[near], near
        moved = np.abs(offsets).max(axis=1) > 1.0
        centres[rows[near]] = np.rint(found[near]).astype(np.int64)
        again = near & moved
        active = np.zeros_like(active)
        active[rows[again]] = True
        inside = _window_inside(centres, n, width, height)
        good &= inside
        active &= inside
    refined[~good] = start[~good]
    return refined, good


def _window_inside(centres: npt.NDArray[np.int64], n: int, width: int, height: int) -> npt.NDArray[np.bool_]:
    margin = n + 1
    low = (centres >= margin).all(axis=1)
    return np.asarray(low & (centres[:, 0] < width - margin) & (centres[:, 1] < height - margin))


def _solve(
    image: GreyImage, centres: npt.NDArray[np.int64], start: Floats, n: int, half_window_px: float
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Offsets ``(N, 2)`` of the saddles from the window centres [pixel], and whether two edges cross there."""
    axis = np.arange(-n, n + 1, dtype=np.float32)
    gx, gy = _gradients(image, centres, n)
    gxx, gxy, gyy = gx * gx, gx * gy, gy * gy
    bx = gxx * axis + gxy * axis[:, None]
    by = gxy * axis + gyy * axis[:, None]
    moments = np.stack([gxx, gxy, gyy, bx, by], axis=1)
    q = start.copy()
    for _ in range(8):
        across, down = (
            np.exp(-2.0 * ((axis - q[:, k, None]) / half_window_px) ** 2).astype(np.float32) for k in (0, 1)
        )
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


def _gradients(
    image: GreyImage, centres: npt.NDArray[np.int64], n: int
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Gradients ``(N, 2n+1, 2n+1)`` along u and v around each centre, of the slightly smoothed image."""
    import cv2

    u0, v0 = np.maximum(centres.min(axis=0) - n - 5, 0)
    u1, v1 = centres.max(axis=0) + n + 6
    region = np.ascontiguousarray(image[v0:v1, u0:u1], dtype=np.float32)
    region = np.asarray(
        cv2.GaussianBlur(region, (0, 0), DERIVATIVE_SIGMA_PX, borderType=cv2.BORDER_REFLECT_101),
        dtype=np.float32,
    )
    window = np.arange(-n - 1, n + 2)
    rows = (centres[:, 1] - v0)[:, None] + window
    columns = (centres[:, 0] - u0)[:, None] + window
    patches = region[rows[:, :, None], columns[:, None, :]]
    gx = 0.5 * (patches[:, 1:-1, 2:] - patches[:, 1:-1, :-2])
    gy = 0.5 * (patches[:, 2:, 1:-1] - patches[:, :-2, 1:-1])
    return gx, gy
