"""What image files say of themselves is told once per recording, and hostile bytes say nothing."""

from __future__ import annotations

import json
import shutil
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st

from sixthlink.cli.main import main
from sixthlink.files.exif import noted_turn, unturned

JPEG, PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"


def tags(orientation: int, order: str = ">") -> bytes:
    head = b"MM\0*" if order == ">" else b"II*\0"
    return head + struct.pack(f"{order}IHHHIHHI", 8, 1, 0x0112, 3, 1, orientation, 0, 0)


def jpeg_with(block: bytes, data: bytes) -> bytes:
    return data[:2] + b"\xff\xe1" + struct.pack(">H", len(block) + 2) + block + data[2:]


def png_with(block: bytes, data: bytes) -> bytes:
    chunk = b"eXIf" + block
    return data[:33] + struct.pack(">I", len(block)) + chunk + struct.pack(">I", zlib.crc32(chunk)) + data[33:]


def saved(suffix: str, image: np.ndarray) -> bytes:
    done, data = cv2.imencode(suffix, image)
    assert done
    return data.tobytes()


def orientation(data: bytes) -> int | None:
    turn = noted_turn(data)
    return turn.orientation if turn else None


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("number", range(1, 9))
def test_the_turn_is_read_from_every_format(number, order):
    image = np.zeros((4, 6), np.uint8)
    exif = b"Exif\0\0" + tags(number, order)
    assert orientation(tags(number, order)) == number
    assert orientation(jpeg_with(exif, saved(".jpg", image))) == number
    assert orientation(jpeg_with(b"http://ns.adobe.com/xap/1.0/\0", jpeg_with(exif, saved(".jpg", image)))) == number
    assert orientation(png_with(tags(number, order), saved(".png", image))) == number
    assert orientation(unturned(tags(number, order))) == 1


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp", ".pgm"])
def test_plain_files_note_nothing(suffix):
    assert orientation(saved(suffix, np.zeros((4, 6), np.uint8))) is None


@pytest.mark.parametrize("number", [0, 9, 65535])
def test_turns_that_do_not_exist_are_no_turns(number):
    assert orientation(tags(number)) is None


STARTS = [b"", JPEG, JPEG + b"\xe1\x00\x20Exif\0\0", PNG, PNG + bytes(4) + b"eXIf", b"II*\0", b"MM\0*\0\0\0\x08"]


@given(st.sampled_from(STARTS), st.binary(max_size=200))
def test_hostile_bytes_are_no_turn_and_no_crash(start, rest):
    turn = noted_turn(start + rest)
    assert turn is None or 1 <= turn.orientation <= 8
    assert len(unturned(start + rest)) == len(start + rest)


@given(st.integers(0, 500))
def test_files_that_were_cut_off_are_no_crash(length):
    whole = jpeg_with(b"Exif\0\0" + tags(6), saved(".jpg", np.zeros((4, 6), np.uint8)))
    assert orientation(whole[:length]) in {None, 6}


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("noted") / "cell"
    assert run("simulate", folder, "--scenario", "small", "--seed", 4, "--json").exit_code == 0
    return folder


@pytest.fixture(scope="module")
def photographs(cell) -> Path:
    """The same recording as a camera saves it that was held upright: JPEG, marked to be turned."""
    folder = Path(shutil.copytree(cell, cell.parent / "photographs"))
    for path in sorted((folder / "images").iterdir()):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 95])
        assert done
        path.unlink()
        path.with_suffix(".jpg").write_bytes(jpeg_with(b"Exif\0\0" + tags(6), data.tobytes()))
    table = folder / "shots.csv"
    table.write_text(table.read_text(encoding="utf-8").replace(".png", ".jpg"), encoding="utf-8")
    return folder


def test_the_notes_are_told_once_also_from_the_cache(photographs):
    first, second = (json.loads(run("detect", photographs, "--json").stdout) for _ in range(2))
    assert second["recalled"] == second["images"] == first["found"]
    compression, turn = first["notes"]
    assert compression.startswith("44 images are JPEG: its compression moves corners")
    assert turn.startswith("44 images are marked to be turned (EXIF orientation 6): taken as stored")
    assert second["notes"] == first["notes"]
    assert run("detect", photographs).output.count("note      44 images are") == 2


def test_nothing_is_noted_on_plain_files(cell):
    assert json.loads(run("detect", cell, "--json").stdout)["notes"] == []


def test_a_calibration_keeps_the_notes(photographs, tmp_path):
    answer = run("calibrate", photographs, "--out", tmp_path)
    result = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert [note[:18] for note in result["notes"]] == ["36 images are JPEG", "36 images are mark"]
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for note in result["notes"]:
        assert f"note      {note}" in answer.output
        assert note in page
