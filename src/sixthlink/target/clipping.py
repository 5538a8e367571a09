"""Has so much light fallen on the target that white is cut off at the end of the range, and edges have moved?

Where black goes over into white, the edge is half way. Half way to a white that is cut off is too far in the black:
tags shrink. That white is at the end of the range does not yet say that it is cut off. A blurred edge does: its slope
is the same a quarter from black and a quarter from white, unless the white end is missing; and so does black that is
bright. The corners of four squares have such edges on both sides and stand much more.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["NEARLY", "burnt_out", "cut_off", "largest_grey"]

Bools = npt.NDArray[np.bool_]

NEARLY = 0.98
"""Share of the range that counts as its end: the upper bits alone may be used, and lenses darken the image's edge."""

BRIGHT_BLACK = 0.5
"""Share of the range that black may reach beside white at its end. Rendered corners are off by 0.013 pixel at 0.3, as
they are in good light, by 0.03 at 0.47 and by 0.06 at 0.7."""

STEEPER, BRIGHT_BORDER = 1.25, 0.125
"""Slope a quarter from white over that a quarter from black, and black's share of the range, beyond which the edges of
a tag have moved. Rendered tags are off by 0.02 pixel at 1.2 and 0.12, by 0.4 beyond."""

AROUND_PX, WIDEST_PX, STEP_PX = 6, 5.0, 0.5
"""Half the window around a corner whose grey values are looked at; half of the longest lines across the edges of a tag,
and the steps along them."""


def largest_grey(image: GreyImage) -> float:
    """End of the range of grey values: of 8, 10, 12, 14 or 16 bits, as the image itself shows."""
    if image.dtype == np.uint8:
        return 255.0
    brightest = int(image.max(initial=0))
    return float(next(2**bits - 1 for bits in (10, 12, 14, 16) if brightest < 2**bits))


def burnt_out(image: GreyImage, corners: Floats) -> str:
    """Why corners of black and white must not be trusted: even the black around them is bright; empty otherwise.

    Args:
        image: ``(height, width)`` grey image.
        corners: ``(N, 2)`` where they are [pixel].
    """
    largest = largest_grey(image)
    window = np.arange(-AROUND_PX, AROUND_PX + 1)
    u, v = np.rint(corners).astype(np.int64).T[..., None] + window
    height, width = image.shape
    grey = image[np.clip(v, 0, height - 1)[:, :, None], np.clip(u, 0, width - 1)[:, None, :]].reshape(len(corners), -1)
    if grey.max(initial=0) < NEARLY * largest:
        return ""
    black, white = (float(np.median(k)) for k in np.quantile(grey, (0.1, 0.9), axis=1))
    if white < NEARLY * largest or black <= BRIGHT_BLACK * largest:
        return ""
    return (
        f"over-exposed: white is at the end of the range and black at {black / largest:.0%} of it, so that the edges "
        "between them have moved: less light or a shorter exposure"
    )


def cut_off(image: GreyImage, quads: Floats, cell_px: Floats) -> Bools:
    """Around which black tags the white is cut off.

    Args:
        image: ``(height, width)`` grey image.
        quads: ``(T, 4, 2)`` corners of the tags [pixel].
        cell_px: ``(T,)`` how far black and white reach on either side of their edges at least [pixel].
    """
    largest = largest_grey(image)
    return np.array([_is_cut_off(_profiles(image, q, c), largest) for q, c in zip(quads, cell_px, strict=True)], bool)


def _profiles(image: GreyImage, quad: Floats, cell_px: float) -> Floats:
    """Grey values ``(L, K)`` on lines across the edges of a tag, from the inside out."""
    from scipy.ndimage import map_coordinates

    following = np.roll(quad, -1, axis=0)
    share = np.linspace(0.1, 0.9, 15)[:, None]
    feet = (quad[:, None] * (1.0 - share) + following[:, None] * share).reshape(-1, 2)
    along = (following - quad) / np.linalg.norm(following - quad, axis=1, keepdims=True)
    out = np.repeat(np.stack([along[:, 1], -along[:, 0]], axis=1), len(share), axis=0)
    out *= np.sign(np.sum((feet - quad.mean(axis=0)) * out, axis=1, keepdims=True))
    reach = min(0.8 * cell_px, WIDEST_PX)
    places = feet[:, None] + np.arange(-reach, reach + 1e-6, STEP_PX)[:, None] * out[:, None]
    grey = map_coordinates(image, [places[..., 1], places[..., 0]], order=1, mode="nearest", output=np.float64)
    return np.asarray(grey)


def _is_cut_off(grey: Floats, largest: float) -> bool:
    dark, bright = np.median(grey[:, 0]), np.median(grey[:, -1])
    if bright < NEARLY * largest:
        return False
    if dark > BRIGHT_BORDER * largest:
        return True
    middle = (0.5 * (grey[:, 1:] + grey[:, :-1]) - dark) / (bright - dark)
    slope = np.diff(grey, axis=1)
    black, white = (slope[(middle > low) & (middle < low + 0.2)] for low in (0.15, 0.65))
    return bool(len(black) and len(white) and np.mean(white) > STEEPER * np.mean(black))
