"""What stands in which cell of a CSV file?

Texts only, all of one width, each with its line; numbers are made of a few columns at a time.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sixthlink.errors import Finding
from sixthlink.files.schema_findings import did_you_mean
from sixthlink.geometry import Floats

__all__ = ["CsvTable", "cell_finding", "check_columns", "column", "numbers", "read_csv"]

MOST_BYTES = 256 * 2**20
"""Largest table that is read."""

_NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")


@dataclass(frozen=True)
class CsvTable:
    """A table of texts.

    Attributes:
        where: Name of the file, for findings.
        header: Names of the columns.
        rows: One text per column and row, without surrounding blanks.
        lines: One-based line of the file in which each row begins.
    """

    where: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]


def read_csv(path: Path, findings: list[Finding]) -> CsvTable | None:
    """A CSV file as a table, or None when it cannot be one; findings are appended.

    Rows with a wrong number of cells are found and left out.
    """
    where = str(path)
    text = _text(path, findings)
    if text is None:
        return None
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    header: tuple[str, ...] = ()
    try:
        begins = 1
        for row in reader:
            cells = tuple(cell.strip() for cell in row)
            if not any(cells):
                pass
            elif not header:
                header = cells
            elif len(cells) != len(header):
                cure = "write 1.5, not 1,5; put a text that has a comma in quotes"
                what, expected = f"has {len(cells)} cells", f"{len(header)}, one per column"
                findings.append(Finding(where, "row", what, expected, cure, begins))
            else:
                rows.append(cells)
                lines.append(begins)
            begins = reader.line_num + 1
    except csv.Error as error:
        what = f"is not CSV: {error}"
        findings.append(Finding(where, "row", what, "", "look for a quote that is not closed", reader.line_num))
        return None
    return CsvTable(where, header, tuple(rows), tuple(lines)) if _header_is_good(where, header, findings) else None


def check_columns(
    table: CsvTable, required: Iterable[str], optional: Iterable[str], why: str, findings: list[Finding]
) -> None:
    """Find columns that are missing and columns that nobody asked for.

    Args:
        table: The table.
        required: Columns that must be there.
        optional: Columns that may be there; those that begin with ``x-`` or ``note`` always may.
        why: What the required columns follow from, for the finding.
        findings: Grows.
    """
    required, optional = tuple(required), tuple(optional)
    for name in required:
        if name not in table.header:
            expected = f"the columns {', '.join(required)}{f' ({why})' if why else ''}"
            findings.append(Finding(table.where, name, "the column is missing", expected, "add it", 1))
    missing = [name for name in (*required, *optional) if name not in table.header]
    for number, name in enumerate(table.header, start=1):
        if name not in required and name not in optional and not name.startswith(("x-", "note")):
            cure = did_you_mean(name, missing) or f"remove it, or call it x-{name} if it is for people only"
            expected = ", ".join(dict.fromkeys((*required, *optional)))
            findings.append(Finding(table.where, name, "the column is not known here", expected, cure, 1, number))


def column(table: CsvTable, name: str) -> tuple[str, ...]:
    """Texts of one column; empty texts where the table has no such column."""
    if name not in table.header:
        return ("",) * len(table.rows)
    k = table.header.index(name)
    return tuple(row[k] for row in table.rows)


def numbers(table: CsvTable, columns: Sequence[str], findings: list[Finding]) -> Floats | None:
    """``(N, len(columns))`` numbers, or None when a column or a number is missing; findings are appended."""
    if any(name not in table.header for name in columns):
        return None
    before = len(findings)
    values = np.zeros((len(table.rows), len(columns)))
    places = [table.header.index(name) for name in columns]
    for i, row in enumerate(table.rows):
        for j, k in enumerate(places):
            value = float(row[k]) if _NUMBER.fullmatch(row[k]) else math.nan
            if math.isfinite(value):
                values[i, j] = value
            else:
                what = f"is '{row[k][:60]}'" if row[k] else "is empty"
                expected, cure = "a finite number", "write it with a decimal point and without unit"
                findings.append(cell_finding(table, (i, columns[j]), what, expected, cure))
    return values if len(findings) == before else None


def cell_finding(table: CsvTable, cell: tuple[int, str], what: str, expected: str = "", cure: str = "") -> Finding:
    """Finding at a cell, given by its row in the table and the name of its column."""
    row, name = cell
    number = table.header.index(name) + 1 if name in table.header else 0
    return Finding(table.where, name, what, expected, cure, table.lines[row], number)


def _text(path: Path, findings: list[Finding]) -> str | None:
    where = str(path)
    try:
        if path.stat().st_size > MOST_BYTES:
            what = f"has {path.stat().st_size} bytes"
            findings.append(Finding(where, "file", what, f"at most {MOST_BYTES}", "check that it is the right file"))
            return None
        return path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        findings.append(Finding(where, "file", "does not exist", "a table with one row per shot or point", "add it"))
    except OSError as error:
        cure = "check the rights of the file and its folder"
        findings.append(Finding(where, "file", f"cannot be read ({error.strerror})", "", cure))
    except UnicodeDecodeError as error:
        what, cure = f"byte {error.start + 1} is not UTF-8", "save it as 'CSV UTF-8'"
        findings.append(Finding(where, "file", what, "UTF-8 text", cure))
    return None


def _header_is_good(where: str, header: tuple[str, ...], findings: list[Finding]) -> bool:
    if not header:
        findings.append(Finding(where, "header", "is missing", "names of the columns in line 1", "add it", 1))
        return False
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        what = f"separates its columns by {'semicolons' if ';' in header[0] else 'tabs'}"
        cure = "export it as comma separated, with decimal points"
        findings.append(Finding(where, "header", what, "commas", cure, 1))
        return False
    before = len(findings)
    for number, name in enumerate(header, start=1):
        if not name:
            findings.append(
                Finding(where, "header", "has a column without name", "a name", "name it or remove it", 1, number)
            )
        elif name in header[: number - 1]:
            findings.append(Finding(where, name, "the column is there twice", "once", "remove one of them", 1, number))
    return len(findings) == before
