"""Which pixels were recorded instead of images, and how are they written?"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np

from sixthlink.errors import Finding
from sixthlink.files.csv_table import CsvTable, cell_finding, check_columns, column, numbers
from sixthlink.recording import Detections, Recording

__all__ = ["COLUMNS", "DEFAULT_SIGMA_PX", "PixelNames", "pixels_text", "read_pixels"]

COLUMNS = ("shot", "camera", "point", "u_px", "v_px")
SIGMA = "sigma_px"
DEFAULT_SIGMA_PX = 0.1
"""Standard deviation of a pixel coordinate where the table says nothing [pixel]."""


@dataclass(frozen=True)
class PixelNames:
    """What the cells of pixels.csv may name.

    Attributes:
        shots: Names of the shots.
        marks: Mark of each shot, empty for calibration shots.
        cameras: Names of the cameras.
        points: Number of points on the target.
        standard_marks: Names of the length standard's marks.
    """

    shots: tuple[str, ...]
    marks: tuple[str, ...]
    cameras: tuple[str, ...]
    points: int
    standard_marks: tuple[str, ...] = ()


def read_pixels(table: CsvTable, names: PixelNames, findings: list[Finding]) -> Detections | None:
    """Detections of a table, or None when something is wrong with it; findings are appended."""
    before = len(findings)
    check_columns(table, COLUMNS, [SIGMA], "", findings)
    if len(findings) > before:
        return None
    shots = _indices(table, "shot", names.shots, findings)
    cameras = _indices(table, "camera", names.cameras, findings)
    points = _points(table, shots, names, findings)
    pixels = numbers(table, COLUMNS[3:], findings)
    sigmas = numbers(table, [SIGMA], findings) if SIGMA in table.header else None
    if sigmas is not None:
        for i in np.flatnonzero(sigmas[:, 0] <= 0.0):
            what = f"is {sigmas[i, 0]:g}"
            findings.append(cell_finding(table, (int(i), SIGMA), what, "above 0", "write the standard deviation"))
    _check_repeats(table, zip(shots, cameras, points, strict=True), findings)
    if pixels is None or len(findings) > before:
        return None
    sigmas_px = np.full(len(pixels), DEFAULT_SIGMA_PX) if sigmas is None else sigmas[:, 0]
    return Detections(np.array(shots), np.array(cameras), np.array(points), pixels, sigmas_px)


def pixels_text(recording: Recording, detections: Detections) -> str:
    """Text of pixels.csv; points of the length standard are written by the names of its marks."""
    marks = recording.standard.marks if recording.standard else ()
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, SIGMA])
    columns = (
        detections.shots,
        detections.cameras,
        detections.points,
        detections.pixels,
        detections.sigmas_px,
    )
    for shot, camera, point, (u, v), sigma in zip(*(c.tolist() for c in columns), strict=True):
        name = marks[point] if recording.marks[shot] else point
        writer.writerow([recording.ids[shot], recording.head.cameras[camera].name, name, repr(u), repr(v), repr(sigma)])
    return text.getvalue()


def _indices(table: CsvTable, name: str, known: tuple[str, ...], findings: list[Finding]) -> list[int]:
    number = {word: k for k, word in enumerate(known)}
    indices = []
    for i, word in enumerate(column(table, name)):
        indices.append(number.get(word, -1))
        if word not in number:
            expected = f"one of {', '.join(known)}" if len(known) < 10 else "the name of a shot in shots.csv"
            findings.append(cell_finding(table, (i, name), f"'{word}' is not known", expected, "correct or add it"))
    return indices


def _points(table: CsvTable, shots: list[int], names: PixelNames, findings: list[Finding]) -> list[int]:
    """Point numbers: of the target in calibration shots, of the mark in shots of the length standard."""
    points = []
    for i, (word, shot) in enumerate(zip(column(table, "point"), shots, strict=True)):
        mark = names.marks[shot] if shot >= 0 else ""
        if mark:
            expected, good = f"{mark}, the mark of the shot", word == mark and mark in names.standard_marks
            points.append(names.standard_marks.index(mark) if good else -1)
        else:
            expected = f"a whole number from 0 to {names.points - 1}"
            good = word.isascii() and word.isdigit() and len(word) < 10 and int(word) < names.points
            points.append(int(word) if good else -1)
        if not good and shot >= 0:
            cure = "number the points as docs/formats.md shows"
            findings.append(cell_finding(table, (i, "point"), f"is '{word}'", expected, cure))
    return points


def _check_repeats(table: CsvTable, rows: zip[tuple[int, int, int]], findings: list[Finding]) -> None:
    first: dict[tuple[int, int, int], int] = {}
    for i, row in enumerate(rows):
        if min(row) >= 0 and first.setdefault(row, i) != i:
            what = f"is there already, in line {table.lines[first[row]]}"
            findings.append(cell_finding(table, (i, "point"), what, "each point once per image", "remove one of them"))
