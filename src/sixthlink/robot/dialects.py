"""How do DH, modified DH, Hayati and URDF tables become one arm?

Classical DH link i:  Rz(θi) Tz(di) Tx(ai) Rx(αi) [Ry(βi)]        (paper, eq. 1; β: Hayati and Mirmirani 1985)
Modified DH link i:   Rx(αi-1) Tx(ai-1) [Ry(βi-1)] Rz(θi) Tz(di)  (Craig; row i carries a, α, β of link i-1)

β exists only where two neighbouring axes are nominally parallel; there d is fixed instead, because plain DH
cannot describe a small tilt between parallel axes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sixthlink.robot.arm import Arm

__all__ = ["Coupling", "Joint", "Link", "LinkTable", "Tolerances", "arm_from_links", "link_table_from_arm"]


@dataclass(frozen=True)
class Joint:
    """One joint of an arm.

    Attributes:
        name: Name of the joint.
        lower: Lower limit [rad, or m when sliding].
        upper: Upper limit [rad, or m when sliding].
        direction: 1, or -1 when the controller counts against the right-hand rule.
        sliding: Whether the joint slides along z instead of turning about it.
        scale: True motion per unit that the controller reports; 1 unless a calibration found otherwise.
    """

    name: str
    lower: float
    upper: float
    direction: int = 1
    sliding: bool = False
    scale: float = 1.0

    def __post_init__(self) -> None:
        if self.direction not in {1, -1}:
            raise ValueError(f"joint {self.name}: direction is {self.direction}, expected 1 or -1")
        if not 0.0 < self.scale < math.inf:
            raise ValueError(f"joint {self.name}: scale is {self.scale}, expected a number above 0")


@dataclass(frozen=True)
class Link:
    """One row of a DH table; lengths in metres, angles in radians. ``beta_rad`` is None where DH suffices."""

    theta_rad: float
    d_m: float
    a_m: float
    alpha_rad: float
    beta_rad: float | None = None


@dataclass(frozen=True)
class Coupling:
    """Joint ``joint`` also follows ``driver``: θ (or d) = q_joint + factor · q_driver; numbers from 1."""

    joint: int
    driver: int
    factor: float


@dataclass(frozen=True)
class Tolerances:
    """What the maker's numbers deserve: standard deviations [m, rad, rad]; 0 when not stated."""

    length_m: float = 0.0
    angle_rad: float = 0.0
    joint_repeatability_rad: float = 0.0


@dataclass(frozen=True)
class LinkTable:
    """What a DH or modified DH arm is made of: the arguments of :func:`arm_from_links`.

    Attributes:
        links: One row per joint.
        joints: One joint per row.
        couplings: Joints that follow another joint as well.
        flange: Empty, or x, y, z [m], yaw, pitch, roll [rad] of a fixed flange behind the last link.
    """

    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    couplings: tuple[Coupling, ...]
    flange: tuple[float, ...]


_DH_ORDER = (("rz", "theta"), ("tz", "d"), ("tx", "a"), ("rx", "alpha"), ("ry", "beta"))
_MDH_ORDER = (("rx", "alpha"), ("tx", "a"), ("ry", "beta"), ("rz", "theta"), ("tz", "d"))
_ORDERS = {"dh": _DH_ORDER, "mdh": _MDH_ORDER}
_FLANGE = (("tx", "x"), ("ty", "y"), ("tz", "z"), ("rz", "yaw"), ("ry", "pitch"), ("rx", "roll"))


