"""How do the axis lines of all joints become an arm: signed DH numbers, joint offsets, and the place of the base?

Each sweep shows its axis where the joints before it stood; turned back about their axes one after the other, all lines
are those of the arm at zero. Neighbouring lines then give d, θ of one joint and a, α between two, with signs; where
they are nominally parallel there is no common normal, d stays as drawn and Hayati's β takes its place. Equations
(K1)-(K4) of docs/theory/tracked_arm.md.

The base's d1 and θ1, and everything behind the last axis, are not in the lines: they stay as drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.tracked_arm.sweeps import JointSweep
from sixthlink.geometry import Floats, Line, common_normal, exp_rotation, inverse, moved_line, transform
from sixthlink.robot import Arm, Joint, Link, Tolerances, arm_from_links, arm_with_values, link_poses

__all__ = ["Extraction", "arm_without_drawing", "axes_at_zero", "extracted_arm"]

NEARLY_PARALLEL_RAD = np.deg2rad(3.0)
"""Angle below which neighbouring axes of an arm without a drawing count as parallel."""


@dataclass(frozen=True, eq=False)
class Extraction:
    """An arm from its axes.

    Attributes:
        arm: The arm.
        T_instrument_base: ``(4, 4)`` where its base stands in the tracker's frame.
    """

    arm: Arm
    T_instrument_base: Floats


def axes_at_zero(sweeps: Mapping[int, JointSweep], joint_rows: Floats) -> tuple[Line, ...]:
    """The axis of every joint ``(J lines)`` in the tracker's frame with all joints at zero (K1).

    Args:
        sweeps: The usable sweep of every joint, 0 to J - 1.
        joint_rows: ``(J, J)`` how far each joint's own step turns per unit of every joint: couplings and signs.
    """
    lines: list[Line] = []
    for j in range(len(joint_rows)):
        fit = sweeps[j].fit
        assert fit is not None  # noqa: S101 - usable sweeps have a fit
        sign = 1.0 if joint_rows[j, j] > 0.0 else -1.0
        line = Line(fit.axis.point_m, sign * fit.axis.direction)
        turns = joint_rows[:j] @ sweeps[j].stop
        for before, turn in zip(lines, turns.tolist(), strict=True):
            line = moved_line(_about(before, -turn), line)
        lines.append(line)
    return tuple(lines)


def extracted_arm(nominal: Arm, sweeps: Mapping[int, JointSweep]) -> Extraction | None:
    """The arm that the axes show, in the form of a drawing.

    Args:
        nominal: The drawing: a DH or modified DH table of turning joints.
        sweeps: The usable sweep of every joint.

    Returns:
        The arm; None where a joint has no usable sweep, slides, or the drawing is no such table.
    """
    J = len(nominal.joints)
    own = list(nominal.own_steps)
    if nominal.dialect not in {"dh", "mdh"} or set(sweeps) != set(range(J)) or not nominal.turns[own].all():
        return None
    lines = axes_at_zero(sweeps, nominal.joint_map[own])
    value = dict(zip(nominal.parameters, nominal.values.tolist(), strict=True))
    shift = int(nominal.dialect == "mdh")
    drawn = [
        Link(
            value[f"theta{j}"],
            value[f"d{j}"],
            value.get(f"a{j + shift}", 0.0),
            value.get(f"alpha{j + shift}", 0.0),
            value.get(f"beta{j + shift}"),
        )
        for j in range(1, J)
    ]
    links, T_instrument_first = _links(lines, drawn)
    for j, link in enumerate(links, start=1):
        value |= {f"theta{j}": link.theta_rad, f"d{j}": link.d_m}
        value |= {f"a{j + shift}": link.a_m, f"alpha{j + shift}": link.alpha_rad}
        if link.beta_rad is not None:
            value[f"beta{j + shift}"] = link.beta_rad
    arm = arm_with_values(nominal, [value[name] for name in nominal.parameters])
    T_base_first = link_poses(arm, np.zeros((1, J)), 0)[0]
    return Extraction(arm, T_instrument_first @ inverse(T_base_first))


def arm_without_drawing(
    name: str, source: str, sweeps: Mapping[int, JointSweep], ranges: Floats, tolerances: Tolerances
) -> Extraction:
    """A DH arm from nothing but the axes: a is not negative, d1 and θ1 are zero, the flange sits on the last axis.

    Args:
        name: Name of the arm.
        source: Where its numbers come from.
        sweeps: The usable sweep of every joint.
        ranges: ``(J, 2)`` least and largest value of every joint in the record [rad].
        tolerances: What the numbers deserve.
    """
    J = len(sweeps)
    lines = axes_at_zero(sweeps, np.eye(J))
    drawn: list[Link | None] = [None] * (J - 1)
    links, T_instrument_base = _links(lines, drawn)
    joints = [Joint(f"q{j + 1}", low, high) for j, (low, high) in enumerate(ranges.tolist())]
    last = Link(0.0, 0.0, 0.0, 0.0)
    return Extraction(
        arm_from_links(name, source, "dh", [*links, last], joints, tolerances=tolerances), T_instrument_base
    )


def _links(lines: Sequence[Line], drawn: Sequence[Link | None]) -> tuple[list[Link], Floats]:
    """Signed DH numbers between neighbouring axes, and the frame ``(4, 4)`` before the first joint."""
    first = drawn[0] if drawn else None
    theta, d = (first.theta_rad, first.d_m) if first is not None else (0.0, 0.0)
    T_start = _first_frame(lines, theta, d, parallel=_parallel(lines, 0, first))
    T, links = T_start, []
    for j, link in enumerate(drawn):
        here = moved_line(inverse(T), lines[j + 1])
        found = _hayati_link(here, link) if _parallel(lines, j, link) else _dh_link(here, link)
        links.append(found)
        T = T @ _link_transform(found)
    return links, T_start


def _parallel(lines: Sequence[Line], j: int, drawn: Link | None) -> bool:
    if drawn is not None:
        return drawn.beta_rad is not None
    if j + 1 >= len(lines):
        return False
    angle = float(common_normal(lines[j], lines[j + 1]).angle_rad)
    return min(angle, np.pi - angle) < NEARLY_PARALLEL_RAD


def _first_frame(lines: Sequence[Line], theta_rad: float, d_m: float, *, parallel: bool) -> Floats:
    """Z along the first axis, x and origin such that the first link's θ and d come out as drawn (K2)."""
    z = lines[0].direction
    if len(lines) == 1:
        foot, x = lines[0].point_m, np.eye(3)[np.argmin(np.abs(z))]
    elif parallel:
        foot = lines[0].point_m
        x = lines[1].point_m - foot
    else:
        normal = common_normal(lines[0], lines[1])
        foot, x = normal.feet_first_m, normal.feet_second_m - normal.feet_first_m
        if float(normal.distance_m) < 1e-9:
            x = np.cross(z, lines[1].direction)
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    R = np.column_stack([x, np.cross(z, x), z]) @ exp_rotation(np.array([0.0, 0.0, -theta_rad]))
    return transform(R, foot - d_m * z)


