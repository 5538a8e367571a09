"""One picture, saved in every format and depth, grey or in colour, shows the same corners."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from sixthlink.camera import Camera
from sixthlink.files import read_grey_image
from sixthlink.geometry import exp_rotation, transform
from sixthlink.simulate import Exposure, render_target
from sixthlink.target import Chessboard, Found

CAMERA = Camera(640, 480, np.full(2, 900.0), np.array([319.5, 239.5]), np.zeros(5))
BOARD = Chessboard(8, 5, 0.03)

DEEP = [8, 10, 12, 16]
CASES = [
    *((suffix, bits) for suffix in (".png", ".tiff", ".pgm") for bits in DEEP),
    (".bmp", 8),
    (".jpg", 8),
]


@pytest.fixture(scope="module")
def picture():
    R = exp_rotation(np.array([0.3, 0.1, 0.2]))
    T = transform(R, np.array([0.0, 0.0, 0.5]) - R @ (0.5 * BOARD.points_m.max(axis=0)))
    return render_target(BOARD.drawing, CAMERA, T, Exposure(), np.random.default_rng(0))


@pytest.fixture(scope="module")
def plain(picture):
    return BOARD.find(picture)


def deepened(picture, bits: int):
    return picture if bits == 8 else picture.astype(np.uint16) * 2 ** (bits - 8)


def corners(path: Path) -> Found:
    image = read_grey_image(path, (640, 480))
    assert isinstance(image, np.ndarray), image
    found = BOARD.find(image)
    assert isinstance(found, Found), found
    return found


@pytest.mark.parametrize("colour", [False, True], ids=["grey", "colour"])
@pytest.mark.parametrize(("suffix", "bits"), CASES)
def test_format_and_depth_do_not_move_corners(tmp_path, picture, plain, suffix, bits, colour):
    image = deepened(picture, bits)
    if colour:
        image, suffix = cv2.merge([image] * 3), suffix.replace("pgm", "ppm")
    done, data = cv2.imencode(suffix, image)
    assert done
    path = tmp_path / f"image{suffix}"
    path.write_bytes(data.tobytes())
    found = corners(path)
    assert found.points.tolist() == plain.points.tolist()
    assert found.pixels == pytest.approx(plain.pixels, abs=0.05 if suffix == ".jpg" else 0.002)
    assert found.sigmas_px == pytest.approx(plain.sigmas_px, rel=0.5 if suffix == ".jpg" else 0.05)


@pytest.mark.parametrize("bits", [10, 12])
@pytest.mark.parametrize("magic", [5, 2, 6, 3])
def test_portable_maps_with_the_depth_of_the_camera(tmp_path, picture, plain, magic, bits):
    """10 or 12 bits in two bytes, as cameras' own tools write them: the largest value stands in the header."""
    image = deepened(picture, bits)
    if magic in {6, 3}:
        image = cv2.merge([image] * 3)
    header = f"P{magic}\n640 480\n{2**bits - 1}\n".encode()
    text = "\n".join(map(str, image.ravel().tolist())).encode() + b"\n"
    path = tmp_path / "image.pgm"
    path.write_bytes(header + (text if magic in {2, 3} else image.astype(">u2").tobytes()))
    assert corners(path).pixels == pytest.approx(plain.pixels, abs=0.002)


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_turns_noted_in_tiff_are_not_made(tmp_path, picture, orientation, order, depth):
    image = picture.astype(depth)
    path = tmp_path / "image.tiff"
    path.write_bytes(tiff(image, orientation, order))
    read = read_grey_image(path)
    assert isinstance(read, np.ndarray)
    np.testing.assert_array_equal(read, image)


def tiff(image, orientation: int, order: str) -> bytes:
    """A plain grey TIFF file: its picture, then its tags."""
    height, width = image.shape
    strip = image.astype(image.dtype.newbyteorder(order)).tobytes()
    bits = 8 * image.itemsize
    tags = [(256, width), (257, height), (258, bits), (259, 1), (262, 1), (274, orientation), (277, 1), (278, height)]
    tags = sorted([*tags, (273, 8), (279, len(strip))])
    entries = [
        struct.pack(f"{order}HHII", tag, 4, 1, value)
        if tag in {273, 279}
        else struct.pack(f"{order}HHIHH", tag, 3, 1, value, 0)
        for tag, value in tags
    ]
    start = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(f"{order}I", 8 + len(strip))
    return start + strip + struct.pack(f"{order}H", len(tags)) + b"".join(entries) + bytes(4)
