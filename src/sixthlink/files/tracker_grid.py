"""What stands in which cell of an instrument's table?

Comma, semicolon, tab or blanks: of these the one is taken under which the table is a table with numbers where numbers
belong. Where two would do and give different numbers, the table is refused.
"""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sixthlink.errors import Finding
from sixthlink.files.tracker_cells import open_line, padded, separator_word, split_rows, trimmed
from sixthlink.files.tracker_numbers import looks_like_number
from sixthlink.files.tracker_schema import SEPARATORS, SheetSection
from sixthlink.files.tracker_text import kept_lines, table_text
from sixthlink.files.tracker_units import is_unit_row
from sixthlink.geometry import Ints

__all__ = [
    "MOST_FINDINGS",
    "Grid",
    "NumberColumns",
    "column_label",
    "column_texts",
    "grid_finding",
    "note_rows",
    "read_grid",
    "reads",
]

MOST_FINDINGS = 20
"""Findings of one kind in one column that are listed; a last one counts the rest."""

SAMPLE = 50
"""Rows on which a separator has to prove itself before the whole table is read with it."""

NumberColumns = Callable[[tuple[str, ...]], Sequence[int] | None]
"""From the header, empty texts where there is none, to the columns that hold numbers; None when one is missing."""


@dataclass(frozen=True)
class Grid:
    """A table of texts of one width.

    Attributes:
        where: Name of the file, for findings.
        header: Names of the columns, empty texts where they have none.
        header_line: Line of the header, 0 when there is none.
        separator: What stands between cells.
        units: Cells of the row of units under the header, empty when there is none.
        units_line: Line of the row of units.
        cells: All cells below, row by row.
        lines: ``(N,)`` line of each row.
    """

    where: str
    header: tuple[str, ...]
    header_line: int
    separator: str
    units: tuple[str, ...]
    units_line: int
    cells: list[str]
    lines: Ints

    def __len__(self) -> int:
        return len(self.lines)


def column_texts(grid: Grid, k: int) -> list[str]:
    """Texts of one column, with the blanks around them."""
    return grid.cells[k :: len(grid.header)]


def reads(text: str) -> str:
    """What a cell says, in words that no text can spoil."""
    return f"is {text.strip()[:60]!r}" if text.strip() else "is empty"


def grid_finding(grid: Grid, cell: tuple[int, int], what: str, expected: str, cure: str) -> Finding:
    """Finding at a cell, given by row and column from 0."""
    row, k = cell
    return Finding(grid.where, column_label(grid, k), what, expected, cure, int(grid.lines[row]), k + 1)


def column_label(grid: Grid, k: int) -> str:
    """Name of a column for people."""
    name = grid.header[k]
    return (name if name.isprintable() else repr(name)) or f"column {k + 1}"


def note_rows(
    grid: Grid, k: int, rows: Ints, what: Callable[[int], str], findings: list[Finding], *, expected: str, cure: str
) -> None:
    """Findings at rows of one column, the first ones each by itself."""
    findings.extend(grid_finding(grid, (int(i), k), what(int(i)), expected, cure) for i in rows[:MOST_FINDINGS])
    if len(rows) > MOST_FINDINGS:
        more = f"{len(rows) - MOST_FINDINGS} more rows have the same mistake"
        findings.append(grid_finding(grid, (int(rows[MOST_FINDINGS]), k), more, expected, cure))


def note_texts(grid: Grid, k: int, rows: Ints, findings: list[Finding], *, expected: str, cure: str) -> None:
    """Findings at rows of one column that say what stands there."""
    texts = column_texts(grid, k)
    note_rows(grid, k, rows, lambda i: reads(texts[i]), findings, expected=expected, cure=cure)


