"""Where is the end mark of the length standard, a disc of alternating black and white quarters?

Its centre is a saddle of the grey values at every scale below the disc's size. So the image is searched at a few
scales for strong saddles, and each candidate has to show what only the mark shows: on growing circles around it two
bright and two dark quarters, facing each other. The largest such circle tells the size of the disc. The search goes
from small images to large ones, and ends where a larger one could only show what is too small to be a rival.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.coarse import full_pixels, reduced_image
from sixthlink.target.saddle import LARGEST_HALF_WINDOW_PX, SMALLEST_HALF_WINDOW_PX, refine_saddles, rough_saddles
from sixthlink.target.target import Found, GreyImage, NotFound

__all__ = ["find_quadrant_mark"]

WIDEST_SEARCH_PX, NARROWEST_SEARCH_PX = 1300, 150
"""Image widths between which the search halves its scale."""

SADDLE_SIGMA_PX = 2.0
"""Smoothing of the saddle search, in pixels of the reduced image."""

CANDIDATES = 40
"""Strongest saddles that are looked at on each scale."""

ANGLES = 72
"""Samples on a circle."""

RADII_PX = np.geomspace(4.0, 60.0, 20)
"""Radii of the circles, in pixels of the reduced image."""

SMALLEST_RADIUS_PX = 7.0
"""A mark below this radius, in pixels of the full image, is not trusted."""

LEAST_CONTRAST = 0.06
"""Bright minus dark quarters, in the image's own range of grey."""

MOST_UNEVEN = 0.15
"""Mean departure from two plain levels of grey along a circle, as a share of their difference."""

RIVAL_SHARE = 0.4
"""A second candidate with more than this share of the best one's weight makes the answer ambiguous."""

SURELY_SEEN_PX = 8.0
"""Marks of this radius are found in a reduced image [pixel of it]: three circles and the smoothing have room."""

CENTRE_WINDOW_PX = 4.0
"""Half window that centres a candidate [pixel of the reduced image]; half a pixel aside spoils small circles."""


@dataclass(frozen=True)
class _Candidate:
    """A place that looks like the mark: centre and radius in pixels of the full image, contrast from 0 to 1."""

    u: float
    v: float
    radius_px: float
    contrast: float

    @property
    def weight(self) -> float:
        """How much speaks for it: printed black and white at size, against chance shades of grey."""
        return self.radius_px * self.contrast


def find_quadrant_mark(image: GreyImage) -> Found | NotFound:
    """The single quadrant mark in one image, refined; its point index is 0.

    Args:
        image: ``(height, width)`` grey image that shows one end of the length standard.

    Returns:
        One point, or why there is none: no mark, a mark too small or cut by the image's edge, or two places that
        look equally like one (both are named).
    """
    candidates: list[_Candidate] = []
    for reduced in _reduced(image):
        candidates = _distinct([*candidates, *_candidates(image, reduced)])
        if candidates and RIVAL_SHARE * candidates[0].radius_px >= SURELY_SEEN_PX * image.shape[1] / reduced.shape[1]:
            break
    if not candidates:
        return NotFound(
            "no quadrant mark found: expected one disc of alternating black and white quarters, sharp and whole"
        )
    best = candidates[0]
    if len(candidates) > 1 and candidates[1].weight > RIVAL_SHARE * best.weight:
        rival = candidates[1]
        return NotFound(
            f"two places look like the quadrant mark, ({best.u:.0f}, {best.v:.0f}) and "
            f"({rival.u:.0f}, {rival.v:.0f}); leave one mark in view"
        )
    if best.radius_px < SMALLEST_RADIUS_PX:
        return NotFound(
            f"the quadrant mark at ({best.u:.0f}, {best.v:.0f}) is {2 * best.radius_px:.0f} pixel wide, expected "
            f"at least {2 * SMALLEST_RADIUS_PX:.0f}"
        )
    window = float(np.clip(0.6 * best.radius_px, SMALLEST_HALF_WINDOW_PX, 1.5 * LARGEST_HALF_WINDOW_PX))
    refined = refine_saddles(image, [[best.u, best.v]], window, 0.3 * best.radius_px)
    if not refined.good[0]:
        return NotFound(f"the quadrant mark at ({best.u:.0f}, {best.v:.0f}) is blurred or cut by the image's edge")
    return Found(np.zeros(1, dtype=np.int64), refined.pixels, refined.sigmas_px)


