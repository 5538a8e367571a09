"""When was each point of a table measured?"""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from sixthlink.files.tracker_grid import column_texts, note_texts
from sixthlink.files.tracker_numbers import as_numbers
from sixthlink.files.tracker_sheets import Sheet, TableTask, table_finding
from sixthlink.geometry import Floats

__all__ = ["check_time", "row_times"]

_SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


def check_time(task: TableTask) -> bool:
    """Whether a column of times comes with what its cells mean; findings go to the task."""
    column, time = task.table.columns.time, task.table.time
    if column is not None and (time is None or (time.unit is None) == (time.format is None)):
        cure = "write for example 'time: {unit: s}' or 'time: {format: \"%d.%m.%Y %H:%M:%S.%f\"}'"
        what = "is missing" if time is None else "is not clear"
        table_finding(task, ("time",), what, "either the unit or the format of the times", cure)
        return False
    if column is None and time is not None:
        cure = "write for example 'columns: {time: Time}', or remove it"
        table_finding(task, ("time",), "has no column of times", "columns.time", cure, at_key=True)
        return False
    return True


def row_times(task: TableTask, sheet: Sheet) -> Floats | None:
    """Times ``(N,)`` [s] of the rows, since 1970 where they are dates; None without them, or with findings."""
    k, time, grid = sheet.columns.time, task.table.time, sheet.grid
    if k is None or time is None:
        return None
    texts = column_texts(grid, k)
    if time.format is None:
        values, wrong = as_numbers(texts, sheet.mark)
        expected, cure = "a finite number", "correct it, or take columns.time out of tracker.yaml"
        note_texts(grid, k, wrong, task.findings, expected=expected, cure=cure)
        return values * _SECONDS[time.unit or "s"] if not len(wrong) else None
    values, bad = np.zeros(len(grid)), []
    for i, text in enumerate(texts):
        try:  # Leica's software writes an apostrophe before a time, to keep spreadsheets from changing it
            moment = datetime.strptime(text.strip().removeprefix("'"), time.format)
            values[i] = (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
        except ValueError:
            bad.append(i)
    expected = f"a time like {datetime(2026, 11, 25, 13, 45, 6, tzinfo=UTC).strftime(time.format)}"
    cure = "correct time.format in tracker.yaml, or the time"
    rows = np.array(bad, dtype=np.int64)
    note_texts(grid, k, rows, task.findings, expected=expected, cure=cure)
    return values if not bad else None
