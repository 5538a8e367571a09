"""Where are the dark blobs in an image that may be discs seen askew?

The image is looked at from afar. A pixel is dark when it is well below the mean of a wide neighbourhood, measured in
the spread of grey there, so that neither uneven light nor a dim exposure matters. Of the connected dark parts those
stay that are as large as the ellipse with their second moments, whatever its tilt, and stand on bright ground.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.coarse import full_pixels, reduced_image
from sixthlink.target.target import GreyImage

__all__ = ["Blobs", "find_blobs"]

Bytes = npt.NDArray[np.uint8]
Bools = npt.NDArray[np.bool_]

SMALLEST_RADIUS_PX, LARGEST_RADIUS_PX = 1.9, 26.0
"""Radii between which blobs are looked for, in pixels of the reduced image."""

WINDOW_PX = 101
"""Neighbourhood of a pixel [pixel of the reduced image]: a blob of the largest radius fills a fifth of it."""

SPREADS_BELOW, LEAST_CONTRAST = 0.7, 0.04
"""A dark pixel is this many standard deviations of its neighbourhood below the mean, about half way between ink and
paper where discs cover an eighth to a third of the ground; and by this share of the image's own range of grey."""

LARGEST_HOLE = 0.1
"""Area of a bright spot that may be inside a blob, over that of the largest blob."""

MOST_UNLIKE_ELLIPSE = 0.12
"""Relative difference of a blob's area from that of the ellipse with its second moments."""

MOST_SLENDER = 6.0
"""Ratio of an ellipse's axes that no flat disc reaches before it is seen at 80°."""

GROUND_PX = 1.5
"""Distance from a blob's rim at which ground is expected [pixel of the reduced image]."""


@dataclass(frozen=True, eq=False)
class Blobs:
    """Dark blobs.

    Attributes:
        centres: ``(N, 2)`` centres of area [pixel].
        shapes: ``(N, 2, 2)`` symmetric E of (p - c)ᵀ E⁻¹ (p - c) = 1 on the rim of the ellipse with the blob's second
            moments: its eigenvalues are the squared semi-axes [pixel²].
        grain_px: Pixel of the reduced image in which they were found; they are right to about half of it [pixel].
    """

    centres: Floats
    shapes: Floats
    grain_px: float


def find_blobs(image: GreyImage, width_px: int) -> Blobs:
    """Dark blobs whose radius is between 1.9 and 26 pixels once the image is reduced.

    Args:
        image: ``(height, width)`` grey image; it is not modified.
        width_px: Width to which the image is reduced first; it is not enlarged.
    """
    import cv2

    reduced = reduced_image(image, width_px)
    low, high = np.percentile(reduced[::4, ::4], (1.0, 99.0))
    least = max(LEAST_CONTRAST * float(high - low), 1.0)
    dark = _without_holes(_dark(reduced, least))
    _, labels, stats, centroids = cv2.connectedComponentsWithStats(dark, connectivity=4, ltype=cv2.CV_32S)
    left, top, width, height, area = np.asarray(stats, dtype=np.float64).T
    kept = (left > 0) & (top > 0) & (left + width < dark.shape[1]) & (top + height < dark.shape[0])
    kept &= (area >= SMALLEST_RADIUS_PX**2) & (area <= np.pi * LARGEST_RADIUS_PX**2)  # the smallest, tilted by 70°
    kept[0] = False  # the ground
    centres = np.asarray(centroids, dtype=np.float64)[kept]
    shapes = _shapes(dark, np.asarray(labels), kept, centres)
    square = np.linalg.eigvalsh(shapes)
    good = np.abs(area[kept] / (np.pi * np.sqrt(square.prod(axis=1))) - 1.0) < MOST_UNLIKE_ELLIPSE
    good &= square[:, 1] < MOST_SLENDER**2 * square[:, 0]
    good[good] = _on_ground(reduced, centres[good], shapes[good], least)
    scale = np.array(image.shape[::-1]) / np.array(reduced.shape[::-1])
    places = full_pixels(centres[good], reduced, image)
    return Blobs(places, shapes[good] * np.outer(scale, scale), float(np.sqrt(scale.prod())))


