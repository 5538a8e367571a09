"""What does shots.csv say of each shot?

Texts are judged here, and numbers are made of them; what the numbers mean is ``shot_positions``' question.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from sixthlink.errors import Finding
from sixthlink.files.csv_table import CsvTable, cell_finding, check_columns, column, numbers
from sixthlink.files.inside import file_inside
from sixthlink.files.schema_findings import did_you_mean
from sixthlink.geometry import Floats
from sixthlink.recording import BOARD_KINDS, KINDS

__all__ = ["FEWEST_SHOTS", "ShotLayout", "Shots", "check_image_files", "read_shots"]

FEWEST_SHOTS = 3
"""Fewest calibration shots: two motions about different axes are the least that fixes a head."""

CALIBRATE = KINDS[0]
STANDARD_KINDS = tuple(kind for kind in KINDS if kind not in BOARD_KINDS)
TOUCH_KINDS = (*BOARD_KINDS, "verify")
"""Kinds of touches: where the standard calibrates, its length counts as known, so that there is no ``scale``."""


@dataclass(frozen=True)
class ShotLayout:
    """Which columns shots.csv must have, as far as recording.yaml says.

    Attributes:
        positions: Columns of the robot's position, None while unknown.
        targets: Columns of measured target poses, empty when there are none, None while unknown.
        cameras: Cameras that took images, empty when there are none, None while unknown.
        marks: Names of the length standard's marks, empty without a standard, None while unknown.
        why: What the position columns follow from, for people.
        fewest: Calibrate shots that there must be.
        touched: Whether every shot is the touch of a socket, which its mark names.
    """

    positions: tuple[str, ...] | None
    targets: tuple[str, ...] | None
    cameras: tuple[str, ...] | None
    marks: tuple[str, ...] | None
    why: str
    fewest: int = FEWEST_SHOTS
    touched: bool = False


@dataclass(frozen=True)
class Shots:
    """Columns of shots.csv; numbers are in the units of the file.

    Attributes:
        ids: Name of each shot.
        placements: Placement of each shot.
        kinds: Kind of each shot.
        marks: Mark of each shot, empty for shots that show the target.
        images: File name per shot, by camera; empty where that camera took none.
        positions: ``(N, P)`` numbers of the robot's position, or None when they cannot be told.
        targets: ``(N, T)`` numbers of the measured target poses, or None when there are none.
    """

    ids: tuple[str, ...]
    placements: tuple[str, ...]
    kinds: tuple[str, ...]
    marks: tuple[str, ...]
    images: Mapping[str, tuple[str, ...]]
    positions: Floats | None
    targets: Floats | None


def read_shots(table: CsvTable, layout: ShotLayout, findings: list[Finding]) -> Shots:
    """Columns of shots.csv; everything wrong with them is appended to ``findings``."""
    _check_columns(table, layout, findings)
    shots = Shots(
        ids=column(table, "shot"),
        placements=column(table, "placement"),
        kinds=column(table, "kind"),
        marks=column(table, "mark"),
        images={camera: column(table, f"image_{camera}") for camera in layout.cameras or ()},
        positions=numbers(table, layout.positions, findings) if layout.positions else None,
        targets=numbers(table, layout.targets, findings) if layout.targets else None,
    )
    _check_ids(table, shots, findings)
    kinds = TOUCH_KINDS if layout.touched else KINDS
    _check_kinds(table, shots.kinds, kinds, layout.fewest, findings)
    if layout.touched:
        _check_sockets(table, shots, layout.marks or (), findings)
    elif layout.marks is not None:
        _check_marks(table, shots, layout.marks, findings)
    return shots


def check_image_files(
    table: CsvTable, images: Mapping[str, Sequence[str]], folder: Path, findings: list[Finding]
) -> dict[str, Path]:
    """Image files by name, after a look at each: every cell whose file is missing or outside is found."""
    files: dict[str, Path] = {}
    for camera, names in images.items():
        for i, name in enumerate(names):
            if not name or name in files:
                continue
            try:
                files[name] = file_inside(folder, name)
            except ValueError as error:
                cure = "copy the image there, correct the name, or leave the cell empty"
                expected = "an image in the folder of the recording"
                findings.append(cell_finding(table, (i, f"image_{camera}"), str(error), expected, cure))
    for i in range(len(table.rows)):
        if images and not any(names[i] for names in images.values()):
            expected, cure = "an image of at least one camera", "name the image, or remove the shot"
            findings.append(
                cell_finding(table, (i, f"image_{next(iter(images))}"), "the shot has no image", expected, cure)
            )
    return files


def _check_columns(table: CsvTable, layout: ShotLayout, findings: list[Finding]) -> None:
    """Unknown columns can only be told when everything that asks for columns is known."""
    required = ["shot", "placement", "kind"]
    if layout.touched or (layout.marks and any(kind not in BOARD_KINDS for kind in column(table, "kind"))):
        required.append("mark")
    required += [*(layout.positions or ()), *(layout.targets or ())]
    required += [f"image_{camera}" for camera in layout.cameras or ()]
    optional = ["mark"]
    if None in {layout.positions, layout.targets, layout.cameras}:
        optional += table.header
    check_columns(table, required, optional, layout.why, findings)


def _check_ids(table: CsvTable, shots: Shots, findings: list[Finding]) -> None:
    first: dict[str, int] = {}
    for i, name in enumerate(shots.ids):
        if "shot" in table.header and not name:
            findings.append(cell_finding(table, (i, "shot"), "is empty", "a name", "name the shot"))
        elif name in first:
            what = f"'{name}' is the name of the shot in line {table.lines[first[name]]} too"
            findings.append(cell_finding(table, (i, "shot"), what, "each name once", "rename one of them"))
        if name:
            first.setdefault(name, i)
    for i, placement in enumerate(shots.placements):
        if "placement" in table.header and not placement:
            cure = "give shots of a target that did not move the same name"
            findings.append(cell_finding(table, (i, "placement"), "is empty", "a name", cure))


def _check_kinds(
    table: CsvTable, kinds: Sequence[str], allowed: Sequence[str], fewest: int, findings: list[Finding]
) -> None:
    if "kind" not in table.header:
        return
    for i, kind in enumerate(kinds):
        if kind not in allowed:
            cure = did_you_mean(kind, allowed) or "write one of them"
            what = f"is '{kind}'" if kind else "is empty"
            findings.append(cell_finding(table, (i, "kind"), what, f"one of {', '.join(allowed)}", cure))
    usable = sum(kind == CALIBRATE for kind in kinds)
    if usable < fewest:
        expected = f"at least {fewest}, better 10 or more"
        findings.append(
            Finding(table.where, "kind", f"there are {usable} calibrate shots", expected, "record more poses")
        )


def _check_marks(table: CsvTable, shots: Shots, marks: tuple[str, ...], findings: list[Finding]) -> None:
    for i, (kind, mark) in enumerate(zip(shots.kinds, shots.marks, strict=True)):
        if kind in BOARD_KINDS and mark:
            what = f"is '{mark}' in a {kind} shot"
            cure = "empty the cell, or write kind scale or verify"
            findings.append(cell_finding(table, (i, "mark"), what, "an empty cell", cure))
        elif kind in STANDARD_KINDS and not marks:
            what = f"is {kind}, but recording.yaml has no length_standard"
            findings.append(cell_finding(table, (i, "kind"), what, "a length standard", "describe it there"))
        elif kind in STANDARD_KINDS and mark not in marks and "mark" in table.header:
            what = f"is '{mark}'" if mark else "is empty"
            cure = "write which mark of the length standard the shot shows"
            findings.append(cell_finding(table, (i, "mark"), what, f"one of {', '.join(marks)}", cure))


def _check_sockets(table: CsvTable, shots: Shots, marks: tuple[str, ...], findings: list[Finding]) -> None:
    """Every touch names its socket; the standard's own sockets must be among them where anything is touched."""
    if "mark" not in table.header:
        return
    for i, mark in enumerate(shots.marks):
        if not mark:
            cure = "name the socket that the ball was in"
            findings.append(cell_finding(table, (i, "mark"), "is empty", "the name of a socket", cure))
    touched = tuple(dict.fromkeys(mark for mark in shots.marks if mark))
    for mark in marks:
        if touched and mark not in touched:
            what = f"no shot touches '{mark}', a mark of the length standard"
            expected = f"touches of {' and '.join(marks)}"
            cure = did_you_mean(mark, touched) or f"the sockets touched are {', '.join(touched)}; name them alike"
            findings.append(Finding(table.where, "mark", what, expected, cure))
