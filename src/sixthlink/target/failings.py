"""What is wrong with an image in which nothing was found?

A finder that fails knows what it looked for, not why it was not to be seen. The usual reasons show in the grey values
themselves: too much light, too little, no sharp edge; all that has edges is too small, or seen edge-on.
"""

from __future__ import annotations

import numpy as np

from sixthlink.target.clipping import NEARLY, largest_grey
from sixthlink.target.coarse import reduced_image
from sixthlink.target.target import GreyImage

__all__ = ["failing_of"]

WIDTH_PX = 640

SATURATED_SHARE = 0.25
"""Share of the image at the end of its range from which too much light is blamed."""

DARK = 0.06
"""Brightest grey values, as a share of the range, below which too little light is blamed."""

BLURRED_PX = 3.0
"""Width of the steepest edges, as the standard deviation of a Gaussian in pixels of the full image, that is blurred."""

WINDOW_PX, LEAST_BLUR_PX, LEAST_SLOPE = 31, 1.5, 0.5
"""Of the reduced image: window in which the height of an edge is seen, blur that can be told there, and slope of the
steepest edges [grey value per pixel] below which there are none."""

STEEP = 0.35
"""Slope, as a share of the steepest, that belongs to an edge of the target."""

OBLIQUE = 0.3
"""Width over length of all that has edges, against the target's own, below which it is seen too much from the side."""


def failing_of(image: GreyImage, paper_m: tuple[float, float], px_per_m: float) -> str:
    """The most likely reason in words, beginning with a semicolon; empty where the image looks sound.

    Args:
        image: ``(height, width)`` grey image.
        paper_m: Sides of the target with its margin [m].
        px_per_m: Pixels that a metre of it must have at least, for its details to be seen.
    """
    largest = largest_grey(image)
    saturated = float(np.mean(image >= NEARLY * largest))
    if saturated > SATURATED_SHARE:
        return f"; {saturated:.0%} of the image is over-exposed: less light or a shorter exposure"
    brightest = float(np.quantile(image[::4, ::4], 0.995))
    if brightest < DARK * largest:
        return (
            f"; the image is under-exposed, its brightest values are {brightest / largest:.1%} of the range: more light"
        )
    width, long, short = _edges_px(image)
    if width > BLURRED_PX:
        return f"; the image is blurred, its sharpest edges are {width:.1f} pixel wide: focus, or stand still"
    if 0.0 < short < OBLIQUE * min(paper_m) / max(paper_m) * long:
        return (
            f"; too oblique: all that has edges is {long:.0f} x {short:.0f} pixel large: look at the target more from "
            "the front"
        )
    needed = max(paper_m) * px_per_m
    if 0.0 < long < needed:
        return (
            f"; too small: all that has edges is {long:.0f} pixel large, the target needs {needed:.0f}: come closer, "
            "or take a larger one"
        )
    return ""


def _edges_px(image: GreyImage) -> tuple[float, float, float]:
    """Of the steepest edges [pixel]: their blur, and the longer and the shorter side of the area they fill.

    The blur is the standard deviation of a Gaussian: the edges' height over their slope. The sides are those of a
    rectangle with the same moments.
    """
    import cv2

    small = reduced_image(image, WIDTH_PX)
    factor = image.shape[1] // small.shape[1]
    grey = cv2.GaussianBlur(small.astype(np.float32), (0, 0), 1.0)
    gx, gy = cv2.Sobel(grey, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(grey, cv2.CV_32F, 0, 1, scale=0.125)
    slope = np.hypot(gx, gy)
    steepest = float(np.quantile(slope, 0.999))
    if steepest < LEAST_SLOPE:
        return 0.0, 0.0, 0.0
    around = np.ones((WINDOW_PX, WINDOW_PX), dtype=np.uint8)
    height = np.asarray(cv2.dilate(grey, around) - cv2.erode(grey, around))
    edges = slope > STEEP * steepest
    width = float(np.quantile(height[edges] / slope[edges], 0.1)) / np.sqrt(2.0 * np.pi)
    blur = float(np.sqrt(max(width**2 - 1.0, 0.0)))
    spread = np.linalg.eigvalsh(np.cov(np.argwhere(edges).T))
    short, long = factor * np.sqrt(12.0 * np.maximum(spread, 0.0))
    return factor * blur if blur > LEAST_BLUR_PX else 0.0, float(long), float(short)
