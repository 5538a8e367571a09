"""How does a study keep every finished trial, so that nothing is computed twice and nothing is lost?

One CSV file. Line 1 is a comment with the settings; every further line is one number of one trial. Finished trials are
appended, each in one piece; a trial that a power cut left unfinished is dropped on the next reading. The finished table
is put in the order of cells and trials, so that it does not tell where and in which turn it was computed.
"""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from sixthlink.errors import Finding, InputError
from sixthlink.files.atomic import atomic_write_text
from sixthlink.study import CHI2, FAILED, Row

__all__ = ["append_trial", "read_study", "write_study"]

TITLE = "# sixthlink study "
COLUMNS = (
    "point",
    "trial",
    "quantity",
    "unit",
    "truth",
    "estimate",
    "std",
    "bound_std",
    "efficient_error",
    "inside_95",
)


def write_study(path: Path, settings: Mapping[str, Any], rows: Iterable[Row]) -> None:
    """Write a whole table, in the order of cells and trials; the rows of one trial stay in their order."""
    ordered = sorted(rows, key=lambda row: (row.point, row.trial))
    head = f"{TITLE}{json.dumps(settings, ensure_ascii=False)}\n{','.join(COLUMNS)}\n"
    atomic_write_text(path, head + _lines(ordered))


def append_trial(path: Path, rows: Sequence[Row]) -> None:
    """Add one finished trial to a table, in one piece, and see it to the disk."""
    with path.open("ab") as file:
        file.write(_lines(rows).encode("utf-8"))
        file.flush()
        os.fsync(file.fileno())


def read_study(path: Path) -> tuple[dict[str, Any], list[Row]]:
    """Settings and finished trials of a table.

    Raises:
        InputError: The file is no table of a study.
    """
    try:
        text = path.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as problem:
        raise _no_table(path, f"cannot be read ({problem})") from problem
    first, _, rest = text.partition("\n")
    if not first.startswith(TITLE):
        raise _no_table(path, "does not begin with '# sixthlink study'")
    try:
        settings = json.loads(first.removeprefix(TITLE))
    except ValueError as problem:
        raise _no_table(path, "has settings in line 1 that are no JSON") from problem
    # What stands behind the last line end was not written to its end.
    whole = rest[: rest.rfind("\n") + 1]
    lines = csv.reader(io.StringIO(whole))
    if tuple(next(lines, ())) != COLUMNS:
        raise _no_table(path, "has other columns in line 2")
    rows: list[Row] = []
    pending: list[Row] = []
    for number, cells in enumerate(lines, start=3):
        row = _row(path, number, cells)
        if pending and (row.point, row.trial) != (pending[0].point, pending[0].trial):
            pending = []
        pending.append(row)
        if row.quantity in (CHI2, FAILED):
            rows += pending
            pending = []
    return settings, rows


def _row(path: Path, number: int, cells: Sequence[str]) -> Row:
    try:
        point, trial, quantity, unit, truth, estimate, std, bound_std, efficient_error, _ = cells
        return Row(
            int(point),
            int(trial),
            quantity,
            unit,
            float(truth),
            float(estimate),
            float(std),
            float(bound_std),
            float(efficient_error),
        )
    except ValueError as problem:
        raise _no_table(path, "is no row of a study", number) from problem


def _lines(rows: Iterable[Row]) -> str:
    return "".join(
        f"{r.point},{r.trial},{r.quantity},{r.unit},{r.truth!r},{r.estimate!r},{r.std!r},{r.bound_std!r},"
        f"{r.efficient_error!r},{int(r.inside_95)}\n"
        for r in rows
    )


def _no_table(path: Path, what: str, line: int = 0) -> InputError:
    cure = "name a file that a study wrote, or one that does not exist yet"
    return InputError([Finding(str(path), "file", what, "the table of a study", cure, line)])
