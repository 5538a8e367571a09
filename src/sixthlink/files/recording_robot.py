"""Which robot does recording.yaml name, and how does it write the positions?"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

from sixthlink.errors import InputError
from sixthlink.files.inside import file_inside
from sixthlink.files.recording_schema import JOINTS, RobotSection
from sixthlink.files.schema_findings import did_you_mean
from sixthlink.files.sections import Sections, add_finding
from sixthlink.geometry import ORIENTATIONS, Orientation
from sixthlink.robot import Arm

__all__ = ["Robot", "file_sha256", "robot_of"]

WAYS = ("name", "arm", "urdf", "kinematics")


@dataclass(frozen=True)
class Robot:
    """What a recording says of its robot.

    Attributes:
        name: Name for people.
        arm: Kinematics, or None.
        positions: ``joints`` or ``flange-poses``; None while that is unknown.
        orientation: Convention of flange poses, None for joints.
        direction: ``T_base_flange`` or ``T_flange_base``, None for joints.
        confirmed: Whether the user confirmed positions that look as if their unit were another.
        inputs: SHA-256 of the files that were read, by name.
    """

    name: str = ""
    arm: Arm | None = None
    positions: str | None = None
    orientation: Orientation | None = None
    direction: str | None = None
    confirmed: bool = False
    inputs: dict[str, str] = field(default_factory=dict)


def robot_of(sections: Sections, folder: Path, arm_path: Path | None) -> Robot:
    """The robot of a recording; findings go to ``sections``.

    Args:
        sections: The judged sections.
        folder: Folder of the recording.
        arm_path: Arm file that replaces the robot's own kinematics, anywhere on disk, or None.
    """
    section: RobotSection | None = sections.valid.get("robot")
    inputs: dict[str, str] = {}
    arm = _override(sections, arm_path, inputs) if arm_path is not None else None
    if section is None:
        return Robot(arm=arm, inputs=inputs)
    _check_way(sections, section)
    _check_conventions(sections, section)
    if arm_path is None:
        arm = _own_arm(sections, section, folder, inputs)
    return Robot(
        name=section.label or (arm.name if arm else ""),
        arm=arm,
        positions=section.positions,
        orientation=ORIENTATIONS[section.orientation] if section.orientation else None,
        direction=section.direction,
        confirmed=section.positions_confirmed,
        inputs=inputs,
    )


def file_sha256(path: Path) -> str:
    """SHA-256 of a file in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _check_way(sections: Sections, section: RobotSection) -> None:
    """Exactly one way of naming the robot, and what belongs to it."""
    given = [way for way in WAYS if getattr(section, way) is not None]
    if len(given) != 1:
        what = f"has {' and '.join(given)}" if given else "does not say which robot it is"
        cure = 'write for example "name: abb_irb1400"' if not given else "keep one of them"
        add_finding(sections, ("robot",), what, "exactly one of name, arm, urdf, kinematics", cure, at_key=True)
    if section.kinematics is not None and section.label is None:
        cure = 'write for example "label: Denso VS-6577"'
        add_finding(sections, ("robot", "label"), "is missing", "a name for people, because kinematics is none", cure)
    if section.kinematics is None and section.label is not None:
        what = "is only for a robot with kinematics: none"
        add_finding(sections, ("robot", "label"), what, "", "remove it", at_key=True)
    if section.kinematics is not None and section.positions == JOINTS:
        cure = "give the robot's name or an arm file, or record flange poses"
        add_finding(sections, ("robot", "positions"), "is joints, but kinematics is none", "flange-poses", cure)


def _check_conventions(sections: Sections, section: RobotSection) -> None:
    """Orientation and direction belong to flange poses, and there neither is guessed."""
    meaning = {
        "orientation": ("the maker's way of writing an orientation", "orientation: abb"),
        "direction": ("T_base_flange (flange in the base) or T_flange_base", "direction: T_base_flange"),
    }
    for key, (expected, example) in meaning.items():
        given = getattr(section, key) is not None
        if section.positions == JOINTS and given:
            what = "is only for positions: flange-poses"
            add_finding(
                sections,
                ("robot", key),
                what,
                "no such key beside positions: joints",
                "remove it",
                at_key=True,
            )
        if section.positions != JOINTS and not given:
            add_finding(sections, ("robot", key), "is missing", expected, f'write for example "{example}"')


def _override(sections: Sections, path: Path, inputs: dict[str, str]) -> Arm | None:
    from sixthlink.files.arm_file import read_arm

    try:
        arm = read_arm(path)
    except InputError as error:
        sections.findings.extend(error.findings)
        return None
    inputs[path.name] = file_sha256(path)
    return arm


def _own_arm(sections: Sections, section: RobotSection, folder: Path, inputs: dict[str, str]) -> Arm | None:
    from sixthlink.files.arm_file import load_arm, maker_names, read_arm
    from sixthlink.files.urdf import arm_from_urdf

    try:
        if section.name is not None:
            if section.name in maker_names():
                return load_arm(section.name, folder=folder)
            known = ", ".join(maker_names())
            cure = did_you_mean(section.name, maker_names()) or "write an arm file and name it as arm: my_arm.yaml"
            add_finding(sections, ("robot", "name"), f"'{section.name}' is not known", f"one of {known}", cure)
        elif section.arm is not None:
            path = _file(sections, ("robot", "arm"), folder, section.arm, inputs)
            return read_arm(path) if path else None
        elif section.urdf is not None:
            path = _file(sections, ("robot", "urdf", "file"), folder, section.urdf.file, inputs)
            return arm_from_urdf(path, section.urdf.base, section.urdf.tip) if path else None
    except InputError as error:
        sections.findings.extend(error.findings)
    return None


def _file(sections: Sections, keys: tuple[str, ...], folder: Path, name: str, inputs: dict[str, str]) -> Path | None:
    try:
        path = file_inside(folder, name)
    except ValueError as error:
        cure = "copy the file into the folder and correct the path"
        add_finding(sections, keys, str(error), "a file in the folder of the recording", cure)
        return None
    inputs[name] = file_sha256(path)
    return path
