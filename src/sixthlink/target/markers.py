"""How is a square marker of one of OpenCV's dictionaries printed, and which of them does an image show?"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints

__all__ = [
    "dictionary_names",
    "exact_markers",
    "marker_bits",
    "marker_cells",
    "marker_count",
    "marker_sides",
    "read_markers",
]


def marker_cells(dictionary: str, marker: int, side_m: float, border: int = 1) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Rectangles ``(R, 4)`` of a marker whose upper left corner is the origin [m], and whether each is black.

    Args:
        dictionary: OpenCV's name, for example ``DICT_6X6_250``.
        marker: Number of the marker.
        side_m: Side of the whole marker, its black border included [m].
        border: Width of the black border [cells].
    """
    import cv2

    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    cells = known.markerSize + 2 * border
    image = cv2.aruco.generateImageMarker(known, marker, cells, borderBits=border)
    row, column = np.nonzero(image > 0)
    step = side_m / cells
    white = step * np.stack([column, row, column + 1, row + 1], axis=1)
    whole = np.array([[0.0, 0.0, side_m, side_m]])
    return np.concatenate([whole, white]), np.r_[True, np.zeros(len(white), dtype=bool)]


def dictionary_names() -> tuple[str, ...]:
    """Names of the dictionaries that this OpenCV knows."""
    import cv2

    return tuple(sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_")))


def marker_count(dictionary: str) -> int:
    """How many markers a dictionary has; they are numbered from 0."""
    import cv2

    return len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).bytesList)


def marker_bits(dictionary: str) -> int:
    """Cells along the side of a marker, its black border left out."""
    import cv2

    return int(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)).markerSize)


def marker_sides(dictionary: str, markers: Ints) -> npt.NDArray[np.bool_]:
    """Whether the outermost data cells of markers ``(M,)`` are white, ``(M, 4, K)``: round the marker, clockwise."""
    import cv2

    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    cells = known.markerSize + 2
    white = [cv2.aruco.generateImageMarker(known, int(m), cells)[1:-1, 1:-1] > 0 for m in markers]
    return np.array([[w[0], w[:, -1], w[-1, ::-1], w[::-1, 0]] for w in white]).reshape(-1, 4, known.markerSize)


def exact_markers(image: npt.NDArray[np.uint8], dictionary: str) -> Ints:
    """Numbers ``(M,)`` of the markers in an image that can be read without a wrong cell, one as often as it is seen."""
    import cv2

    parameters = cv2.aruco.DetectorParameters()
    parameters.errorCorrectionRate = 0.0
    parameters.maxErroneousBitsInBorderRate = 0.0
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    _, ids, _ = cv2.aruco.ArucoDetector(known, parameters).detectMarkers(image)
    return np.empty(0, dtype=np.int64) if ids is None else np.asarray(ids, dtype=np.int64).ravel()


def read_markers(
    image: npt.NDArray[np.uint8], dictionary: str, border: int, numbers: Ints, corners_m: Floats
) -> tuple[Ints, Floats]:
    """Markers in an image: those that can be read, and those that only fit where the others say they must be.

    Args:
        image: ``(height, width)`` grey image.
        dictionary: OpenCV's name of the dictionary.
        border: Width of the black border [cells].
        numbers: ``(T,)`` numbers of the markers that are on one plane.
        corners_m: ``(T, 4, 2)`` their corners on that plane, in OpenCV's order [m].

    Returns:
        ``(M,)`` numbers as they were read, also ones that are not among ``numbers``, and ``(M, 4, 2)`` corners in
        OpenCV's order, to about a pixel.
    """
    import cv2

    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border
    parameters.errorCorrectionRate = 0.4
    # More samples of each cell's middle read small and noisy markers better, and cost nothing that shows.
    parameters.perspectiveRemovePixelPerCell = 8
    parameters.perspectiveRemoveIgnoredMarginPerCell = 0.25
    # Where the others say that a marker must be it may have as many wrong cells as its dictionary can tell, no more:
    # OpenCV's own three times as many would make any square a marker.
    again = cv2.aruco.RefineParameters(10.0, 1.0, True)
    detector = cv2.aruco.ArucoDetector(known, parameters, again)
    quads, ids, others = detector.detectMarkers(image)
    if ids is None or not len(ids):
        return np.empty(0, dtype=np.int64), np.empty((0, 4, 2))
    if len(others) and np.count_nonzero(np.isin(ids, numbers)) > 1:
        solid = np.concatenate([corners_m, np.zeros((*corners_m.shape[:2], 1))], axis=2).astype(np.float32)
        board = cv2.aruco.Board(list(solid), known, numbers.astype(np.int32))
        quads, ids, _, _ = detector.refineDetectedMarkers(image, board, quads, ids, others)
    return np.asarray(ids, dtype=np.int64).ravel(), np.asarray(quads, dtype=np.float64).reshape(-1, 4, 2)
