"""How do grey values change around some points of an image, and how noisy are they there?"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["REACH", "Singles", "smooth_gradients", "smoothed"]

Singles = npt.NDArray[np.float32]

DERIVATIVE_SIGMA_PX = 1.0
"""Smoothing before differences are taken: halves the influence of noise in flat areas."""

REACH = 4
"""Pixels to which that smoothing reaches; it ends there."""

SECOND_DIFFERENCES = (1.0, -2.0, 1.0)

FLAT = 0.15
"""Share of a window's steepest gradient below which it is flat: there its noise is read, dark and bright alike."""

LIKE_OTHERS = 60.0
"""Flat pixels, dark or bright, that a window needs to say as much of its noise as all windows together say of it."""


def smooth_gradients(
    image: GreyImage, centres: npt.NDArray[np.int64], n: int
) -> tuple[Singles, Singles, Singles, Floats]:
    """The slightly smoothed image in windows, its gradients along u and along v, and its noise.

    Args:
        image: The image.
        centres: ``(N, 2)`` middles of the windows [pixel].
        n: Pixels from a middle to the side of its window.

    Returns:
        Grey values and gradients ``(N, 2 n + 1, 2 n + 1)``, and the variance ``(N, 2)`` of the image's grey values
        where they are dark and where they are bright.
    """
    import cv2

    size, margin = 2 * (n + 1 + REACH) + 1, REACH + 1
    # One patch above the other is one tall image; what its filters mix across patches lies in the margins.
    tall = _patches(image, centres, n + margin).reshape(-1, size)
    smooth = smoothed(tall)
    along, down = (cv2.Sobel(smooth, cv2.CV_32F, dx, 1 - dx, ksize=1, scale=0.5) for dx in (1, 0))
    second = np.outer(SECOND_DIFFERENCES, SECOND_DIFFERENCES).astype(np.float32)
    rough = cv2.filter2D(tall, cv2.CV_32F, second)
    inner = slice(margin, size - margin)
    grey, gx, gy, rough = (
        np.ascontiguousarray(np.asarray(k, dtype=np.float32).reshape(-1, size, size)[:, inner, inner])
        for k in (smooth, along, down, rough)
    )
    return grey, gx, gy, _noise(rough, grey, gx * gx + gy * gy)


def _patches(image: GreyImage, centres: npt.NDArray[np.int64], reach: int) -> Singles:
    """Windows ``(N, 2 r + 1, 2 r + 1)`` of an image that goes on as it ends."""
    import cv2

    height, width = image.shape
    low, high = centres.min(axis=0) - reach, centres.max(axis=0) + reach
    over = int(max(-low.min(), (high - [width - 1, height - 1]).max(), 0))
    if over:
        image = cv2.copyMakeBorder(image, over, over, over, over, cv2.BORDER_REPLICATE)  # type: ignore[assignment]
    windows = np.lib.stride_tricks.sliding_window_view(image, (2 * reach + 1, 2 * reach + 1))
    u, v = (centres + over - reach).T
    return windows[v, u].astype(np.float32)


def smoothed(tall: Singles) -> Singles:
    """Patches one above the other, smoothed; what is within ``REACH`` of a border has seen something else."""
    import cv2

    kernel = 2 * REACH + 1
    smooth = cv2.GaussianBlur(tall, (kernel, kernel), DERIVATIVE_SIGMA_PX, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(smooth, dtype=np.float32)


def _noise(rough: Singles, grey: Singles, steepness: Singles) -> Floats:
    """Variance ``(N, 2)`` of dark and of bright grey values, from second differences where the window is flat.

    The mask [1 -2 1]ᵀ [1 -2 1] has no answer to shades that change evenly, and 36 times the variance to noise
    (Immerkær 1996). Rounding to whole grey values is noise too.

    Args:
        rough: ``(N, s, s)`` answer of the mask.
        grey: Smoothed grey values.
        steepness: Their squared gradients.
    """
    squares, grey, steepness = (k.reshape(len(k), -1) for k in (rough * rough, grey, steepness))
    flat = steepness <= np.float32(FLAT**2) * steepness.max(axis=1, keepdims=True)
    bright = grey > grey.mean(axis=1, keepdims=True)
    sides = flat & ~bright, flat & bright
    power = np.stack([np.einsum("np,np->n", squares, side) for side in sides], axis=1).astype(np.float64)
    count = np.stack([np.count_nonzero(side, axis=1) for side in sides], axis=1)
    usual = (power.sum(axis=0) + power.sum() / count.sum().clip(1.0)) / (count.sum(axis=0) + 1.0)
    return np.maximum((power + LIKE_OTHERS * usual) / (count + LIKE_OTHERS) / 36.0, 1.0 / 12.0)