def _dark(grey: Bytes, least: float) -> Bytes:
    """255 where a pixel is dark against its neighbourhood, else 0."""
    import cv2

    # The threshold changes slowly: mean and mean square of 4 x 4 pixels are enough to compute it from.
    height, width = grey.shape
    size = (max(1, width // 4), max(1, height // 4))
    square = cv2.multiply(grey, grey, dtype=cv2.CV_16U)
    grain = [cv2.resize(k, size, interpolation=cv2.INTER_AREA).astype(np.float32) for k in (grey, square)]
    mean, mean_square = (np.asarray(cv2.blur(k, (WINDOW_PX // 4, WINDOW_PX // 4)), dtype=np.float32) for k in grain)
    spread = np.sqrt(np.maximum(mean_square - mean * mean, 0.0))
    threshold = np.clip(np.rint(mean - np.maximum(SPREADS_BELOW * spread, least)), 0.0, 255.0).astype(np.uint8)
    return np.asarray(cv2.compare(grey, cv2.resize(threshold, (width, height)), cv2.CMP_LT), dtype=np.uint8)


def _without_holes(dark: Bytes) -> Bytes:
    """The dark parts with small bright spots inside them filled: some boards mark their dots so, some lamps shine."""
    import cv2

    _, labels, stats, _ = cv2.connectedComponentsWithStats(255 - dark, connectivity=8, ltype=cv2.CV_32S)
    left, top, width, height, area = np.asarray(stats).T
    hole = (left > 0) & (top > 0) & (left + width < dark.shape[1]) & (top + height < dark.shape[0])
    hole &= area <= LARGEST_HOLE * np.pi * LARGEST_RADIUS_PX**2
    hole[0] = False  # the dark parts themselves
    return np.where(hole[labels], np.uint8(255), dark)


def _shapes(dark: Bytes, labels: npt.NDArray[np.int32], kept: Bools, centres: Floats) -> Floats:
    """``(N, 2, 2)`` ellipses with the second moments of the kept blobs, each pixel counted as a unit square."""
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    at = np.flatnonzero(dark)
    blob = number[labels.ravel()[at]]
    at, blob = at[blob >= 0], blob[blob >= 0]
    v, u = np.divmod(at, dark.shape[1])
    du, dv = u - centres[blob, 0], v - centres[blob, 1]
    N = len(centres)
    area = np.bincount(blob, minlength=N)
    uu, uv, vv = (np.bincount(blob, weights=k, minlength=N) / area for k in (du * du, du * dv, dv * dv))
    return 4.0 * np.stack([np.stack([uu + 1 / 12, uv], axis=1), np.stack([uv, vv + 1 / 12], axis=1)], axis=1)


def _on_ground(grey: Bytes, centres: Floats, shapes: Floats, least: float) -> Bools:
    """Which blobs are darker than what is around them, in at least seven of eight directions."""
    turn = np.arange(16) * (np.pi / 8.0)
    rim = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ np.linalg.cholesky(shapes).swapaxes(1, 2)
    normal = np.linalg.solve(shapes, rim.swapaxes(1, 2)).swapaxes(1, 2)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    ring = centres[:, None] + rim + GROUND_PX * normal
    u, v = np.clip(np.rint(ring), 0, np.array(grey.shape)[::-1] - 1).astype(np.int64).transpose(2, 0, 1)
    ground = grey[v, u].astype(np.float64)
    u, v = np.rint(centres[:, None] + 0.6 * rim).astype(np.int64).transpose(2, 0, 1)
    inside = np.median(grey[v, u].astype(np.float64), axis=1)
    contrast = np.median(ground, axis=1) - inside
    bright = ground > (inside + 0.4 * contrast)[:, None]
    return np.asarray((contrast > least) & (bright.sum(axis=1) >= 14))
