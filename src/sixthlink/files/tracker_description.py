"""What does tracker.yaml say, once all its sections are taken together?"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sixthlink.errors import InputError
from sixthlink.files.recording_robot import robot_of
from sixthlink.files.recording_schema import RobotSection as RecordingRobot
from sixthlink.files.schema_findings import said
from sixthlink.files.sections import Sections, add_finding, note_unknown_sections, take_section
from sixthlink.files.shot_positions import joint_units
from sixthlink.files.tracker_schema import (
    FREE,
    GROUND_WORD,
    OPTIONAL_SECTIONS,
    TRACKER_EXAMPLES,
    TRACKER_SECTIONS,
    PolarSigma,
    RobotSection,
    TableSection,
)
from sixthlink.files.yaml_marks import MarkedYaml, read_yaml
from sixthlink.recording import GROUND, Reflector, Sweep
from sixthlink.robot import Arm
from sixthlink.units import ANGLE_UNITS, LENGTH_UNITS

__all__ = ["TrackerDescription", "TrackerRobot", "tracker_description", "tracker_sections", "unit_factors"]


@dataclass(frozen=True)
class TrackerRobot:
    """The robot of a tracker record.

    Attributes:
        name: Name for people.
        arm: Kinematics as far as known beforehand, or None.
        turning: ``(J,)`` whether a joint turns; the others slide.
        confirmed: Whether the user confirmed joint values that look as if their unit were another.
        inputs: SHA-256 of the files that were read, by name.
    """

    name: str
    arm: Arm | None
    turning: npt.NDArray[np.bool_]
    confirmed: bool
    inputs: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class TrackerDescription:
    """What every table of a record needs to know.

    Attributes:
        units: Unit of length and unit of angle, by their names.
        robot: The robot.
        sweeps: The sweeps.
        reflectors: The reflectors.
        sigma: Standard deviation of each coordinate or of range and angles, in the file's units, ``columns``,
            ``unknown``, or None while it is not understood.
        tables: The tables.
    """

    units: tuple[str, str]
    robot: TrackerRobot
    sweeps: tuple[Sweep, ...]
    reflectors: tuple[Reflector, ...]
    sigma: float | str | PolarSigma | None
    tables: tuple[TableSection, ...]


def tracker_sections(path: Path) -> Sections:
    """Sections of tracker.yaml of the right shape, each judged by itself; a file that cannot be read has none."""
    try:
        marked = read_yaml(path)
    except InputError as error:
        return Sections(MarkedYaml(str(path), None, {}, {}), findings=list(error.findings))
    sections = Sections(marked)
    if not isinstance(marked.value, dict):
        cure = "begin with the example in docs/formats.md"
        add_finding(sections, (), said(marked.value), "a mapping of sections", cure)
        return sections
    note_unknown_sections(sections, TRACKER_SECTIONS, "a tracker record")
    for key, type_ in TRACKER_SECTIONS.items():
        take_section(sections, key, type_, TRACKER_EXAMPLES, optional=key in OPTIONAL_SECTIONS)
    return sections


def tracker_description(sections: Sections, folder: Path) -> TrackerDescription | None:
    """What the sections say together, or None when the tables cannot be read; findings go to ``sections``."""
    robot = _robot(sections, folder)
    sweeps, reflectors = _sweeps(sections, robot), _reflectors(sections, robot)
    units, tables = sections.valid.get("units"), sections.valid.get("tables")
    if robot is None or sweeps is None or reflectors is None or units is None or tables is None:
        return None
    return TrackerDescription(
        units=(units.length, units.angle),
        robot=robot,
        sweeps=sweeps,
        reflectors=reflectors,
        sigma=sections.valid.get("sigma"),
        tables=tuple(tables),
    )


def _robot(sections: Sections, folder: Path) -> TrackerRobot | None:
    section: RobotSection | None = sections.valid.get("robot")
    if section is None:
        return None
    if section.kinematics is None:
        if section.joints is not None:
            what = "is only for a robot with kinematics: none"
            add_finding(sections, ("robot", "joints"), what, "", "remove it", at_key=True)
        given = section.model_dump(exclude={"joints", "joints_confirmed"})
        as_recording = Sections(sections.marked, {"robot": RecordingRobot(**given, positions="joints")})
        robot = robot_of(as_recording, folder, None)
        sections.findings.extend(as_recording.findings)
        if robot.arm is None:
            return None
        turning = joint_units(robot.arm, 0.0, 1.0) > 0.0
        return TrackerRobot(robot.name, robot.arm, turning, section.joints_confirmed, robot.inputs)
    others = [way for way in ("name", "arm", "urdf") if getattr(section, way) is not None]
    if others:
        what = f"has kinematics and {' and '.join(others)}"
        expected = "exactly one of name, arm, urdf, kinematics"
        add_finding(sections, ("robot",), what, expected, "keep one of them", at_key=True)
    for key in ("label", "joints"):
        if getattr(section, key) is None:
            cure = f'write for example "{TRACKER_EXAMPLES[f"robot.{key}"]}"'
            add_finding(sections, ("robot", key), "is missing", "it, because kinematics is none", cure)
    if section.joints is None or section.label is None:
        return None
    turning = np.array([kind == "turning" for kind in section.joints])
    return TrackerRobot(section.label, None, turning, section.joints_confirmed)


def _sweeps(sections: Sections, robot: TrackerRobot | None) -> tuple[Sweep, ...] | None:
    section: dict[str, int | str] | None = sections.valid.get("sweeps")
    if section is None or robot is None:
        return None
    for name, joint in section.items():
        if joint != FREE and int(joint) > len(robot.turning):
            cure = f"write the number of the joint that moved, or {FREE}"
            expected = f"1 to {len(robot.turning)}, the joints of {robot.name}"
            add_finding(sections, ("sweeps", name), f"is {joint}", expected, cure)
    return tuple(Sweep(name, None if joint == FREE else int(joint) - 1) for name, joint in section.items())


def _reflectors(sections: Sections, robot: TrackerRobot | None) -> tuple[Reflector, ...] | None:
    section: dict[str, int | str] | None = sections.valid.get("reflectors")
    if section is None or robot is None:
        return None
    for name, link in section.items():
        if link != GROUND_WORD and int(link) > len(robot.turning):
            cure = f"write the number of the joint that moves the link by itself, or {GROUND_WORD}"
            expected = f"1 to {len(robot.turning)}, the links of {robot.name}"
            add_finding(sections, ("reflectors", name), f"is {link}", expected, cure)
    return tuple(Reflector(name, GROUND if link == GROUND_WORD else int(link)) for name, link in section.items())


def unit_factors(units: tuple[str, str]) -> tuple[float, float]:
    """Metres per unit of length and radians per unit of angle."""
    return LENGTH_UNITS[units[0]], ANGLE_UNITS[units[1]]
