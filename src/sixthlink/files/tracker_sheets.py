"""Which units and which decimal mark does a table have?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sixthlink.errors import Finding
from sixthlink.files.inside import file_inside
from sixthlink.files.sections import Sections, add_finding
from sixthlink.files.tracker_columns import Columns
from sixthlink.files.tracker_description import TrackerDescription, unit_factors
from sixthlink.files.tracker_grid import Grid, column_label, column_texts, grid_finding, note_texts
from sixthlink.files.tracker_numbers import as_numbers, decimal_mark, number_words, undecided
from sixthlink.files.tracker_schema import DECIMALS, SheetSection, TableSection
from sixthlink.files.tracker_units import unit_of_name, unit_of_text
from sixthlink.files.yaml_marks import Keys
from sixthlink.geometry import Floats

__all__ = ["Sheet", "TableTask", "check_units", "inside", "numbers_of", "sheet_mark", "table_finding"]


@dataclass(frozen=True)
class TableTask:
    """One table that is to be read.

    Attributes:
        sections: The sections of tracker.yaml, for the findings.
        keys: Way to the table in tracker.yaml.
        table: What tracker.yaml says of the table.
        folder: Folder of the record.
        description: What tracker.yaml says of everything else.
        inputs: SHA-256 of the files that were read, by name; grows.
    """

    sections: Sections
    keys: Keys
    table: TableSection
    folder: Path
    description: TrackerDescription
    inputs: dict[str, str]

    @property
    def findings(self) -> list[Finding]:
        """Everything found so far; grows."""
        return self.sections.findings

    @property
    def units(self) -> tuple[str, str]:
        """Units of length and angle of the table, by their names."""
        units = self.table.units
        return self.description.units if units is None else (units.length, units.angle)

    @property
    def factors(self) -> tuple[float, float]:
        """Metres and radians per unit of the table."""
        return unit_factors(self.units)


@dataclass(frozen=True)
class Sheet:
    """A table as cells.

    Attributes:
        grid: Its cells.
        columns: What its columns are.
        mark: Its decimal mark.
    """

    grid: Grid
    columns: Columns
    mark: str


def table_finding(task: TableTask, keys: Keys, what: str, expected: str, cure: str, *, at_key: bool = False) -> None:
    """Note a finding at what tracker.yaml says of the table."""
    add_finding(task.sections, (*task.keys, *keys), what, expected, cure, at_key=at_key)


def inside(task: TableTask, keys: Keys, name: str) -> Path | None:
    """A file that the table names, or None with a finding."""
    try:
        return file_inside(task.folder, name)
    except ValueError as error:
        what, cure = (
            str(error).replace("the recording", "the record"),
            "copy the file into the folder and correct the path",
        )
        table_finding(task, keys, what, "a file in the folder of the record", cure)
        return None


def sheet_mark(sheet: SheetSection, grid: Grid, places: Sequence[int], findings: list[Finding]) -> str:
    """Decimal mark that is declared, or that the numbers have; one that may stand between thousands is found.

    Args:
        sheet: How the table is said to be written.
        grid: The table.
        places: Its columns of numbers.
        findings: Grows.
    """
    if sheet.decimal is not None:
        return DECIMALS[sheet.decimal]
    columns = [column_texts(grid, k) for k in places]
    mark = decimal_mark(columns)
    place = None if mark == "." and grid.separator == "," else undecided(columns, mark)
    if place is not None:
        k, i = place
        word = "comma" if mark == "," else "point"
        what = f"is {columns[k][i].strip()[:60]!r}: with a decimal {word}, or a thousands separator?"
        cure = f"write decimal: {word} if that is so, or export without thousands separators"
        findings.append(grid_finding(grid, (i, places[k]), what, "a table whose numbers settle it", cure))
    return mark


def numbers_of(sheet: Sheet, places: Sequence[int], findings: list[Finding]) -> Floats:
    """``(N, len(places))`` numbers of some columns, 0 where there is none, which is found."""
    values = np.zeros((len(sheet.grid), len(places)))
    expected, cure = number_words(sheet.mark)
    for j, k in enumerate(places):
        texts = column_texts(sheet.grid, k)
        values[:, j], wrong = as_numbers(texts, sheet.mark)
        note_texts(sheet.grid, k, wrong, findings, expected=expected, cure=cure)
    return values


def check_units(grid: Grid, places: Sequence[int], unit: str, findings: list[Finding]) -> None:
    """Find units in the header, or under it, that are not those that tracker.yaml declares for the columns."""
    for k in dict.fromkeys(places):
        if not grid.header[k] and not grid.units:
            continue
        cure = "correct units in tracker.yaml (or units of this table), or export the table again"
        inside_name = unit_of_name(grid.header[k])
        if inside_name not in (None, unit):
            what = f"has the unit {inside_name}"
            label = column_label(grid, k)
            findings.append(Finding(grid.where, label, what, f"{unit}, as declared", cure, grid.header_line, k + 1))
        if grid.units and grid.units[k]:
            below = unit_of_text(grid.units[k])
            if below != unit:
                what = f"has the unit {below}" if below else f"has {grid.units[k][:60]!r} for a unit"
                label = column_label(grid, k)
                findings.append(Finding(grid.where, label, what, f"{unit}, as declared", cure, grid.units_line, k + 1))