def _dh_link(line: Line, drawn: Link | None) -> Link:
    """θ, d, a, α from the z axis to a line in its frame (K3); of the two signed answers that nearer the drawing."""
    normal = common_normal(Line(np.zeros(3), np.array([0.0, 0.0, 1.0])), line)
    across = np.cross([0.0, 0.0, 1.0], line.direction)
    x = across / np.linalg.norm(across)
    d = float(normal.feet_first_m[2])
    found = []
    for sign in (1.0, -1.0):
        axis = sign * x
        theta = float(np.arctan2(axis[1], axis[0]))
        a = float((normal.feet_second_m - normal.feet_first_m) @ axis)
        y = np.cross([0.0, 0.0, 1.0], axis)
        alpha = float(np.arctan2(-line.direction @ y, line.direction[2]))
        found.append(Link(theta, d, a, alpha))
    return _nearest(found, drawn)


def _hayati_link(line: Line, drawn: Link | None) -> Link:
    """θ, a, α, β with d as drawn: where the line meets the plane across z at height d (K4)."""
    d = 0.0 if drawn is None else drawn.d_m
    n = line.direction
    meets = line.point_m + (d - line.point_m[2]) / n[2] * n
    reach = float(np.hypot(meets[0], meets[1]))
    towards = float(np.arctan2(meets[1], meets[0]))
    found = []
    for sign in (1.0, -1.0):
        theta = towards if sign > 0.0 else towards + np.pi
        x, y = np.array([np.cos(theta), np.sin(theta), 0.0]), np.array([-np.sin(theta), np.cos(theta), 0.0])
        alpha, beta = float(np.arctan2(-n @ y, n[2])), float(np.arcsin(np.clip(n @ x, -1.0, 1.0)))
        found.append(Link(float(theta), d, sign * reach, alpha, beta))
    return _nearest(found, drawn)


def _nearest(found: Sequence[Link], drawn: Link | None) -> Link:
    if drawn is None:
        best = max(found, key=lambda link: (round(link.a_m, 6) >= 0.0, link.alpha_rad > 0.0))
        return Link(_wrapped(best.theta_rad), best.d_m, best.a_m, _wrapped(best.alpha_rad), best.beta_rad)

    def miss(link: Link) -> float:
        return abs(_wrapped(link.theta_rad - drawn.theta_rad)) + abs(_wrapped(link.alpha_rad - drawn.alpha_rad))

    best = min(found, key=miss)
    theta = drawn.theta_rad + _wrapped(best.theta_rad - drawn.theta_rad)
    alpha = drawn.alpha_rad + _wrapped(best.alpha_rad - drawn.alpha_rad)
    return Link(theta, best.d_m, best.a_m, alpha, best.beta_rad)


def _link_transform(link: Link) -> Floats:
    turned = transform(exp_rotation(np.array([0.0, 0.0, link.theta_rad])), [0.0, 0.0, link.d_m])
    twisted = transform(exp_rotation(np.array([link.alpha_rad, 0.0, 0.0])), [link.a_m, 0.0, 0.0])
    tilted = transform(exp_rotation(np.array([0.0, link.beta_rad or 0.0, 0.0])), np.zeros(3))
    return turned @ twisted @ tilted


def _about(line: Line, turn_rad: float) -> Floats:
    """Turn about a line ``(4, 4)``."""
    R = exp_rotation(turn_rad * line.direction)
    return transform(R, line.point_m - R @ line.point_m)


def _wrapped(angle_rad: float) -> float:
    return float(np.angle(np.exp(1j * angle_rad)))
