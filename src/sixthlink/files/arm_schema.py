"""Which keys may an arm file have, and of what type?

What needs two parts of the file at once is judged in ``arm_checks``. This module imports pydantic and is
imported only when an arm file is read or written.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from sixthlink.files.schema_findings import one_of
from sixthlink.units import ANGLE_UNITS, LENGTH_UNITS

__all__ = ["EXAMPLES", "SCHEMA", "ArmFile", "StepEntry"]

SCHEMA = "sixthlink-arm/1"
"""First line of every arm file: what it is and which edition of the format."""

KINDS = ("rx", "ry", "rz", "tx", "ty", "tz")

Number = Annotated[float, Field(allow_inf_nan=False)]
Text = Annotated[str, Field(min_length=1)]
Spread = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class _Entry(BaseModel):
    """Nothing unknown, nothing converted, nothing changed later."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class UnitsEntry(_Entry):
    """Units of every length and angle in the file."""

    length: Annotated[str, BeforeValidator(one_of(LENGTH_UNITS))]
    angle: Annotated[str, BeforeValidator(one_of(ANGLE_UNITS))]


class HarmonicsEntry(_Entry):
    """Amplitudes of a joint's error once and twice per turn, in the angle unit; what is not named is zero."""

    sin: Number = 0.0
    cos: Number = 0.0
    sin2: Number = 0.0
    cos2: Number = 0.0


class JointEntry(_Entry):
    """One joint; limits in the angle unit, or in the length unit when it slides.

    ``compliance`` is how far it yields, in the angle unit, per length unit of the lever of a load at the flange.
    """

    name: Text
    lower: Number
    upper: Number
    direction: Literal[1, -1] = 1
    sliding: bool = False
    scale: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] = 1.0
    harmonics: HarmonicsEntry = HarmonicsEntry()
    compliance: Number = 0.0


class LinkEntry(_Entry):
    """One row of a DH or modified DH table."""

    theta: Number
    d: Number
    a: Number
    alpha: Number
    beta: Number | None = None


class FlangeEntry(_Entry):
    """A fixed flange behind the last link; what is not named is zero."""

    x: Number = 0.0
    y: Number = 0.0
    z: Number = 0.0
    yaw: Number = 0.0
    pitch: Number = 0.0
    roll: Number = 0.0


class CouplingEntry(_Entry):
    """Joint ``joint`` also moves by ``factor`` times joint ``driver``; numbers count from 1."""

    joint: int
    driver: int
    factor: Number


class StepEntry(_Entry):
    """One elementary turn or shift and how the joints drive it."""

    kind: Annotated[str, BeforeValidator(one_of(KINDS))]
    parameter: Text
    value: Number
    joints: dict[str, Number] = {}


class TolerancesEntry(_Entry):
    """Standard deviations that the numbers deserve; 0 means not stated."""

    length: Spread = 0.0
    angle: Spread = 0.0
    joint_repeatability: Spread = 0.0


class ArmFile(_Entry):
    """An arm file as it is written, in the units of the file."""

    schema_: Annotated[str, BeforeValidator(one_of((SCHEMA,)))] = Field(alias="schema")
    name: Text
    source: Text
    units: UnitsEntry
    convention: Annotated[str, BeforeValidator(one_of(("dh", "mdh", "steps")))]
    joints: list[JointEntry]
    links: list[LinkEntry] | None = None
    flange: FlangeEntry | None = None
    couplings: list[CouplingEntry] = []
    steps: list[StepEntry] | None = None
    tolerances: TolerancesEntry = TolerancesEntry()


EXAMPLES = {
    "schema": f"schema: {SCHEMA}",
    "name": "name: ABB IRB 1400",
    "source": "source: data sheet of the maker, page 7",
    "units": "units: {length: mm, angle: deg}",
    "units.length": "length: mm",
    "units.angle": "angle: deg",
    "convention": "convention: dh",
    "joints": "- {name: q1, lower: -170, upper: 170}",
    "joints.name": "name: q1",
    "joints.lower": "lower: -170",
    "joints.upper": "upper: 170",
    "joints.direction": "direction: -1",
    "joints.sliding": "sliding: true",
    "joints.scale": "scale: 1.0",
    "joints.harmonics": "harmonics: {sin: 0.01, cos: 0, sin2: 0, cos2: 0}",
    **{f"joints.harmonics.{wave}": f"{wave}: 0.01" for wave in ("sin", "cos", "sin2", "cos2")},
    "joints.compliance": "compliance: 0.0001",
    "links": "- {theta: 0, d: 475, a: 150, alpha: -90}",
    "links.theta": "theta: 0",
    "links.d": "d: 475",
    "links.a": "a: 150",
    "links.alpha": "alpha: -90",
    "links.beta": "beta: 0",
    "flange": "flange: {x: 0, y: 0, z: 107, yaw: 0, pitch: 0, roll: 0}",
    **{f"flange.{key}": f"{key}: 0" for key in ("x", "y", "z", "yaw", "pitch", "roll")},
    "couplings": "- {joint: 3, driver: 2, factor: -1}",
    "couplings.joint": "joint: 3",
    "couplings.driver": "driver: 2",
    "couplings.factor": "factor: -1",
    "steps": "- {kind: rz, parameter: theta1, value: 0, joints: {q1: 1}}",
    "steps.kind": "kind: rz",
    "steps.parameter": "parameter: theta1",
    "steps.value": "value: 0",
    "steps.joints": "joints: {q1: 1}",
    "tolerances": "tolerances: {length: 0.5, angle: 0.03, joint_repeatability: 0.003}",
    "tolerances.length": "length: 0.5",
    "tolerances.angle": "angle: 0.03",
    "tolerances.joint_repeatability": "joint_repeatability: 0.003",
}
"""One line per dotted key: the keys that exist, and what to write where one is missing."""