def _reduced(image: GreyImage) -> list[npt.NDArray[np.uint8]]:
    """The image at the scales of the search, the smallest first."""
    images = [reduced_image(image, WIDEST_SEARCH_PX)]
    while images[-1].shape[1] // 2 >= NARROWEST_SEARCH_PX:
        images.append(reduced_image(images[-1], images[-1].shape[1] // 2))
    return images[::-1]


def _candidates(image: GreyImage, reduced: npt.NDArray[np.uint8]) -> list[_Candidate]:
    """Saddles on one scale that carry the pattern of the mark."""
    import cv2

    grey = np.asarray(cv2.GaussianBlur(reduced.astype(np.float32), (0, 0), SADDLE_SIGMA_PX), dtype=np.float32)
    xx, yy = cv2.Sobel(grey, cv2.CV_32F, 2, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 2)
    xy = cv2.Sobel(grey, cv2.CV_32F, 1, 1)
    strength = np.asarray(xy * xy - xx * yy, dtype=np.float32)
    highest = np.asarray(cv2.dilate(strength, np.ones((7, 7), np.uint8)))
    v, u = np.nonzero((strength >= highest) & (strength > 0.0))
    order = np.argsort(-strength[v, u], kind="stable")[:CANDIDATES]
    peaks = np.stack([u[order], v[order]], axis=1).astype(np.float64)
    centres, good = rough_saddles(reduced, peaks, CENTRE_WINDOW_PX, CENTRE_WINDOW_PX)
    centres = centres[good]
    radii, contrasts = _pattern(reduced, centres)
    scale = image.shape[1] / reduced.shape[1]
    places = full_pixels(centres, reduced, image)
    return [
        _Candidate(float(place[0]), float(place[1]), float(radius * scale), float(contrast))
        for place, radius, contrast in zip(places, radii, contrasts, strict=True)
        if radius > 0.0
    ]


def _pattern(grey: npt.NDArray[np.uint8], centres: Floats) -> tuple[Floats, Floats]:
    """Size and contrast of the pattern around each centre, both 0 where fewer than three circles show it.

    Returns:
        ``(N,)`` radius of the largest of an unbroken run of circles that show the pattern [pixel]; ``(N,)`` mean
        difference of bright and dark on these circles, as a share of the image's own range of grey.
    """
    from scipy.ndimage import map_coordinates

    angle = np.arange(ANGLES) * (2.0 * np.pi / ANGLES)
    offsets = RADII_PX[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    at = centres[:, None, None, :] + offsets
    rings = map_coordinates(grey.astype(np.float32), [at[..., 1], at[..., 0]], order=1, mode="nearest")
    inside = ((at >= 0.0) & (at <= np.array(grey.shape)[::-1] - 1)).all(axis=(-1, -2))
    low, high = np.percentile(grey[::2, ::2], (1.0, 99.0))
    shown, contrasts = _shows_quarters(rings.astype(np.float64) / float(max(high - low, 1.0)))
    run = np.cumprod(inside & shown, axis=1)
    unbroken = run.sum(axis=1)
    enough = unbroken >= 3
    contrast = np.sum(run * contrasts, axis=1) / np.maximum(unbroken, 1)
    return np.where(enough, RADII_PX[np.maximum(unbroken, 1) - 1], 0.0), np.where(enough, contrast, 0.0)


def _shows_quarters(rings: Floats) -> tuple[npt.NDArray[np.bool_], Floats]:
    """Which circles ``(..., A)`` show two bright and two dark arcs, even in grey, facing each other, a quarter each.

    The second answer is the difference of bright and dark on each circle.
    """
    top, bottom = np.percentile(rings, (85.0, 15.0), axis=-1)
    middle = 0.5 * (top + bottom)[..., None]
    signs = np.where(rings > middle, 1.0, -1.0)
    even = np.abs((rings - middle) * signs - 0.5 * (top - bottom)[..., None]).mean(axis=-1)
    changes = (signs != np.roll(signs, 1, axis=-1)).sum(axis=-1)
    facing = (signs * np.roll(signs, ANGLES // 2, axis=-1)).mean(axis=-1)
    beside = (signs * np.roll(signs, ANGLES // 4, axis=-1)).mean(axis=-1)
    quarters = (changes == 4) & (facing > 0.7) & (beside < -0.3)
    contrast = np.asarray(top - bottom)
    return np.asarray(quarters & (contrast > LEAST_CONTRAST) & (even < MOST_UNEVEN * contrast)), contrast


def _distinct(candidates: list[_Candidate]) -> list[_Candidate]:
    """One candidate per place, the weightiest first."""
    kept: list[_Candidate] = []
    for c in sorted(candidates, key=lambda c: -c.weight):
        if all(np.hypot(c.u - k.u, c.v - k.v) > 0.5 * k.radius_px for k in kept):
            kept.append(c)
    return kept
