"""Where are the axes of the calibrated arm, how surely, and do the sweeps show the axes that the arm has?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sixthlink.calibrate.arm import arm_with_steps
from sixthlink.calibrate.joint import Estimate, shared_covariance
from sixthlink.calibrate.observations import JointState
from sixthlink.calibrate.tracked_arm.sweeps import JointSweep
from sixthlink.calibrate.tracked_arm.tracked_arm import TrackedAxis
from sixthlink.calibrate.tracker import CircleFinding
from sixthlink.geometry import Floats, Line, apply_motion, common_normal, inverse, moved_line
from sixthlink.robot import Arm, link_poses
from sixthlink.solvers import covariance_of_own
from sixthlink.units import DEG, MM

__all__ = ["arm_axes", "misplaced_axis", "tracked_axes"]

STEP = 1e-6

FAR_M, FAR_RAD = 30.0 * MM, 3.0 * DEG
"""How far an axis may lie from where the arm has it before it is another joint's: no arm is off by as much."""


def arm_axes(arm: Arm, T_base_instrument: Floats, stop: Floats) -> tuple[Line, ...]:
    """Axis of every joint in the instrument's frame; its joint grows about it by the right hand.

    Args:
        arm: The arm.
        T_base_instrument: ``(4, 4)`` where the instrument stands.
        stop: ``(J,)`` joint values [rad or m].
    """
    lines = []
    for j, step in enumerate(arm.own_steps):
        # A joint's own step is the first of its link: its axis is fixed on the link before.
        T_base_before = link_poses(arm, stop[None], j)[0]
        sign = 1.0 if arm.joint_map[step, j] > 0.0 else -1.0
        axis = sign * np.eye(3)["xyz".index(arm.kinds[step][1])]
        lines.append(moved_line(inverse(T_base_instrument) @ T_base_before, Line(np.zeros(3), axis)))
    return tuple(lines)


def tracked_axes(found: Estimate, sweeps: Mapping[int, JointSweep], home: Floats) -> tuple[TrackedAxis, ...]:
    """Axes of the calibrated arm where they were swept, with what the covariance leaves them.

    Args:
        found: The estimate.
        sweeps: The surest sweep of the joints that have one.
        home: ``(J,)`` joint values for the others.
    """
    arm = found.fit.state.arm
    shared = shared_covariance(found.fit)
    own, crossed = covariance_of_own(found.fit.reduced.own[found.fit.own.index("instruments")], shared)
    at = found.problem.columns.arm_slice
    covariance = np.block([[shared[at, at], crossed[0].T[at]], [crossed[0][:, at], own[0]]])
    axes = []
    for j, step in enumerate(arm.own_steps):
        if not arm.turns[step]:
            continue
        sweep = sweeps.get(j)
        stop = home if sweep is None else sweep.stop
        foot = None if sweep is None or sweep.fit is None else sweep.fit.axis.point_m
        line = _line(found, found.fit.state, stop, j, foot)
        slopes = _slopes(found, stop, j, line)
        spread = slopes @ covariance @ slopes.T
        axes.append(
            TrackedAxis(
                arm.joints[j],
                stop,
                line,
                float(np.sqrt(np.linalg.eigvalsh(spread[3:, 3:])[-1])),
                float(np.sqrt(np.linalg.eigvalsh(spread[:3, :3])[-1])),
                sweep,
            )
        )
    return tuple(axes)


def misplaced_axis(sweep: JointSweep, lines: Sequence[Line], joints: Sequence[str]) -> CircleFinding | None:
    """Whether a sweep shows another axis than its joint's, and whose.

    Args:
        sweep: A usable sweep.
        lines: The axis of every joint as the arm has it at the sweep's stop.
        joints: Their names.
    """
    if sweep.fit is None:
        return None
    seen, own = sweep.fit.axis, lines[sweep.joint]
    if not _apart(seen, own):
        return None
    name = joints[sweep.joint]
    distance, angle = _gap(seen, own)
    words = f"its axis is {distance / MM:.3g} mm and {angle / DEG:.3g}° from where the arm has that of {name}"
    figures = {"distance_m": distance, "angle_rad": angle}
    others = [joints[j] for j, line in enumerate(lines) if j != sweep.joint and not _apart(seen, line)]
    if others:
        return CircleFinding("wrong joint", f"{words}, and lies on that of {others[0]}: {others[0]} moved", figures)
    if angle < FAR_RAD or angle > np.pi - FAR_RAD:
        words += (
            ", parallel to it: the reflector rides on a link that keeps its attitude (a parallelogram); correct the "
            "reflector's link, or the couplings of the arm's file, and put a reflector on the lower arm"
        )
        return CircleFinding("displaced axis", words, figures)
    cure = "another joint moved, two moved at once, or the other joints were not where the record says"
    return CircleFinding("misplaced axis", f"{words}: {cure}", figures)


def _apart(a: Line, b: Line) -> bool:
    distance, angle = _gap(a, b)
    return distance > FAR_M or min(angle, np.pi - angle) > FAR_RAD


def _gap(a: Line, b: Line) -> tuple[float, float]:
    """Distance [m] of a's point from b, and angle [rad] between them."""
    return (
        float(np.linalg.norm(np.cross(a.point_m - b.point_m, b.direction))),
        float(common_normal(a, b).angle_rad),
    )


def _line(found: Estimate, state: JointState, stop: Floats, joint: int, foot: Floats | None) -> Line:
    """The axis, its point nearest to ``foot`` where that is given."""
    line = arm_axes(state.arm, state.Ts_base_instrument[0], stop)[joint]
    if foot is None:
        return line
    return Line(line.point_m + ((foot - line.point_m) @ line.direction) * line.direction, line.direction)


def _slopes(found: Estimate, stop: Floats, joint: int, line: Line) -> Floats:
    """``(6, A + 6)`` how arm and instrument move the axis: its nearest point to the present one, and its direction."""
    columns, state = found.problem.columns, found.fit.state
    A = len(columns.arm)
    slopes = np.zeros((6, A + 6))
    for k in range(A + 6):
        ends = []
        for side in (-STEP, STEP):
            steps = np.zeros(A + 6)
            steps[k] = side
            arm = arm_with_steps(state.arm, columns.arm, steps[:A])
            moved = replace(state, arm=arm, Ts_base_instrument=apply_motion(state.Ts_base_instrument, steps[None, A:]))
            end = _line(found, moved, stop, joint, line.point_m)
            ends.append(np.concatenate([end.point_m, end.direction]))
        slopes[:, k] = (ends[1] - ends[0]) / (2.0 * STEP)
    return slopes
