"""Which keys may tracker.yaml have, and of what type?

Only shapes and words; what needs two sections at once, or a table, is judged in ``tracker_description`` and
``tracker_rows``. This module imports pydantic and is imported only when a record is read.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, StringConstraints, Tag

from sixthlink.files.recording_schema import UnitsSection, UrdfSection
from sixthlink.files.schema_findings import UNION_TAG, one_of
from sixthlink.geometry import ORIENTATIONS

__all__ = [
    "COLUMNS",
    "DECIMALS",
    "ENCODINGS",
    "FREE",
    "GROUND_WORD",
    "OPTIONAL_SECTIONS",
    "SCHEMA",
    "SEPARATORS",
    "SIGMA_COLUMNS",
    "TRACKER_EXAMPLES",
    "TRACKER_SECTIONS",
    "UNKNOWN",
    "ColumnsSection",
    "JointsFileSection",
    "PolarSigma",
    "RobotSection",
    "SheetSection",
    "TableSection",
    "TimeSection",
]

SCHEMA = "sixthlink-tracker/1"
FREE, GROUND_WORD = "free", "ground"
UNKNOWN, SIGMA_COLUMNS = "unknown", "columns"
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
DECIMALS = {"point": ".", "comma": ","}
ENCODINGS = ("utf-8", "utf-16", "cp1252", "gb18030", "shift_jis")

COLUMNS = "columns: {x: X, y: Y, z: Z, point: Name}"

TRACKER_EXAMPLES = {
    "schema": f"schema: {SCHEMA}",
    "name": "name: left cell, March",
    "instrument": "instrument: Leica AT960",
    "units": "units: {length: mm, angle: deg}",
    "units.length": "length: mm",
    "units.angle": "angle: deg",
    "robot": "robot: {name: abb_irb1400}",
    "robot.name": "name: abb_irb1400",
    "robot.arm": "arm: my_arm.yaml",
    "robot.urdf": "urdf: {file: my_arm.urdf, base: base_link, tip: tool0}",
    "robot.urdf.file": "file: my_arm.urdf",
    "robot.urdf.base": "base: base_link",
    "robot.urdf.tip": "tip: tool0",
    "robot.kinematics": "kinematics: none",
    "robot.label": "label: two-axis positioner",
    "robot.joints": "joints: [turning, turning]",
    "robot.joints_confirmed": "joints_confirmed: true",
    "sigma": "sigma: 0.02",
    "sigma.range": "range: 0.01",
    "sigma.angle": "angle: 0.0003",
    "rotation_sigma": "rotation_sigma: 0.01",
    "reflectors": "reflectors: {R1: 6, N1: ground}",
    "sweeps": "sweeps: {A1: 1, A2: 2, cloud: free}",
    "tables": "tables: [{file: points.csv, sweep: A1, reflector: R1}]",
    "tables.file": "file: axis1.csv",
    "tables.sweep": "sweep: A1",
    "tables.reflector": "reflector: R1",
    "tables.header": "header: 3",
    "tables.separator": "separator: semicolon",
    "tables.decimal": "decimal: comma",
    "tables.encoding": "encoding: cp1252",
    "tables.units": "units: {length: in, angle: deg}",
    "tables.units.length": "length: in",
    "tables.units.angle": "angle: deg",
    "tables.columns": COLUMNS,
    "tables.columns.x": "x: X",
    "tables.columns.y": "y: Y",
    "tables.columns.z": "z: Z",
    "tables.columns.point": "point: Name",
    "tables.columns.sweep": "sweep: Sweep",
    "tables.columns.reflector": "reflector: Reflector",
    "tables.columns.joints": "joints: [q1, q2, q3, q4, q5, q6]",
    "tables.columns.angle": "angle: Position",
    "tables.columns.orientation": "orientation: [qx, qy, qz, qw]",
    "tables.columns.sigma": "sigma: [sx, sy, sz]",
    "tables.columns.covariance": "covariance: [cxx, cxy, cxz, cyy, cyz, czz]",
    "tables.columns.time": "time: Time",
    "tables.point_names": 'point_names: "{sweep}_{number}"',
    "tables.orientation": "orientation: quaternion-xyzw",
    "tables.direction": "direction: T_tracker_reflector",
    "tables.coverage": "coverage: 2",
    "tables.time": "time: {unit: s}",
    "tables.time.unit": "unit: s",
    "tables.time.format": 'format: "%d.%m.%Y %H:%M:%S.%f"',
    "tables.at": "at: [0, 0, 0, 0, 30, 0]",
    "tables.joints_file": "joints_file: {file: joints.txt, header: none, columns: [1, 2, 3, 4, 5, 6]}",
    "tables.joints_file.file": "file: joints.txt",
    "tables.joints_file.header": "header: none",
    "tables.joints_file.separator": "separator: space",
    "tables.joints_file.decimal": "decimal: point",
    "tables.joints_file.encoding": "encoding: cp1252",
    "tables.joints_file.columns": "columns: [1, 2, 3, 4, 5, 6]",
}
"""Every key, and a line that shows it."""

Positive = Annotated[float, Field(gt=0)]
Text = Annotated[str, StringConstraints(min_length=1)]
OneBased = Annotated[int, Field(ge=1)]


def _name_or_number(expected: str, *words: str, least: int = 1) -> BeforeValidator:
    """A text (one of ``words`` when there are any) or a whole number from ``least``."""

    def check(value: Any) -> Any:
        from pydantic_core import PydanticCustomError

        number = isinstance(value, int) and not isinstance(value, bool) and value >= least
        text = isinstance(value, str) and value and (not words or value in words)
        if not (number or text):
            raise PydanticCustomError("one_of", "{expected}", {"expected": expected, "cure": ""})
        return value

    return BeforeValidator(check)


def _sigma(value: Any) -> Any:
    from pydantic_core import PydanticCustomError

    if value in (UNKNOWN, SIGMA_COLUMNS):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < float("inf"):
        return float(value)
    expected = f"a number above 0, {{range: ..., angle: ...}}, {SIGMA_COLUMNS} or {UNKNOWN}"
    raise PydanticCustomError("one_of", "{expected}", {"expected": expected, "cure": ""})


def _one_or_more(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


def _word_or_mapping(value: Any) -> str:
    return f"{UNION_TAG}mapping" if isinstance(value, dict) else f"{UNION_TAG}word"


Column = Annotated[str | int, _name_or_number("the name of a column, or its number from 1")]
Link = Annotated[str | int, _name_or_number(f"the number of a link from 1, or {GROUND_WORD}", GROUND_WORD)]
Joint = Annotated[str | int, _name_or_number(f"the number of a joint from 1, or {FREE}", FREE)]
HeaderLine = Annotated[str | int, _name_or_number("the line of the header, or none", "none")]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class RobotSection(_Section):
    """Which robot."""

    name: Text | None = None
    arm: Text | None = None
    urdf: UrdfSection | None = None
    kinematics: Literal["none"] | None = None
    label: Text | None = None
    joints: Annotated[list[Literal["turning", "sliding"]], Field(min_length=1)] | None = None
    joints_confirmed: bool = False


class PolarSigma(_Section):
    """Noise of an instrument that measures a range and two angles from the origin of its frame."""

    range: Positive
    angle: Positive


class SheetSection(_Section):
    """How a table is written."""

    file: Text
    header: HeaderLine | None = None
    separator: Annotated[str, BeforeValidator(one_of(SEPARATORS))] | None = None
    decimal: Annotated[str, BeforeValidator(one_of(DECIMALS))] | None = None
    encoding: Annotated[str, BeforeValidator(one_of(ENCODINGS))] | None = None


class JointsFileSection(SheetSection):
    """Joint values that the controller wrote, row by row beside the points."""

    columns: Annotated[list[Column | None], Field(min_length=1)]


class ColumnsSection(_Section):
    """Which column is what."""

    x: Column | None = None
    y: Column | None = None
    z: Column | None = None
    point: Column | None = None
    sweep: Column | None = None
    reflector: Column | None = None
    joints: Annotated[list[Column | None], Field(min_length=1)] | None = None
    angle: Column | None = None
    orientation: Annotated[list[Column], Field(min_length=3, max_length=9)] | None = None
    sigma: Annotated[list[Column], Field(min_length=1, max_length=3)] | None = None
    covariance: Annotated[list[Column], Field(min_length=6, max_length=6)] | None = None
    time: Column | None = None


class TimeSection(_Section):
    """How a time is written."""

    unit: Annotated[str, BeforeValidator(one_of(["s", "ms", "us"]))] | None = None
    format: Text | None = None


class TableSection(SheetSection):
    """One table of points."""

    sweep: Text | None = None
    reflector: Text | None = None
    columns: ColumnsSection = ColumnsSection()
    point_names: Annotated[list[Text], BeforeValidator(_one_or_more)] = []
    units: UnitsSection | None = None
    orientation: Annotated[str, BeforeValidator(one_of(ORIENTATIONS))] | None = None
    direction: Annotated[str, BeforeValidator(one_of(["T_tracker_reflector", "T_reflector_tracker"]))] | None = None
    coverage: Positive = 1.0
    time: TimeSection | None = None
    at: list[float | None] | None = None
    joints_file: JointsFileSection | None = None


TRACKER_SECTIONS: dict[str, Any] = {
    "schema": Annotated[str, BeforeValidator(one_of([SCHEMA]))],
    "name": Text,
    "instrument": Text,
    "units": UnitsSection,
    "robot": RobotSection,
    "sigma": Annotated[
        Annotated[Annotated[float | str, BeforeValidator(_sigma)], Tag(f"{UNION_TAG}word")]
        | Annotated[PolarSigma, Tag(f"{UNION_TAG}mapping")],
        Discriminator(_word_or_mapping),
    ],
    "rotation_sigma": Positive,
    "reflectors": Annotated[dict[Text, Link], Field(min_length=1)],
    "sweeps": Annotated[dict[Text, Joint], Field(min_length=1)],
    "tables": Annotated[list[TableSection], Field(min_length=1)],
}
"""Type of each section; each is judged by itself, so that a mistake in one does not hide those in another."""

OPTIONAL_SECTIONS = frozenset({"rotation_sigma"})
"""Sections that some records do without."""
