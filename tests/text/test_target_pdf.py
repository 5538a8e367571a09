"""A printed target: at true scale on the right paper, read back from the file and from its picture."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from sixthlink.cli.target_command import target
from sixthlink.export import page_for, target_pdf
from sixthlink.target import TARGET_KINDS, Charuco, Chessboard, Found
from sixthlink.target.april_grid import AprilGrid
from sixthlink.target.marker_chessboard import MarkerChessboard
from sixthlink.target.tag_bundle import TagBundle

POINT_MM = 25.4 / 72.0
BOARD = Chessboard(7, 5, 0.02)
KINDS = {
    "chessboard": BOARD,
    "charuco": Charuco(5, 7, 0.03, 0.022, "DICT_6X6_250"),
    "april grid": AprilGrid(4, 3, 0.03, 0.009),
    "kalibr": AprilGrid(4, 3, 0.03, 0.009, kalibr=True),
    "tag bundle": TagBundle("DICT_4X4_50", 0.04, "5, 9", 2, 0.02),
    "marker chessboard": MarkerChessboard(8, 6, 0.02),
}


def content(pdf: bytes) -> str:
    return re.search(rb"stream\n(.*?)\nendstream", pdf, re.DOTALL)[1].decode("cp1252")


def page_mm(pdf: bytes) -> np.ndarray:
    box = re.search(rb"/MediaBox \[0 0 (\S+) (\S+)\]", pdf)
    return np.array([float(box[1]), float(box[2])]) * POINT_MM


def rectangles_mm(pdf: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Rectangles on the page, x and y from its upper left corner, and whether each is black."""
    black, shapes, inks = True, [], []
    for line in content(pdf).splitlines():
        if line in ("0 g", "1 g"):
            black = line == "0 g"
        elif line.endswith(" re"):
            x, y, w, h = map(float, line.split()[:4])
            shapes.append([x, y, x + w, y + h])
            inks.append(black)
    return np.array(shapes), np.array(inks)


def run(*arguments: object):
    return CliRunner().invoke(target, [str(a) for a in arguments])


@pytest.mark.parametrize("name", KINDS)
def test_the_print_has_the_drawings_true_scale(name):
    drawing = KINDS[name].drawing
    pdf = target_pdf(drawing, title=name, paper=None)
    page = page_for(drawing, None)
    assert np.allclose(page_mm(pdf), [page.width_mm, page.height_mm], atol=1e-4)
    scale = [float(n) for n in content(pdf).splitlines()[0].split()[:6]]
    assert np.allclose(scale, [1 / POINT_MM, 0, 0, -1 / POINT_MM, 0, page.height_mm / POINT_MM], atol=1e-4)
    shapes, inks = rectangles_mm(pdf)
    corner = np.array([page.left_mm, page.top_mm]) - drawing.paper[:2] * 1e3
    assert np.abs(shapes - (drawing.rectangles * 1e3 + np.tile(corner, 2))).max() < 1e-3
    assert inks.tolist() == list(drawing.black)


def test_discs_are_round_to_a_micrometre():
    drawing = KINDS["marker chessboard"].drawing
    pdf = content(target_pdf(drawing, title="", paper=None))
    page = page_for(drawing, None)
    corner = np.array([page.left_mm, page.top_mm]) - drawing.paper[:2] * 1e3
    curves = [np.array(line.split()[:6], dtype=float).reshape(3, 2) for line in pdf.splitlines() if line.endswith(" c")]
    assert len(curves) == 4
    x, y, radius = drawing.discs[0] * 1e3
    start = np.array([x + radius, y]) + corner
    s = np.linspace(0.0, 1.0, 50)[:, None]
    for a, b, c in curves:
        way = (1 - s) ** 3 * start + 3 * s * (1 - s) ** 2 * a + 3 * s**2 * (1 - s) * b + s**3 * c
        assert np.abs(np.linalg.norm(way - corner - [x, y], axis=1) - radius).max() < 1e-3
        start = c
    assert np.allclose(start, np.array([x + radius, y]) + corner, atol=1e-4)


def test_the_target_stands_in_the_middle_with_its_name_and_a_line_to_measure():
    pdf = content(target_pdf(BOARD.drawing, title="board (5) \\ 20 mm", paper="A3"))
    page = page_for(BOARD.drawing, "A3")
    assert page.left_mm == pytest.approx((page.width_mm - 200.0) / 2)
    assert page.top_mm == pytest.approx((page.height_mm - 160.0) / 2)
    assert r"(board \(5\) \\ 20 mm) Tj" in pdf
    assert "(check: 100 mm, print at 100 %, no scaling) Tj" in pdf
    lines = [
        np.array(re.findall(r"(\S+) (\S+) [ml]", line), dtype=float) for line in pdf.splitlines() if line[-1] == "S"
    ]
    (check,) = [ends for ends in lines if len(ends) == 2 and abs(np.diff(ends[:, 0])[0]) > 50]
    assert np.diff(check[:, 0])[0] == pytest.approx(100.0, abs=1e-4)
    ticks = [ends[0, 0] for ends in lines if np.allclose(ends[:, 0], ends[0, 0]) and ends[0, 1] > page.top_mm + 160]
    assert sorted(ticks) == pytest.approx(check[:, 0].tolist())
    sheet = np.array([page.left_mm, page.top_mm])
    assert all((ends < sheet).any(axis=1).all() or (ends[:, 1] > page.top_mm + 160).all() for ends in lines)