def read_grid(path: Path, sheet: SheetSection, numbers: NumberColumns, findings: list[Finding]) -> Grid | None:
    """A table as cells, or None when it cannot be one; findings are appended.

    Args:
        path: The file.
        sheet: How it is said to be written.
        numbers: Which columns hold numbers.
        findings: Grows.
    """
    where = str(path)
    text = table_text(path, sheet.encoding, findings)
    if text is None:
        return None
    with_header = sheet.header != "none"
    lines, places, comments = kept_lines(text, sheet.header if isinstance(sheet.header, int) else 1)
    if len(lines) < 1 + with_header:
        expected = "a header and rows below it" if with_header else "rows of numbers"
        findings.append(Finding(where, "table", "has no rows", expected, "check that it is the right file"))
        return None
    separator = _separator(where, sheet, (lines, places), numbers, findings)
    if separator is None:
        return None
    grid = _whole_grid(where, (lines, places), separator, numbers, findings, with_header=with_header)
    if grid is not None:
        _check_comments(grid, text, comments, numbers(grid.header), findings)
    return grid


def _separator(
    where: str, sheet: SheetSection, kept: tuple[list[str], Ints], numbers: NumberColumns, findings: list[Finding]
) -> str | None:
    """The separator that is declared, or the only one that makes sense."""
    if sheet.separator is not None:
        return SEPARATORS[sheet.separator]
    with_header = sheet.header != "none"
    lines, places = kept
    sample = lines[: SAMPLE + 2]
    # A tab never stands within a cell: where there are tabs, blanks do not separate.
    words = [s for s in SEPARATORS.values() if s != " " or not any("\t" in line for line in sample)]
    trials = {s: _trial(sample, s, numbers, with_header=with_header) for s in words}
    best = max(score for score, _ in trials.values())
    good = [s for s in words if trials[s][0] == best]
    if best == _PERFECT and len(good) > 1:
        trials = {s: _trial(lines, s, numbers, with_header=with_header) for s in good}
        good = [s for s in good if trials[s][0] == _PERFECT] or good
    cure = "write which it is, for example separator: semicolon"
    if best == _PERFECT and len({trials[s][1] for s in good}) > 1:
        what = f"reads as a table with {' and with '.join(separator_word(s) for s in good)} between the cells"
        findings.append(Finding(where, "table", what, "one way to read it", cure, int(places[0])))
        return None
    chosen = good[0]
    marked = any("." in cell for row in trials[chosen][1] for cell in row)
    if chosen == "," and best == _PERFECT and not with_header and not marked:
        what = "has commas only: they may stand between the cells or within the numbers"
        cure = "write separator: comma, or export with another separator or with decimal points"
        findings.append(Finding(where, "table", what, "one way to read it", cure, int(places[0])))
        return None
    return chosen


_PERFECT = 3
"""Score of a separator under which nothing in the sample is wrong."""


def _trial(
    lines: list[str], separator: str, numbers: NumberColumns, *, with_header: bool
) -> tuple[int, tuple[tuple[str, ...], ...]]:
    """How well a separator explains the first lines, and the texts of the numbers under it."""
    try:
        rows = [trimmed(row) for row in split_rows(lines, separator)]
    except csv.Error:
        return 0, ()
    header = tuple(rows[0]) if with_header else ("",) * len(rows[0])
    columns = numbers(header)
    if columns is None:
        return (1 if len(header) > 1 else 0), ()
    body = rows[1:] if with_header else rows
    if with_header and body and _units_of(body[0], len(header), separator, columns):
        body = body[1:]
    if not body or any(len(row) != len(header) for row in (padded(row, len(header)) for row in body)):
        return 2, ()
    texts = tuple(tuple(padded(row, len(header))[k].strip() for k in columns) for row in body)
    good = all(looks_like_number(cell) for row in texts for cell in row)
    return (_PERFECT if good else 2), texts


def _units_of(row: list[str], width: int, separator: str, numbers: Sequence[int]) -> tuple[str, ...]:
    """Cells of a row of units, empty when it is none; blanks between cells do not show which of them are empty."""
    cells = padded(row, width)
    if separator != " ":
        cells = cells + [""] * (width - len(cells))
    return tuple(cell.strip() for cell in cells) if len(cells) == width and is_unit_row(cells, numbers) else ()


