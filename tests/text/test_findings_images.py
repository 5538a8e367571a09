"""A broken image is a reason in words, never an exception; a good one keeps its depth and orientation."""

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from example_recording import write_example

from sixthlink.files import image_reader, read_grey_image, read_recording
from sixthlink.target import NotFound

RAMP = np.arange(40 * 60, dtype=np.uint16).reshape(40, 60) * 27


def saved(path: Path, image: np.ndarray) -> Path:
    done, data = cv2.imencode(path.suffix, image)
    assert done
    path.write_bytes(data.tobytes())
    return path


def reason(path: Path, size_px: tuple[int, int] | None = None) -> str:
    found = read_grey_image(path, size_px)
    assert isinstance(found, NotFound)
    return found.reason


@pytest.mark.parametrize("suffix", [".png", ".tiff", ".pgm"])
@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_depth_is_kept_without_loss(tmp_path: Path, suffix: str, depth: type) -> None:
    image = (RAMP >> (8 if depth is np.uint8 else 0)).astype(depth)
    read = read_grey_image(saved(tmp_path / f"ä image{suffix}", image), (60, 40))
    assert isinstance(read, np.ndarray) and read.dtype == depth
    np.testing.assert_array_equal(read, image)


@pytest.mark.parametrize("channels", [3, 4])
def test_colour_becomes_grey_and_alpha_is_dropped(tmp_path: Path, channels: int) -> None:
    image = np.zeros((40, 60, channels), dtype=np.uint8)
    image[..., 1] = 100  # green alone
    if channels == 4:
        image[..., 3] = np.arange(60)
    read = read_grey_image(saved(tmp_path / "a.png", image))
    assert isinstance(read, np.ndarray) and read.shape == (40, 60)
    assert set(np.unique(read)) == {59}  # ITU-R BT.601: 0.587 of green


def test_rotation_noted_by_the_camera_is_not_applied(tmp_path: Path) -> None:
    path = saved(tmp_path / "a.jpg", np.tile(np.arange(60, dtype=np.uint8) * 4, (40, 1)))
    data = path.read_bytes()
    tiff = b"MM\0*" + struct.pack(">IHHHIHHI", 8, 1, 0x0112, 3, 1, 6, 0, 0)
    exif = b"Exif\0\0" + tiff
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + data[2:])
    rotated = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert rotated is not None and rotated.shape == (60, 40)
    read = read_grey_image(path)
    assert isinstance(read, np.ndarray) and read.shape == (40, 60)


def test_reasons(tmp_path: Path) -> None:
    good = saved(tmp_path / "good.png", RAMP)
    assert reason(tmp_path / "none.png") == "none.png cannot be read: No such file or directory"
    assert reason(good, (40, 60)) == "good.png has 60 x 40 pixel, expected 40 x 60 as recording.yaml says"
    text = tmp_path / "text.png"
    text.write_text("hello")
    assert reason(text) == "text.png is not an image in one of the formats PNG, JPEG, TIFF, BMP, PGM, PPM"
    deep = saved(tmp_path / "deep.tiff", RAMP.astype(np.float32))
    assert reason(deep) == "deep.tiff has pixels of type float32; save it with 8 or 16 bit"


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tiff", ".bmp", ".pgm"])
@pytest.mark.parametrize("part", [0.1, 0.5, 0.95])
def test_file_that_was_cut_off(tmp_path: Path, suffix: str, part: float) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (200, 300), dtype=np.uint8)
    path = saved(tmp_path / f"cut{suffix}", noise)
    data = path.read_bytes()
    path.write_bytes(data[: int(part * len(data))])
    assert "cut off" in reason(path)


def test_image_too_large_to_decode(tmp_path: Path) -> None:
    header = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 0, 0, 0, 0)
    path = saved(tmp_path / "bomb.png", RAMP)
    data = path.read_bytes()
    import zlib

    chunk = b"IHDR" + header
    path.write_bytes(data[:12] + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[33:])
    assert "too large" in reason(path)


def test_reader_by_shot_and_camera(tmp_path: Path) -> None:
    folder = write_example(tmp_path)
    image = np.full((480, 640), 7, dtype=np.uint8)
    saved(folder / "a.png", image)
    read = image_reader(folder, read_recording(folder))
    right = read(0, 0)
    assert isinstance(right, np.ndarray)
    np.testing.assert_array_equal(right, image)
    left, without = read(0, 1), read(2, 1)
    assert isinstance(left, NotFound) and left.reason.startswith("b.png is not an image")
    assert isinstance(without, NotFound) and without.reason == "the camera took no image in this shot"
