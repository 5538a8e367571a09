"""How is a square marker of one of OpenCV's dictionaries printed?"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats

__all__ = ["dictionary_names", "marker_cells"]


def marker_cells(dictionary: str, marker: int, side_m: float) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Rectangles ``(R, 4)`` of a marker whose upper left corner is the origin [m], and whether each is black.

    Args:
        dictionary: OpenCV's name, for example ``DICT_6X6_250``.
        marker: Number of the marker.
        side_m: Side of the whole marker, its black border included [m].
    """
    import cv2

    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    cells = known.markerSize + 2
    image = cv2.aruco.generateImageMarker(known, marker, cells)
    row, column = np.nonzero(image > 0)
    step = side_m / cells
    white = step * np.stack([column, row, column + 1, row + 1], axis=1)
    whole = np.array([[0.0, 0.0, side_m, side_m]])
    return np.concatenate([whole, white]), np.r_[True, np.zeros(len(white), dtype=bool)]


def dictionary_names() -> tuple[str, ...]:
    """Names of the dictionaries that this OpenCV knows."""
    import cv2

    return tuple(sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_")))
