"""How does an image look from afar, where finding is quick?"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["full_pixels", "reduced_image"]


def reduced_image(image: GreyImage, width_px: int) -> npt.NDArray[np.uint8]:
    """The image in 8 bit, area-averaged to about ``width_px`` columns; not enlarged if it is already smaller.

    More than 8 bit are stretched between their 0.5 and 99.5 percent levels, whatever the camera's true depth.
    """
    import cv2

    height, width = image.shape
    scale = min(1.0, width_px / width)
    small: npt.NDArray[np.uint8 | np.uint16] = np.ascontiguousarray(image)
    if scale < 1.0:
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        small = np.asarray(cv2.resize(small, size, interpolation=cv2.INTER_AREA), dtype=image.dtype)
    if small.dtype == np.uint8:
        return small.astype(np.uint8, copy=False)
    grey = small.astype(np.float32)
    low, high = np.percentile(grey, (0.5, 99.5))
    stretched = (grey - low) * (255.0 / max(high - low, 1.0))
    return np.asarray(np.clip(np.rint(stretched), 0, 255), dtype=np.uint8)


def full_pixels(reduced_pixels: npt.ArrayLike, reduced: GreyImage, image: GreyImage) -> Floats:
    """Pixels ``(N, 2)`` of the full image from pixels of the reduced one; pixel centres are whole numbers in both."""
    scale = np.array([image.shape[1] / reduced.shape[1], image.shape[0] / reduced.shape[0]])
    full = (np.asarray(reduced_pixels, dtype=np.float64).reshape(-1, 2) + 0.5) * scale - 0.5
    return np.asarray(full, dtype=np.float64)