def _whole_grid(
    where: str,
    kept: tuple[list[str], Ints],
    separator: str,
    numbers: NumberColumns,
    findings: list[Finding],
    *,
    with_header: bool,
) -> Grid | None:
    lines, places = kept
    try:
        first = trimmed(split_rows(lines[:1], separator)[0])
    except csv.Error as error:
        cure = "look for a quote that is not closed"
        findings.append(Finding(where, "header", f"is not a table: {error}", "", cure, int(places[0])))
        return None
    width = len(first)
    body, rows = lines[with_header:], places[with_header:]
    units: tuple[str, ...] = ()
    units_line = 0
    header = tuple(" ".join(name.split()) for name in first) if with_header else ("",) * width
    columns = numbers(header)
    if with_header and body and columns is not None:
        with contextlib.suppress(csv.Error):
            units = _units_of(split_rows(body[:1], separator)[0], width, separator, columns)
        if units:
            units_line = int(rows[0])
            body, rows = body[1:], rows[1:]
    cells, rows = _cells(where, (body, rows), separator, width, findings)
    if not len(rows):
        if not findings:
            findings.append(
                Finding(where, "table", "has no rows", "rows of numbers", "check that it is the right file")
            )
        return None
    return Grid(where, header, int(places[0]) if with_header else 0, separator, units, units_line, cells, rows)


def _cells(
    where: str, kept: tuple[list[str], Ints], separator: str, width: int, findings: list[Finding]
) -> tuple[list[str], Ints]:
    """Cells of the rows that have the right number of them; the other rows are found."""
    lines, places = kept
    plain = separator != " " and not any('"' in line for line in lines)
    if plain and all(line.count(separator) == width - 1 for line in lines):
        return (separator.join(lines).split(separator) if lines else []), places
    try:
        rows = [padded(row, width) for row in split_rows(lines, separator)]
    except csv.Error as error:
        cure = "look for a quote that is not closed"
        line = int(places[open_line(lines, separator)])
        findings.append(Finding(where, "row", f"is not a table: {error}", "", cure, line))
        return [], places[:0]
    sizes = np.array([len(row) for row in rows], dtype=np.int64)
    wrong = np.flatnonzero(sizes != width)
    expected = f"{width}, separated by {separator_word(separator)}"
    cure = "complete the row, or take it out"
    for i in wrong[:MOST_FINDINGS]:
        what = f"has {sizes[i]} cell{'s' if sizes[i] != 1 else ''}"
        findings.append(Finding(where, "row", what, expected, cure, int(places[i])))
    if len(wrong) > MOST_FINDINGS:
        what = f"{len(wrong) - MOST_FINDINGS} more rows have the same mistake"
        findings.append(Finding(where, "row", what, expected, cure, int(places[wrong[MOST_FINDINGS]])))
    right = np.flatnonzero(sizes == width)
    return [cell for i in right for cell in rows[i]], places[right]


def _check_comments(
    grid: Grid, text: str, comments: list[int], numbers: Sequence[int] | None, findings: list[Finding]
) -> None:
    """A point may be called ``#1``: a comment that reads as a row of the table is nobody's to leave out."""
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n") if comments and numbers else []
    for number in comments if lines else []:
        try:
            row = padded(split_rows([lines[number - 1]], grid.separator)[0], len(grid.header))
        except csv.Error:
            continue
        if len(row) == len(grid.header) and all(looks_like_number(row[k]) for k in numbers or ()):
            what = f"begins with {lines[number - 1].lstrip()[0]!r} like a comment, but has the numbers of a point"
            cure = "put the name of the point in quotes, or take the line out"
            findings.append(Finding(grid.where, "row", what, "a point or a comment", cure, number))
