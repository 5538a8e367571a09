"""Which arm does a robot description (URDF) mean, from one of its links to another?

Every joint contributes its origin, Tx Ty Tz Rz(yaw) Ry(pitch) Rx(roll), then its motion. A motion along an
axis other than z is Rz(azimuth) Ry(elevation) · motion along z · Ry(-elevation) Rz(-azimuth), so that every
joint turns about, or slides along, its own z axis. Lengths are metres and angles radians, as the format
prescribes.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sixthlink.errors import Finding, InputError
from sixthlink.robot import Arm

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

__all__ = ["arm_from_urdf"]

MOST_BYTES = 4 * 2**20
"""Largest description that is read."""

ENDLESS_RAD = 2.0 * math.pi
"""Limit on either side that a continuous joint is given."""

MOVING = {"revolute", "continuous", "prismatic"}
"""Types of joint that move along or about one axis."""


@dataclass(frozen=True)
class _Step:
    kind: str
    parameter: str
    value: float
    driver: str = ""
    factor: float = 0.0


@dataclass
class _Description:
    """The file as text and elements, and what was found wrong with it so far."""

    where: str
    text: str
    name: str
    joints: Mapping[str, Element]
    links: tuple[str, ...]
    findings: list[Finding] = field(default_factory=list)

    def note(self, joint: str, what: str, expected: str, cure: str) -> None:
        """Add a finding at a joint, with the line on which the file names it."""
        at = re.search(rf"<joint\b[^>]*\bname\s*=\s*[\"']{re.escape(joint)}[\"']", self.text)
        line = self.text.count("\n", 0, at.start()) + 1 if at else 0
        self.findings.append(Finding(self.where, f"joint {joint}", what, expected, cure, line))


def arm_from_urdf(path: Path, base: str, tip: str) -> Arm:
    """The arm between two links of a robot description.

    Mimic joints become couplings, fixed joints constant steps; a continuous joint is limited to one turn
    each way.

    Args:
        path: A URDF file, already expanded when it comes from xacro.
        base: Link whose frame is the base.
        tip: Link whose frame is the flange.

    Returns:
        An arm of dialect ``steps`` with the description's joint names, base to tip.

    Raises:
        InputError: Everything that is wrong with the file or the choice of links.
    """
    urdf = _read(path)
    chain = _chain(urdf, base, tip)
    types = {name: urdf.joints[name].get("type", "") for name in chain}
    for name, kind in types.items():
        if kind not in MOVING | {"fixed"}:
            cure = "choose links between which no such joint lies"
            urdf.note(name, f"has type {kind!r}", "revolute, continuous, prismatic or fixed", cure)
    mimics = {name for name in chain if types[name] in MOVING and urdf.joints[name].find("mimic") is not None}
    moving = [name for name in chain if types[name] in MOVING and name not in mimics]
    if not moving and not urdf.findings:
        what = f"no moving joint between {base} and {tip}"
        urdf.findings.append(Finding(urdf.where, "tip", what, "at least one", "choose other links"))
    steps = [step for name in chain for step in _joint_steps(urdf, name, types[name], moving)]
    limits = [_limits(urdf, name, types[name]) for name in moving]
    if urdf.findings:
        raise InputError(urdf.findings)
    joint_map = np.zeros((len(steps), len(moving)))
    for k, step in enumerate(steps):
        if step.driver:
            joint_map[k, moving.index(step.driver)] = step.factor
    return Arm(
        name=urdf.name,
        source=f"URDF {path.name}, {base} to {tip}",
        dialect="steps",
        kinds=tuple(step.kind for step in steps),
        parameters=tuple(step.parameter for step in steps),
        values=np.array([step.value for step in steps]),
        joint_map=joint_map,
        joints=tuple(moving),
        limits=np.array(limits),
    )


def _read(path: Path) -> _Description:
    # Entities are how a small XML file grows without bound or reads others; they need a DOCTYPE, which no
    # robot description has.
    from xml.etree import ElementTree as ET

    where = str(path)

    def refused(what: str, expected: str, cure: str, line: int = 0, column: int = 0) -> InputError:
        return InputError([Finding(where, "file", what, expected, cure, line, column)])

    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise refused(f"has {size} bytes", f"at most {MOST_BYTES}", "check that it is the right file")
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise refused(f"cannot be read ({error.strerror})", "a URDF file", "correct the path") from error
    except UnicodeDecodeError as error:
        raise refused(f"byte {error.start + 1} is not UTF-8", "UTF-8 text", "save it as UTF-8") from error
    if re.search(r"<!(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise refused("has a DOCTYPE or ENTITY", "plain XML", "remove it")
    try:
        root = ET.fromstring(text)  # noqa: S314 - without a DOCTYPE there are no entities to expand
    except ET.ParseError as error:
        line, column = error.position
        raise refused(f"is not XML ({error})", "well-formed XML", "correct it", line, column + 1) from error
    if any("xacro}" in element.tag for element in root.iter()) or re.search(r"=\s*[\"'][^\"'<]*\$\{", text):
        raise refused("still has xacro macros", "a plain URDF", "expand it first: xacro FILE > robot.urdf")
    if root.tag != "robot":
        raise refused(f"begins with <{root.tag}>", "<robot>", "give a URDF file")
    joints = {joint.get("name", ""): joint for joint in root.findall("joint")}
    links = tuple(link.get("name", "") for link in root.findall("link"))
    return _Description(where, text, root.get("name") or path.stem, joints, links)


def _chain(urdf: _Description, base: str, tip: str) -> list[str]:
    """Names of the joints from base to tip."""
    for role, link in (("base", base), ("tip", tip)):
        if link not in urdf.links:
            near = difflib.get_close_matches(link, urdf.links, n=1)
            cure = f"did you mean {near[0]}?" if near else "choose one of them"
            listed = ", ".join(urdf.links) or "a file with links"
            urdf.findings.append(Finding(urdf.where, role, f"there is no link {link!r}", listed, cure))
    above = {_link(joint, "child"): name for name, joint in urdf.joints.items()}
    chain: list[str] = []
    link = tip
    while link != base and link in above and above[link] not in chain:
        chain.append(above[link])
        link = _link(urdf.joints[above[link]], "parent")
    if link != base and not urdf.findings:
        what = f"{tip} does not hang on {base}; above it come {', '.join(reversed(chain)) or 'no joints'}"
        urdf.findings.append(
            Finding(urdf.where, "tip", what, "a link further out than the base", "swap or choose others")
        )
    if urdf.findings:
        raise InputError(urdf.findings)
    return chain[::-1]


def _link(joint: Element, role: str) -> str:
    element = joint.find(role)
    return "" if element is None else element.get("link", "")


def _joint_steps(urdf: _Description, name: str, kind: str, moving: list[str]) -> Iterator[_Step]:
    """Steps of one joint: its origin, then its motion."""
    xyz, rpy = _numbers(urdf, name, "origin", "xyz"), _numbers(urdf, name, "origin", "rpy")
    for step_kind, symbol, value in (
        ("tx", "x", xyz[0]),
        ("ty", "y", xyz[1]),
        ("tz", "z", xyz[2]),
        ("rz", "yaw", rpy[2]),
        ("ry", "pitch", rpy[1]),
        ("rx", "roll", rpy[0]),
    ):
        yield _Step(step_kind, f"{name}_{symbol}", value)
    if kind in MOVING:
        yield from _motion_steps(urdf, name, kind, moving)


def _motion_steps(urdf: _Description, name: str, kind: str, moving: list[str]) -> Iterator[_Step]:
    """The motion of a joint along z of a frame that two constant turns bring to its axis, and back."""
    x, y, z = _numbers(urdf, name, "axis", "xyz", (1.0, 0.0, 0.0))
    if x == y == z == 0.0:
        urdf.note(name, "has an axis of length zero", "a direction", "correct its axis")
    driver, factor, offset = name, 1.0, 0.0
    mimic = urdf.joints[name].find("mimic")
    if mimic is not None:
        driver = mimic.get("joint", "")
        factor, offset = (
            _number(urdf, name, mimic, "multiplier", 1.0),
            _number(urdf, name, mimic, "offset", 0.0),
        )
        if driver not in moving:
            expected = f"one of {', '.join(moving) or 'the moving joints between base and tip'}"
            urdf.note(name, f"mimics {driver!r}", expected, "choose links between which both joints lie")
    # Straight down is z counted backwards; any other axis is reached by two constant turns.
    down = x == y == 0.0 and z < 0.0
    azimuth, elevation = (0.0, 0.0) if down else (math.atan2(y, x), math.atan2(math.hypot(x, y), z))
    motion = ("tz", "shift") if kind == "prismatic" else ("rz", "turn")
    turned = elevation != 0.0
    if turned:
        yield _Step("rz", f"{name}_azimuth", azimuth)
        yield _Step("ry", f"{name}_elevation", elevation)
    yield _Step(motion[0], f"{name}_{motion[1]}", -offset if down else offset, driver, -factor if down else factor)
    if turned:
        yield _Step("ry", f"{name}_lowering", -elevation)
        yield _Step("rz", f"{name}_return", -azimuth)


def _limits(urdf: _Description, name: str, kind: str) -> tuple[float, float]:
    if kind == "continuous":
        return -ENDLESS_RAD, ENDLESS_RAD
    limit = urdf.joints[name].find("limit")
    if limit is None:
        urdf.note(name, "has no limit", "a limit with lower and upper", "add it, or make the joint continuous")
        return -ENDLESS_RAD, ENDLESS_RAD
    lower, upper = _number(urdf, name, limit, "lower", 0.0), _number(urdf, name, limit, "upper", 0.0)
    if not lower < upper:
        urdf.note(name, f"has limits {lower} to {upper}", "lower below upper", "correct its limits")
    return lower, upper


def _number(urdf: _Description, name: str, element: Element, key: str, default: float) -> float:
    return _parsed(urdf, name, f"{element.tag} {key}", element.get(key, ""), (default,))[0]


def _numbers(
    urdf: _Description, name: str, tag: str, key: str, default: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[float, ...]:
    element = urdf.joints[name].find(tag)
    return default if element is None else _parsed(urdf, name, f"{tag} {key}", element.get(key, ""), default)


def _parsed(urdf: _Description, name: str, what: str, text: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """Finite numbers of an attribute, as many as ``default`` has; ``default`` when it is absent or wrong."""
    if not text.strip():
        return default
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        numbers = ()
    if len(numbers) != len(default) or not all(map(math.isfinite, numbers)):
        urdf.note(name, f"has {what} {text!r}", f"{len(default)} finite numbers", "correct it")
        return default
    return numbers