def arm_from_links(
    name: str,
    source: str,
    dialect: str,
    links: Sequence[Link],
    joints: Sequence[Joint],
    *,
    couplings: Sequence[Coupling] = (),
    flange: Sequence[float] = (),
    tolerances: Tolerances | None = None,
) -> Arm:
    """Arm of a DH (``dh``) or modified DH (``mdh``) table.

    Args:
        name: Name of the robot.
        source: Where its numbers come from.
        dialect: ``dh`` or ``mdh``.
        links: One row per joint.
        joints: One joint per row.
        couplings: Joints that follow another joint as well.
        flange: Empty, or six numbers x, y, z [m], yaw, pitch, roll [rad] of a flange behind the last link.
        tolerances: What the numbers deserve.

    Raises:
        ValueError: Rows and joints differ in number, the flange is incomplete, or the dialect is unknown.
    """
    if dialect not in _ORDERS:
        raise ValueError(f"unknown dialect {dialect!r}, expected one of {sorted(_ORDERS)}")
    if len(links) != len(joints):
        raise ValueError(f"{len(links)} links but {len(joints)} joints; each link has one joint")
    if len(flange) not in {0, len(_FLANGE)}:
        raise ValueError(f"flange has {len(flange)} numbers, expected none or x, y, z, yaw, pitch, roll")
    steps = [step for number, link in enumerate(links, start=1) for step in _link_steps(dialect, number, link)]
    steps += [(kind, f"flange_{s}", v) for (kind, s), v in zip(_FLANGE, flange, strict=False)]
    names = [step[1] for step in steps]
    rows = [names.index(_driven(number, joint)) for number, joint in enumerate(joints, start=1)]
    joint_map = np.zeros((len(steps), len(joints)))
    for j, joint in enumerate(joints):
        joint_map[rows[j], j] = joint.direction * joint.scale
    for c in couplings:
        joint_map[rows[c.joint - 1], c.driver - 1] = c.factor
    t = tolerances or Tolerances()
    return Arm(
        name=name,
        source=source,
        dialect=dialect,
        kinds=tuple(step[0] for step in steps),
        parameters=tuple(names),
        values=np.array([step[2] for step in steps]),
        joint_map=joint_map,
        joints=tuple(j.name for j in joints),
        limits=np.array([[j.lower, j.upper] for j in joints]),
        length_tolerance_m=t.length_m,
        angle_tolerance_rad=t.angle_rad,
        joint_repeatability_rad=t.joint_repeatability_rad,
    )


def link_table_from_arm(arm: Arm) -> LinkTable:
    """The DH or modified DH table of an arm, bit for bit: the inverse of :func:`arm_from_links`.

    Args:
        arm: An arm of dialect ``dh`` or ``mdh``; its values and joint map may have been calibrated.

    Raises:
        ValueError: The arm is not such a table: another dialect, or a joint drives what a table cannot say.
    """
    value_of = dict(zip(arm.parameters, arm.values.tolist(), strict=True))
    flange = tuple(value_of[f"flange_{s}"] for _, s in _FLANGE if f"flange_{s}" in value_of)
    links: list[Link] = []
    joints: list[Joint] = []
    couplings: list[Coupling] = []
    try:
        for j, (name, (lower, upper)) in enumerate(zip(arm.joints, arm.limits.tolist(), strict=True)):
            number = j + 1
            theta, d, a, alpha = (value_of[f"{symbol}{number}"] for symbol in ("theta", "d", "a", "alpha"))
            links.append(Link(theta, d, a, alpha, value_of.get(f"beta{number}")))
            sliding = bool(arm.joint_map[arm.parameters.index(f"d{number}"), j])
            row = arm.joint_map[arm.parameters.index(f"{'d' if sliding else 'theta'}{number}")].tolist()
            joints.append(Joint(name, lower, upper, -1 if row[j] < 0 else 1, sliding, abs(row[j])))
            couplings += [Coupling(number, k + 1, f) for k, f in enumerate(row) if k != j and f != 0.0]
        again = arm_from_links(arm.name, arm.source, arm.dialect, links, joints, couplings=couplings, flange=flange)
    except (KeyError, ValueError) as error:
        raise ValueError(f"arm {arm.name} is not a table of links: {error}") from error
    same_map = np.array_equal(again.joint_map, arm.joint_map)
    if (again.kinds, again.parameters) != (arm.kinds, arm.parameters) or not same_map:
        raise ValueError(f"arm {arm.name} is not a table of links: its steps or joint map go beyond one")
    return LinkTable(tuple(links), tuple(joints), tuple(couplings), flange)


def _link_steps(dialect: str, number: int, link: Link) -> Iterator[tuple[str, str, float]]:
    """Kind, parameter and value of each step of one row."""
    numbers = {
        "theta": link.theta_rad,
        "d": link.d_m,
        "a": link.a_m,
        "alpha": link.alpha_rad,
        "beta": link.beta_rad,
    }
    for kind, symbol in _ORDERS[dialect]:
        value = numbers[symbol]
        if value is not None:
            yield kind, f"{symbol}{number}", value


def _driven(number: int, joint: Joint) -> str:
    """Parameter that a joint drives."""
    return f"d{number}" if joint.sliding else f"theta{number}"
