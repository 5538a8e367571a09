"""What is wrong with an image in which nothing was found?

A finder that fails knows what it looked for, not why it was not to be seen. The usual reasons show in the grey values
themselves: too much light, too little, no sharp edge, the picture taken through a mirror.
"""

from __future__ import annotations

import numpy as np

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


def failing_of(image: GreyImage) -> str:
    """The most likely reason in words, beginning with a semicolon; empty where the image looks sound."""
    largest = float(np.iinfo(image.dtype).max)
    if image.dtype == np.uint16 and image.max(initial=0) < 4096:
        largest = 4095.0 if image.max(initial=0) >= 1024 else 1023.0  # 10 and 12 bits kept in 16
    saturated = float(np.mean(image >= largest))
    if saturated > SATURATED_SHARE:
        return f"; {saturated:.0%} of the image is over-exposed: less light or a shorter exposure"
    brightest = float(np.quantile(image[::4, ::4], 0.995))
    if brightest < DARK * largest:
        return (
            f"; the image is under-exposed, its brightest values are {brightest / largest:.1%} of the range: more light"
        )
    width = _edge_width_px(image)
    if width > BLURRED_PX:
        return f"; the image is blurred, its sharpest edges are {width:.1f} pixel wide: focus, or stand still"
    return ""


def _edge_width_px(image: GreyImage) -> float:
    """Standard deviation of the steepest edges [pixel]: their height over their slope, by the Gaussian's shape."""
    import cv2

    small = reduced_image(image, WIDTH_PX)
    factor = image.shape[1] // small.shape[1]
    grey = cv2.GaussianBlur(small.astype(np.float32), (0, 0), 1.0)
    gx, gy = cv2.Sobel(grey, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(grey, cv2.CV_32F, 0, 1, scale=0.125)
    steepest = float(np.quantile(np.hypot(gx, gy), 0.999))
    height = float(np.quantile(grey, 0.99) - np.quantile(grey, 0.01))
    if steepest <= 0.0 or height < 8.0:
        return 0.0
    width = height / (np.sqrt(2.0 * np.pi) * steepest)
    return float(factor * np.sqrt(max(width**2 - 1.0, 0.0)))
