"""What does recording.yaml say, once all its sections are taken together?"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sixthlink.files.recording_head import head_of
from sixthlink.files.recording_robot import Robot, robot_of
from sixthlink.files.recording_schema import (
    JOINTS,
    TARGET_POSES,
    TOUCHES,
    StandardSection,
    TargetPosesSection,
    target_model,
)
from sixthlink.files.schema_findings import did_you_mean, said, validated
from sixthlink.files.sections import Sections, add_finding
from sixthlink.geometry import ORIENTATIONS, Orientation
from sixthlink.recording import EYE_IN_HAND, Head
from sixthlink.target import SOCKET, TARGET_KINDS, LengthStandard, Target
from sixthlink.units import ANGLE_UNITS, LENGTH_UNITS

__all__ = ["Description", "described"]


@dataclass(frozen=True)
class Description:
    """Everything that recording.yaml says; beside findings, what could still be understood.

    Attributes:
        name: Name for people.
        mount: ``eye-in-hand`` or ``eye-to-hand``; touches are made by a ball in the hand.
        length_m: Metres per unit of length.
        angle_rad: Radians per unit of angle.
        robot: The robot.
        head: The head.
        target: The target, or None.
        standard: The length standard, or None.
        marks: Names of the length standard's marks, empty without a standard, None while that is unknown.
        observations: ``images``, ``pixels``, ``target-poses`` or ``touches``.
        target_orientation: Convention of measured target poses, or None.
        target_direction: ``T_head_target`` or ``T_target_head``, or None.
    """

    name: str
    mount: str
    length_m: float | None
    angle_rad: float | None
    robot: Robot
    head: Head | None
    target: Target | None
    standard: LengthStandard | None
    marks: tuple[str, ...] | None
    observations: str | None
    target_orientation: Orientation | None = None
    target_direction: str | None = None


def described(sections: Sections, folder: Path, arm_path: Path | None) -> Description:
    """Everything that the sections say; findings go to ``sections``."""
    units = sections.valid.get("units")
    length_m = LENGTH_UNITS[units.length] if units else None
    poses: TargetPosesSection | None = sections.valid.get("target_poses")
    observations = sections.valid.get("observations")
    if observations == TARGET_POSES and not sections.written("target_poses"):
        cure = 'write for example "target_poses: {orientation: quaternion-xyzw, direction: T_head_target}"'
        add_finding(sections, ("target_poses",), "is missing", "how the measured poses are written", cure)
    if observations not in {None, TARGET_POSES, TOUCHES} and sections.written("target_poses"):
        what = f"is not for observations: {observations}"
        add_finding(sections, ("target_poses",), what, "", "remove it", at_key=True)
    touched = observations == TOUCHES
    robot = robot_of(sections, folder, arm_path)
    if touched and robot.positions not in {None, JOINTS}:
        cure = "record joint values, and name the robot"
        add_finding(sections, ("robot", "positions"), f"is {robot.positions}", "joints for observations: touches", cure)
    return Description(
        name=sections.valid.get("name", ""),
        mount=EYE_IN_HAND if touched else sections.valid.get("mount", ""),
        length_m=length_m,
        angle_rad=ANGLE_UNITS[units.angle] if units else None,
        robot=robot,
        head=Head(()) if touched else head_of(sections, length_m),
        target=_target(sections, length_m),
        standard=_standard(sections, length_m),
        marks=_marks(sections),
        observations=observations,
        target_orientation=ORIENTATIONS[poses.orientation] if poses else None,
        target_direction=poses.direction if poses else None,
    )


def _target(sections: Sections, length_m: float | None) -> Target | None:
    section = sections.valid.get("target")
    if not isinstance(section, dict):
        observations = sections.valid.get("observations")
        if observations not in {None, TARGET_POSES, TOUCHES} and (
            section is not None or not sections.written("target")
        ):
            cure = 'write for example "target: {kind: chessboard, columns: 12, rows: 9, square: 20}"'
            add_finding(sections, ("target",), "is missing", f"a target for observations: {observations}", cure)
        return None
    kind = section.get("kind")
    if kind not in TARGET_KINDS:
        what = said(kind) if "kind" in section else "is missing"
        cure = did_you_mean(str(kind), TARGET_KINDS) or "write one of them"
        add_finding(sections, ("target", "kind"), what, f"one of {', '.join(TARGET_KINDS)}", cure)
        return None
    model, examples = target_model(kind)
    values, findings = validated(model, sections.marked, ("target",), examples)
    sections.findings.extend(findings)
    if findings or length_m is None:
        return None
    given = values.model_dump(exclude_unset=True, exclude={"kind"})
    lengths = {f"{key}_m" for key in given} & set(TARGET_KINDS[kind].__dataclass_fields__)
    arguments = {
        (f"{key}_m" if f"{key}_m" in lengths else key): (value * length_m if f"{key}_m" in lengths else value)
        for key, value in given.items()
    }
    try:
        target: Target = TARGET_KINDS[kind](**arguments)
    except ValueError as error:
        add_finding(sections, ("target",), str(error), "", "correct the numbers of the target")
        return None
    return target


def _standard(sections: Sections, length_m: float | None) -> LengthStandard | None:
    section = sections.valid.get("length_standard")
    if not isinstance(section, StandardSection) or length_m is None:
        return None
    first, second = section.marks
    if first == second:
        add_finding(sections, ("length_standard", "marks"), "are the same", "two different names", "rename one")
        return None
    if not _mark_fits(sections, section):
        return None
    return LengthStandard(
        section.length * length_m,
        section.uncertainty * length_m,
        section.mark,
        (section.mark_diameter or 0.0) * length_m,
        (first, second),
    )


def _mark_fits(sections: Sections, section: StandardSection) -> bool:
    """Sockets are touched and have no diameter, discs are seen and need one."""
    before = len(sections.findings)
    observations = sections.valid.get("observations")
    if observations is not None and (section.mark == SOCKET) != (observations == TOUCHES):
        expected = f"{SOCKET} for observations: {TOUCHES}, and only there"
        cure = "write how the ends of the standard are found"
        add_finding(sections, ("length_standard", "mark"), f"is {section.mark}", expected, cure)
    elif section.mark == SOCKET and section.mark_diameter is not None:
        add_finding(sections, ("length_standard", "mark_diameter"), "is not for sockets", "", "remove it", at_key=True)
    elif section.mark != SOCKET and section.mark_diameter is None:
        cure = 'write it, for example "mark_diameter: 24"'
        add_finding(sections, ("length_standard", "mark_diameter"), "is missing", "", cure, at_key=True)
    return len(sections.findings) == before


def _marks(sections: Sections) -> tuple[str, ...] | None:
    section = sections.valid.get("length_standard")
    if isinstance(section, StandardSection):
        return tuple(section.marks)
    left_out = isinstance(sections.marked.value, dict) and not sections.written("length_standard")
    return () if left_out or section is not None else None
