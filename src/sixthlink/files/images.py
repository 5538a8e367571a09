"""What does one image file show?

One broken file is a named rejection of one image, never a crash of the run: everything that can be wrong with
it comes back as :class:`~sixthlink.target.NotFound`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sixthlink.files.exif import unturned
from sixthlink.files.inside import file_inside
from sixthlink.recording import Recording
from sixthlink.target import GreyImage, NotFound

__all__ = ["JPEG", "image_reader", "kind_of", "read_grey_image"]

JPEG = "JPEG"

MOST_BYTES = 512 * 2**20
"""Largest image file that is read."""

MOST_PIXELS = 2**26
"""Most pixels that OpenCV may decode, 64 megapixel, unless the environment says otherwise."""

_BEGINNINGS = {
    "PNG": (b"\x89PNG\r\n\x1a\n",),
    JPEG: (b"\xff\xd8\xff",),
    "TIFF": (b"II*\0", b"MM\0*"),
    "BMP": (b"BM",),
    "PGM": (b"P5", b"P2"),
    "PPM": (b"P6", b"P3"),
}
_JPEG_END = b"\xff\xd9"


def read_grey_image(path: Path, size_px: tuple[int, int] | None = None) -> GreyImage | NotFound:
    """Grey image of a file, 8 or 16 bit as it was saved; colour becomes grey and transparency is dropped.

    The pixels are taken as they are stored: a rotation noted by the camera (EXIF) would move them away from
    the lens model. JPEG is read, although its compression costs some accuracy.

    Args:
        path: PNG, TIFF, BMP, PGM, PPM or JPEG file.
        size_px: Width and height that it must have, or None for any.

    Returns:
        ``(height, width)`` image, or why there is none.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            return NotFound(f"{path.name} has more than {MOST_BYTES // 2**20} MiB")
        data = path.read_bytes()
    except OSError as error:
        return NotFound(f"{path.name} cannot be read: {error.strerror}")
    kind = kind_of(data[:8])
    if kind is None:
        return NotFound(f"{path.name} is not an image in one of the formats {', '.join(_BEGINNINGS)}")
    if kind == JPEG and not data.rstrip(b"\0").endswith(_JPEG_END):
        return NotFound(f"{path.name} is cut off: its end is missing; copy it again")
    image = _decoded(unturned(data) if kind == "TIFF" else data)
    if image is None:
        return NotFound(f"{path.name} is damaged, cut off or too large to decode; copy it again")
    if image.dtype not in (np.uint8, np.uint16):
        return NotFound(f"{path.name} has pixels of type {image.dtype}; save it with 8 or 16 bit")
    grey = _grey(image)
    height, width = grey.shape
    if size_px is not None and (width, height) != tuple(size_px):
        expected = f"{size_px[0]} x {size_px[1]} as recording.yaml says"
        return NotFound(f"{path.name} has {width} x {height} pixel, expected {expected}")
    return grey


def kind_of(beginning: bytes) -> str | None:
    """Format of a file by its first eight bytes; None where it is no image that is read."""
    return next((kind for kind, starts in _BEGINNINGS.items() if beginning.startswith(starts)), None)


def image_reader(folder: Path, recording: Recording) -> Callable[[int, int], GreyImage | NotFound]:
    """Function that reads the image of a shot and a camera, both given by their index in the recording.

    Args:
        folder: Folder of the recording.
        recording: The recording.
    """
    cameras = recording.head.cameras

    def read(shot: int, camera: int) -> GreyImage | NotFound:
        description = cameras[camera]
        name = recording.images[description.name][shot] if description.name in recording.images else ""
        if not name:
            return NotFound("the camera took no image in this shot")
        try:
            path = file_inside(folder, name)
        except ValueError as error:
            return NotFound(str(error))
        return read_grey_image(path, (description.width_px, description.height_px))

    return read


def _decoded(data: bytes) -> np.ndarray | None:
    os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MOST_PIXELS))  # read once, when OpenCV is loaded
    import cv2

    try:
        return cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        return None


def _grey(image: np.ndarray) -> GreyImage:
    import cv2

    if image.ndim == 2:
        return image
    if image.shape[2] < 3:
        return np.ascontiguousarray(image[..., 0])
    grey: GreyImage = cv2.cvtColor(np.ascontiguousarray(image[..., :3]), cv2.COLOR_BGR2GRAY)  # type: ignore[assignment]
    return grey
