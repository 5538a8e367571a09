"""Which column of an instrument's table is what?

Columns are named in tracker.yaml, or recognised by the names that instruments write in six languages, if only one
column can be meant.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sixthlink.errors import Finding
from sixthlink.files.schema_findings import did_you_mean
from sixthlink.files.tracker_schema import TableSection
from sixthlink.files.tracker_units import bare_name

__all__ = ["Columns", "columns_of", "find_column"]

RECOGNISED = {
    "x": ("x", "xcoord", "xcoordinate", "xkoordinate", "coordx", "coordonnéex", "coordinatax", "coordenadax",
          "x坐标", "x座標"),
    "y": ("y", "ycoord", "ycoordinate", "ykoordinate", "coordy", "coordonnéey", "coordinatay", "coordenaday",
          "y坐标", "y座標"),
    "z": ("z", "zcoord", "zcoordinate", "zkoordinate", "coordz", "coordonnéez", "coordinataz", "coordenadaz",
          "z坐标", "z座標"),
    "point": ("point", "pointname", "pointid", "target", "targetname", "name", "punkt", "punktname", "punktnr",
              "punktnummer", "nomdupoint", "nom", "punto", "nomepunto", "nome", "nombre", "nombredelpunto",
              "点", "点名", "点号", "名称"),
    "sweep": ("sweep",),
    "reflector": ("reflector", "smr", "reflektor", "réflecteur", "riflettore", "反射球", "靶球"),
}  # fmt: skip
"""Names of columns, in small letters and without anything but letters and figures."""

COVARIANCE = ("cxx", "cxy", "cxz", "cyy", "cyz", "czz")


@dataclass(frozen=True)
class Columns:
    """Numbers of the columns from 0; None or empty where the table has none.

    Attributes:
        xyz: The position.
        point: Name of the point.
        sweep: Name of the sweep.
        reflector: Name of the reflector.
        joints: One per joint, None for a joint that was not recorded.
        angle: The joint that the sweep moves.
        orientation: Fields of the orientation.
        sigma: One standard deviation for all axes, or one per axis.
        covariance: xx, xy, xz, yy, yz, zz.
        time: The time.
    """

    xyz: tuple[int, ...]
    point: int | None
    sweep: int | None
    reflector: int | None
    joints: tuple[int | None, ...]
    angle: int | None
    orientation: tuple[int, ...]
    sigma: tuple[int, ...]
    covariance: tuple[int, ...]
    time: int | None

    def numbers(self) -> tuple[int, ...]:
        """Columns that hold numbers in every row."""
        return (*self.xyz, *self.orientation, *self.sigma, *self.covariance)

    def joint_numbers(self) -> tuple[int, ...]:
        """Columns that hold joint values."""
        return (*(k for k in self.joints if k is not None), *((self.angle,) if self.angle is not None else ()))


def columns_of(
    where: str, line: int, header: Sequence[str], table: TableSection, findings: list[Finding]
) -> Columns | None:
    """The columns of a table, or None when one is missing or could be two; findings are appended.

    Args:
        where: Name of the file.
        line: Line of the header.
        header: Names of the columns; empty texts without a header.
        table: What tracker.yaml says of the table.
        findings: Grows.
    """
    before, named = len(findings), table.columns

    def one(spec: str | int | None) -> int | None:
        return None if spec is None else find_column(where, line, header, spec, findings)

    def several(specs: Iterable[str | int | None] | None) -> tuple[int | None, ...]:
        return tuple(one(spec) for spec in specs or ())

    def known(role: str, spec: str | int | None, *, needed: bool) -> int | None:
        return one(spec) if spec is not None else _recognised(where, line, header, role, findings, needed=needed)

    columns = Columns(
        xyz=tuple(k for a in "xyz" if (k := known(a, getattr(named, a), needed=True)) is not None),
        point=known("point", named.point, needed=bool(table.point_names)),
        sweep=None if table.sweep is not None else known("sweep", named.sweep, needed=False),
        reflector=None if table.reflector is not None else known("reflector", named.reflector, needed=False),
        joints=several(named.joints),
        angle=one(named.angle),
        orientation=tuple(k for k in several(named.orientation) if k is not None),
        sigma=tuple(k for k in several(named.sigma) if k is not None),
        covariance=tuple(k for k in several(named.covariance) if k is not None),
        time=one(named.time),
    )
    return columns if len(findings) == before else None


def find_column(where: str, line: int, header: Sequence[str], spec: str | int, findings: list[Finding]) -> int | None:
    """Number from 0 of the column that is named or numbered from 1; None when there is no such column, or two."""
    if isinstance(spec, int):
        if spec <= len(header):
            return spec - 1
        what, cure = f"the table has {len(header)} columns", "correct the number in tracker.yaml"
        findings.append(Finding(where, f"column {spec}", what, f"at least {spec}", cure, line))
        return None
    wanted = " ".join(spec.split())
    places = [k for k, name in enumerate(header) if name == wanted]
    places = places or [k for k, name in enumerate(header) if name and bare_name(name) == wanted]
    label = wanted if wanted.isprintable() else repr(wanted)
    if not any(header):
        cure = "write the number of the column instead, from 1"
        findings.append(Finding(where, label, "the table has no header", "a number", cure, line))
    elif not places:
        cure = did_you_mean(wanted, [n for n in header if n]) or "correct the name in tracker.yaml, or add the column"
        findings.append(Finding(where, label, "the column is missing", _listed(header), cure, line))
    elif len(places) > 1:
        _twice(where, line, label, places, findings)
    else:
        return places[0]
    return None


def _recognised(
    where: str, line: int, header: Sequence[str], role: str, findings: list[Finding], *, needed: bool
) -> int | None:
    names = RECOGNISED[role]
    places = [k for k, name in enumerate(header) if _plain(bare_name(name)) in names]
    if len(places) > 1 and (needed or role != "point"):
        _twice(where, line, role, places, findings)
    if len(places) == 1:
        return places[0]
    if needed and not places:
        example = f"{role}: {'X' if role == 'x' else 3}" if any(header) else f"{role}: 2"
        cure = f'name it in tracker.yaml, for example "columns: {{{example}}}"'
        expected = _listed(header) if any(header) else "the number of the column, as there is no header"
        findings.append(Finding(where, role, "no column is known to be this", expected, cure, line))
    return None


def _twice(where: str, line: int, label: str, places: list[int], findings: list[Finding]) -> None:
    what = f"may be column {' or '.join(str(k + 1) for k in places)}"
    cure = "rename one of them, or write the number of the column in tracker.yaml"
    findings.append(Finding(where, label, what, "one column", cure, line, places[1] + 1))


def _listed(header: Sequence[str]) -> str:
    names = [name if name.isprintable() else repr(name) for name in header if name]
    shown = ", ".join(names[:12]) + (" ..." if len(names) > 12 else "")
    return f"one of the columns {shown}"


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "", name.casefold())
