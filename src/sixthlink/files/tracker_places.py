"""To which sweep and which reflector does each row of a table belong?

Said once for the whole table, in a column, or within the names of the points, as in ``A1_03``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from sixthlink.errors import Finding
from sixthlink.files.schema_findings import did_you_mean
from sixthlink.files.tracker_grid import Grid, column_texts, note_rows, note_texts
from sixthlink.files.tracker_sheets import Sheet, TableTask, table_finding
from sixthlink.files.tracker_text import shown_name
from sixthlink.geometry import Ints
from sixthlink.recording import GROUND

__all__ = ["check_places", "row_places"]

_FIELD = re.compile(r"\{(\w*)\}")
_NOT_SAID = -1
FIELDS = ("sweep", "reflector", "number")


def check_places(task: TableTask) -> bool:
    """Whether what the table says of sweep, reflector and names makes sense; findings go to the task."""
    before, table = len(task.findings), task.table
    for what, name, known in (
        ("sweep", table.sweep, [s.name for s in task.description.sweeps]),
        ("reflector", table.reflector, [r.name for r in task.description.reflectors]),
    ):
        if name is not None and name not in known:
            word = "sweeps" if what == "sweep" else "reflectors"
            cure = did_you_mean(name, known) or f"correct it, or add it to {word}"
            table_finding(task, (what,), f"is {name!r}", f"one of {', '.join(known)}", cure)
        if name is not None and getattr(table.columns, what) is not None:
            what_is = f"is given beside {what}: {name}"
            table_finding(task, ("columns", what), what_is, "", "keep one of the two", at_key=True)
    for pattern in table.point_names:
        fields, between = _FIELD.findall(pattern), _FIELD.split(pattern)[::2]
        expected, cure = "", ""
        if not set(fields) <= set(FIELDS) or not {"sweep", "reflector"} & set(fields) or len(set(fields)) < len(fields):
            expected = "{sweep}, {reflector} or both, each once, and {number} where a number stands"
            cure = 'write for example "{sweep}_{number}"'
        elif not all(between[1:-1]):
            expected, cure = "a sign between any two fields", "write the sign that stands there in the names"
        if expected:
            table_finding(task, ("point_names",), f"is {pattern!r}", expected, cure)
    return len(task.findings) == before


def row_places(task: TableTask, sheet: Sheet) -> tuple[tuple[str, ...], Ints, Ints] | None:
    """Name, index of the sweep (-1 on the ground) and index of the reflector of each row, or None with findings."""
    grid, columns, table = sheet.grid, sheet.columns, task.table
    before, N = len(task.findings), len(grid)
    names = ("",) * N if columns.point is None else tuple(map(shown_name, column_texts(grid, columns.point)))
    sweeps, reflectors = task.description.sweeps, task.description.reflectors
    sweep_names, reflector_names = [s.name for s in sweeps], [r.name for r in reflectors]
    sweep_of = _constant_or_column(grid, table.sweep, columns.sweep, sweep_names)
    reflector_of = _constant_or_column(grid, table.reflector, columns.reflector, reflector_names)
    by_name = _from_names(task, names) if table.point_names else None
    if by_name is not None:  # a column is nearer to the point than its name, and its name than the table
        sweep_of = sweep_of if columns.sweep is not None else _first(by_name[0], sweep_of)
        reflector_of = reflector_of if columns.reflector is not None else _first(by_name[1], reflector_of)
    if reflector_of is None or (columns.reflector is None and (reflector_of == _NOT_SAID).all()):
        _say(grid, "reflector", reflector_names[0], task.findings)
        return None
    ground = np.array([r.link == GROUND for r in reflectors])[reflector_of] & (reflector_of >= 0)
    if by_name is not None:
        _check_names(task, sheet, ~by_name[2] & ~ground)
    _unknown(grid, (columns.reflector, columns.point), reflector_of, reflector_names, task.findings)
    if sweep_of is None and not ground.all():
        _say(grid, "sweep", sweep_names[0], task.findings)
    sweep_of = np.where(ground, 0, 0 if sweep_of is None else sweep_of)
    _unknown(grid, (columns.sweep, columns.point), sweep_of, sweep_names, task.findings)
    if len(task.findings) > before:
        return None
    sweep_of = np.where(ground, -1, sweep_of)
    _check_motion(task, sheet, sweep_of, reflector_of)
    return (names, sweep_of, reflector_of) if len(task.findings) == before else None


def _first(by_name: Ints, otherwise: Ints | None) -> Ints:
    return by_name if otherwise is None else np.where(by_name >= 0, by_name, otherwise)


def _constant_or_column(grid: Grid, name: str | None, k: int | None, known: list[str]) -> Ints | None:
    if name is not None:
        return np.full(len(grid), known.index(name), dtype=np.int64)
    if k is None:
        return None
    index = {n: i for i, n in enumerate(known)}
    return np.array([index.get(shown_name(text), -1) for text in column_texts(grid, k)], dtype=np.int64)


def _unknown(
    grid: Grid, places: tuple[int | None, ...], index: Ints, known: list[str], findings: list[Finding]
) -> None:
    """Find names that were not declared, in the first of the columns that there is."""
    for k in [k for k in places if k is not None][:1]:
        expected, cure = f"one of {', '.join(known)}", "correct it, or name it in tracker.yaml"
        note_texts(grid, k, np.flatnonzero(index < 0), findings, expected=expected, cure=cure)


def _from_names(task: TableTask, names: Sequence[str]) -> tuple[Ints, Ints, npt.NDArray[np.bool_]]:
    """Sweep and reflector by the names of points, and which names say anything; one that fits twice does not."""
    known = ([s.name for s in task.description.sweeps], [r.name for r in task.description.reflectors])
    # The longest names first and the shortest first: where both agree there is no other way.
    ways = [_regex(p, known, longest_first=first) for p in task.table.point_names for first in (True, False)]
    sweep_index, reflector_index = ({n: i for i, n in enumerate(words)} for words in known)
    # Where each pattern ends in a number, the number says nothing: a million names are then a few.
    numbered = all(p.endswith("{number}") and not p[:-8][-1:].isdigit() for p in task.table.point_names)
    stems = [_stem(name) for name in names] if numbered else names
    found: dict[str, int] = {stem: k for k, stem in enumerate(dict.fromkeys(stems))}
    table = np.zeros((len(found), 3), dtype=np.int64)
    for stem, k in found.items():
        parts = [match.groupdict() for way in ways if (match := way.fullmatch(stem))]
        places = {
            (sweep_index.get(p.get("sweep", ""), _NOT_SAID), reflector_index.get(p.get("reflector", ""), _NOT_SAID))
            for p in parts
        }
        table[k] = (*places.pop(), 1) if len(places) == 1 else (0, 0, 0)
    rows = table[np.fromiter(map(found.__getitem__, stems), np.int64, len(stems))]
    return rows[:, 0], rows[:, 1], rows[:, 2] > 0


def _stem(name: str) -> str:
    """A name with 0 for the number at its end."""
    stem = name.rstrip("0123456789")
    return name if len(stem) == len(name) else f"{stem}0"


def _check_names(task: TableTask, sheet: Sheet, wrong: npt.NDArray[np.bool_]) -> None:
    words = [s.name for s in task.description.sweeps] + [r.name for r in task.description.reflectors]
    expected = f"a name like {' or '.join(task.table.point_names)} with one of {', '.join(words)}"
    cure = "correct the name, or point_names in tracker.yaml"
    note_texts(sheet.grid, sheet.columns.point or 0, np.flatnonzero(wrong), task.findings, expected=expected, cure=cure)


def _regex(pattern: str, known: tuple[list[str], list[str]], *, longest_first: bool) -> re.Pattern[str]:
    words = {
        field: "|".join(re.escape(n) for n in sorted(names, key=len, reverse=longest_first))
        for field, names in zip(("sweep", "reflector"), known, strict=True)
    }
    words["number"] = "[0-9]+"
    parts = _FIELD.split(pattern)
    text = "".join(
        re.escape(literal) + (f"(?P<{field}>{words[field]})" if field else "")
        for literal, field in zip(parts[::2], [*parts[1::2], ""], strict=True)
    )
    return re.compile(text)


def _check_motion(task: TableTask, sheet: Sheet, sweep_of: Ints, reflector_of: Ints) -> None:
    """A reflector must sit on a link that the joint of the sweep moves."""
    sweeps, reflectors, columns = task.description.sweeps, task.description.reflectors, sheet.columns
    moved = np.array([-1 if s.joint is None else s.joint for s in sweeps], dtype=np.int64)[sweep_of]
    links = np.array([r.link for r in reflectors], dtype=np.int64)[reflector_of]
    still = np.flatnonzero((sweep_of >= 0) & (links <= moved))
    if not len(still):
        return
    i = int(still[0])
    reflector, sweep = reflectors[int(reflector_of[i])], sweeps[int(sweep_of[i])]
    what = f"reflector {reflector.name!r} sits on link {reflector.link}, which joint {moved[i] + 1} does not move"
    expected = f"link {moved[i] + 1} or one behind it in sweep {sweep.name!r}"
    cure = "correct reflectors or sweeps in tracker.yaml"
    k = next((c for c in (columns.reflector, columns.point, *columns.xyz) if c is not None), 0)
    note_rows(sheet.grid, k, still[:1], lambda _: what, task.findings, expected=expected, cure=cure)


def _say(grid: Grid, what: str, example: str, findings: list[Finding]) -> None:
    expected = f"{what} in tracker.yaml, a column of that name, or point_names"
    cure = f'write for example "{what}: {example}"'
    line = grid.header_line or int(grid.lines[0])
    findings.append(Finding(grid.where, what, "is not said for this table", expected, cure, line))
