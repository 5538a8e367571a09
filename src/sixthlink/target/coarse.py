"""How does an image look from afar, where finding is quick?"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["full_pixels", "reduced_image"]

SMALLEST_SHARE = 0.8
"""Share of the wanted width below which an image is not halved any more."""


def reduced_image(image: GreyImage, width_px: int) -> npt.NDArray[np.uint8]:
    """The image in 8 bit, halved by area as often as about ``width_px`` columns are left; not enlarged.

    Halving is many times as fast as any other factor, and maps pixels to pixels exactly. An odd last row or column is
    dropped. More than 8 bit are stretched between their 0.5 and 99.5 percent levels, whatever the camera's true depth.
    """
    import cv2

    small: npt.NDArray[np.uint8 | np.uint16] = np.ascontiguousarray(image)
    while small.shape[1] // 2 >= SMALLEST_SHARE * width_px and small.shape[0] >= 2:
        height, width = small.shape[0] // 2, small.shape[1] // 2
        even = small[: 2 * height, : 2 * width]
        small = np.asarray(cv2.resize(even, (width, height), interpolation=cv2.INTER_AREA), dtype=image.dtype)
    if small.dtype == np.uint8:
        return small.astype(np.uint8, copy=False)
    grey = small.astype(np.float32)
    low, high = np.percentile(grey, (0.5, 99.5))
    stretched = (grey - low) * (255.0 / max(high - low, 1.0))
    return np.asarray(np.clip(np.rint(stretched), 0, 255), dtype=np.uint8)


def full_pixels(reduced_pixels: npt.ArrayLike, reduced: GreyImage, image: GreyImage) -> Floats:
    """Pixels ``(N, 2)`` of the full image from pixels of the reduced one; pixel centres are whole numbers in both."""
    factor = image.shape[1] // reduced.shape[1]
    full = (np.asarray(reduced_pixels, dtype=np.float64).reshape(-1, 2) + 0.5) * factor - 0.5
    return np.asarray(full, dtype=np.float64)