def test_the_same_target_gives_the_same_bytes_and_a_sound_file():
    first, second = (target_pdf(BOARD.drawing, title="board", paper=None) for _ in range(2))
    assert first == second
    start = int(re.search(rb"startxref\n(\d+)\n", first)[1])
    assert first[start:].startswith(b"xref\n0 7\n")
    for number, place in enumerate(re.findall(rb"(\d{10}) 00000 n \n", first), start=1):
        assert first[int(place) :].startswith(f"{number} 0 obj".encode())
    length = int(re.search(rb"/Length (\d+)", first)[1])
    assert len(content(first).encode("cp1252")) == length
    assert not re.search(rb"Date|\(D:", first)


@pytest.mark.parametrize(
    ("board", "paper", "expected"),
    [
        (Chessboard(5, 3, 0.01), None, ("A5", 148.0, 210.0, 100.0)),
        (Chessboard(5, 8, 0.02), None, ("A4", 210.0, 297.0, 100.0)),
        (BOARD, None, ("A4", 297.0, 210.0, 100.0)),
        (Chessboard(12, 9, 0.02), None, ("A3", 420.0, 297.0, 100.0)),
        (Chessboard(5, 4, 0.02), "letter", ("letter", 215.9, 279.4, 100.0)),
    ],
)
def test_the_smallest_paper_that_fits_is_taken(board, paper, expected):
    page = page_for(board.drawing, paper)
    assert (page.paper, page.width_mm, page.height_mm, page.check_mm) == expected


@pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="pdftoppm draws the page; it is not installed")
@pytest.mark.parametrize("name", KINDS)
def test_the_finder_finds_the_target_in_the_printed_page(tmp_path, name):
    kind, dpi = KINDS[name], 100
    page = page_for(kind.drawing, None)
    (tmp_path / "page.pdf").write_bytes(target_pdf(kind.drawing, title=name, paper=None))
    command = ["pdftoppm", "-gray", "-r", str(dpi), "-singlefile", tmp_path / "page.pdf", tmp_path / "page"]
    subprocess.run(command, check=True)
    image = cv2.GaussianBlur(cv2.imread(str(tmp_path / "page.pgm"), cv2.IMREAD_GRAYSCALE), (0, 0), 0.7)
    answer = kind.find(image)
    assert isinstance(answer, Found), answer
    assert len(answer.points) == len(kind.points_m)
    at_mm = kind.points_m[:, :2] * 1e3 + [page.left_mm, page.top_mm] - kind.drawing.paper[:2] * 1e3
    expected = at_mm * dpi / 25.4 - 0.5
    # The program that draws the page moves edges to whole pixels.
    assert np.abs(answer.pixels - expected[answer.points]).max() < 0.6


def test_the_command_writes_the_file_and_says_what_to_measure(tmp_path):
    out = tmp_path / "deep" / "board.pdf"
    answer = run("chessboard", "--pdf", out, "--columns", 7, "--rows", 5, "--square", 20)
    assert answer.exit_code == 0, answer.output
    assert "35 points on A4" in answer.output
    assert "check line must be 100 mm long" in answer.output
    assert "target: {kind: chessboard, columns: 7, rows: 5, square: 20}" in answer.output
    assert out.read_bytes() == target_pdf(
        BOARD.drawing, title="chessboard, columns 7, rows 5, square 20 mm", paper="A4"
    )


def test_the_command_tells_programs_the_same(tmp_path):
    out = tmp_path / "tags.pdf"
    options = ("--dictionary", "DICT_4X4_50", "--tag", 40, "--ids", "5, 9", "--columns", 2, "--spacing", 20)
    answer = run("tag-bundle", "--pdf", out, *options, "--paper", "A2", "--json")
    assert answer.exit_code == 0, answer.output
    told = json.loads(answer.stdout)
    assert told == {"files": {"pdf": str(out)}, "points": 8, "paper": "A2", "check_length_m": 0.1}
    assert Path(told["files"]["pdf"]).read_bytes().startswith(b"%PDF")
    plain = run("tag-bundle", "--pdf", out, *options)
    assert (
        'target: {kind: tag-bundle, dictionary: DICT_4X4_50, tag: 40, ids: "5, 9", columns: 2, spacing: 20}'
        in plain.output
    )


def test_help_lists_the_kinds_and_gives_each_option_its_unit(monkeypatch):
    monkeypatch.setitem(TARGET_KINDS, "grid", AprilGrid)
    listed = run("--help").output
    assert "A chessboard, counted by its inner corners." in listed
    assert "grid" in listed
    words = " ".join(run("grid", "--help").output.split())
    for piece in (
        "--tag FLOAT RANGE Side of a tag, from outer edge to outer edge of its black border [mm].",
        "--columns INTEGER Tags along x. [required]",
        "--kalibr For grids printed by Kalibr.",
        "[default: DICT_APRILTAG_36h11]",
        "--json",
    ):
        assert piece in words


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("chessboard", "--columns", 2, "--rows", 5, "--square", 20), "--columns, --rows: a chessboard of 2 x 5"),
        (("chessboard", "--columns", 60, "--rows", 50, "--square", 20), "more than paper A0 has"),
        (("chessboard", "--columns", 12, "--rows", 9, "--square", 20, "--paper", "A4"), "more than paper A4 has"),
        (
            ("charuco", "--columns", 5, "--rows", 7, "--square", 20, "--marker", 25, "--dictionary", "DICT_4X4_50"),
            "--marker",
        ),
        (
            ("charuco", "--columns", 5, "--rows", 7, "--square", 20, "--marker", 15, "--dictionary", "4X4"),
            "--dictionary",
        ),
    ],
)
def test_impossible_targets_are_refused_by_the_option_at_fault(tmp_path, arguments, words):
    out = tmp_path / "board.pdf"
    answer = run(*arguments, "--pdf", out)
    assert answer.exit_code == 2
    assert words in answer.stderr
    assert "nothing was written" in answer.stderr
    assert not out.exists()
    told = json.loads(run(*arguments, "--pdf", out, "--json").stdout)
    assert told["error"] == "InputError"
