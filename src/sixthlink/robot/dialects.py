"""How do DH, modified DH, Hayati and URDF tables become one arm?

Classical DH link i:  Rz(θi) Tz(di) Tx(ai) Rx(αi) [Ry(βi)]          (paper, eq. 1; β after Hayati and Mirmirani 1985)
Modified DH link i:   Rx(αi-1) Tx(ai-1) [Ry(βi-1)] Rz(θi) Tz(di)    (Craig)

β exists only where two neighbouring axes are nominally parallel; there d is fixed instead, because plain DH cannot
describe a small tilt between parallel axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sixthlink.robot.arm import Arm

__all__ = ["Coupling", "Joint", "Link", "Tolerances", "arm_from_links"]


@dataclass(frozen=True)
class Joint:
    """One joint of an arm.

    Attributes:
        name: Name of the joint.
        lower: Lower limit [rad, or m when sliding].
        upper: Upper limit [rad, or m when sliding].
        direction: 1, or -1 when the controller counts against the right-hand rule.
        sliding: Whether the joint slides along z instead of turning about it.
    """

    name: str
    lower: float
    upper: float
    direction: int = 1
    sliding: bool = False


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
    """The DH angle of joint ``joint`` also follows ``driver``: θ = q_joint + factor · q_driver (one-based numbers)."""

    joint: int
    driver: int
    factor: float


@dataclass(frozen=True)
class Tolerances:
    """What the maker's numbers deserve: standard deviations [m, rad, rad]; 0 when not stated."""

    length_m: float = 0.0
    angle_rad: float = 0.0
    joint_repeatability_rad: float = 0.0


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
        flange: Empty, or six numbers x, y, z [m], yaw, pitch, roll [rad] of a fixed flange behind the last link.
        tolerances: What the numbers deserve.

    Raises:
        ValueError: Rows and joints differ in number, or the dialect is unknown.
    """
    if dialect not in _ORDERS:
        raise ValueError(f"unknown dialect {dialect!r}, expected one of {sorted(_ORDERS)}")
    if len(links) != len(joints):
        raise ValueError(f"{len(links)} links but {len(joints)} joints; each link has one joint")
    steps: list[tuple[str, str, float]] = []
    driven: dict[str, int] = {}
    for number, (link, joint) in enumerate(zip(links, joints, strict=True), start=1):
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
                steps.append((kind, f"{symbol}{number}", value))
        driven[f"d{number}" if joint.sliding else f"theta{number}"] = number - 1
    steps += [(kind, f"flange_{s}", v) for (kind, s), v in zip(_FLANGE, flange, strict=False)]
    names = [step[1] for step in steps]
    joint_map = np.zeros((len(steps), len(joints)))
    for parameter, j in driven.items():
        joint_map[names.index(parameter), j] = joints[j].direction
    for c in couplings:
        joint_map[names.index(f"theta{c.joint}"), c.driver - 1] = c.factor
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
