"""Where did the reflectors go while each joint turned, and where are the axes?

One picture in the base frame: the fitted circles thin, the measured arcs stronger, points coloured by the joint that
moved, free points soft, the axes of the joints, the tracker. Of records with many sweeps only some circles per joint
are drawn, and of many points only every so many.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from sixthlink.calibrate.tracked_arm import JointSweep, TrackedArm, TrackedAxis, needed_joints
from sixthlink.geometry import Circle, Floats, Ints, phases_on_circle, points_on_circle, transform_points
from sixthlink.recording import TrackerRecord
from sixthlink.report.eye import MARGIN, WIDTH, Eye, base_triad, floor_grid, grid_note
from sixthlink.report.svg import drawing, element, outline, text

__all__ = ["COLOURS", "along_arc", "circle_plot", "evenly"]

COLOURS = 6
"""Joints that have their own colour in the style sheet before colours repeat."""

SWEEPS_PER_JOINT = 6
MOST_DOTS, MOST_CROSSES = 3000, 300

FREE = -1
"""Stands for the joint where a point belongs to no sweep of one."""

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Path:
    """What a reflector drew in one sweep, in the base frame.

    Attributes:
        role: Class of the joint that moved.
        whole: ``(K, 3)`` the whole circle [m]; empty where the sweep cannot be believed.
        arc: ``(L, 3)`` the part that was measured [m].
    """

    role: str
    whole: Floats
    arc: Floats


@dataclass(frozen=True, eq=False)
class _Axis:
    """An axis as it is drawn: its joint's name and class, and both ends ``(2, 3)`` in the base frame [m]."""

    joint: str
    role: str
    ends: Floats


def circle_plot(result: TrackedArm, record: TrackerRecord) -> Markup:
    """Circles, points and axes in parallel projection, with a floor grid in round millimetres.

    Args:
        result: The calibration.
        record: The record that it is of.
    """
    T = result.T_base_tracker
    points, tracker, left = transform_points(T, record.points), T[:3, 3], _left_out(result, record)
    sweeps = _drawn_sweeps(result)
    paths = [path for sweep in sweeps for path in _paths(sweep, record, T)]
    lines = [line for path in paths for line in (path.whole, path.arc)]
    bare = np.concatenate([np.zeros((1, 3)), points[~left], *lines])
    length_m = 0.08 * float(np.ptp(bare, axis=0).max())
    axes = [_drawn_axis(result, axis, length_m) for axis in result.axes]
    drop = np.stack([tracker, tracker * [1.0, 1.0, 0.0]])
    eye = Eye.looking_at(np.concatenate([bare, *(axis.ends for axis in axes)]), drop)
    parts = floor_grid(eye)
    parts += [outline(eye(path.whole), f"round {path.role}") for path in paths if len(path.whole)]
    parts += [outline(eye(path.arc), f"arc {path.role}", closed=False) for path in paths]
    parts += _dots(eye, points, _joint_of(record, sweeps), left)
    parts += [outline(eye(axis.ends), f"joint-axis {axis.role}", closed=False) for axis in axes]
    parts += base_triad(eye, 1.4 * length_m)
    parts += _station(eye(drop))
    parts += _names(eye, axes)
    label = "The sweeps in the base frame: measured points, fitted circles, axes of the joints, tracker"
    return drawing(WIDTH, eye.height, parts, label=label)


def evenly(count: int, most: int) -> Ints:
    """At most ``most`` of the indices 0 to ``count`` - 1, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def along_arc(circle: Circle, points_m: Floats, kept: Mask) -> tuple[float, Floats]:
    """Where the shortest arc that holds the kept points begins [rad], and how far from there each lies ``(N,)`` [rad].

    Args:
        circle: The circle.
        points_m: ``(N, 3)`` points beside it, in its frame [m].
        kept: ``(N,)`` which of them belong to it, at least one.
    """
    phases = np.mod(phases_on_circle(circle, points_m), 2.0 * np.pi)
    ordered = np.sort(phases[kept])
    start = float(ordered[np.argmax(np.diff(ordered, prepend=ordered[-1] - 2.0 * np.pi))])
    along = np.mod(phases - start, 2.0 * np.pi)
    # A point that does not belong may lie before the first.
    before = along > np.pi + 0.5 * along[kept].max()
    return start, np.where(before, along - 2.0 * np.pi, along)


def _drawn_sweeps(result: TrackedArm) -> list[JointSweep]:
    """Declared sweeps before implied ones, of each joint at most ``SWEEPS_PER_JOINT``."""
    found: list[JointSweep] = []
    for joint in range(len(result.arm.joints)):
        declared = [s for s in result.sweeps if s.joint == joint and not s.implied]
        implied = [s for s in result.sweeps if s.joint == joint and s.implied]
        found += [declared[k] for k in evenly(len(declared), SWEEPS_PER_JOINT)]
        found += [implied[k] for k in evenly(len(implied), max(SWEEPS_PER_JOINT - len(declared), 0))]
    return found


def _paths(sweep: JointSweep, record: TrackerRecord, T_base_tracker: Floats) -> Iterator[_Path]:
    """The circles of a sweep; of one that cannot be believed only the arcs on which its points lie."""
    if sweep.fit is None:
        return
    points, fit = record.points[sweep.rows], sweep.fit
    for k, circle in enumerate(fit.circles):
        mine = fit.reflectors == k
        kept = fit.kept[mine]
        if not kept.any():
            continue
        start, along = along_arc(circle, points[mine], kept)
        arc = points_on_circle(circle, start + np.linspace(0.0, along[kept].max(), 48))
        around = np.linspace(0.0, 2.0 * np.pi, 96 if sweep.usable else 0, endpoint=False)
        whole = points_on_circle(circle, around)
        yield _Path(_role(sweep.joint), transform_points(T_base_tracker, whole), transform_points(T_base_tracker, arc))


def _drawn_axis(result: TrackedArm, axis: TrackedAxis, length_m: float) -> _Axis:
    """An axis that stands out of its circles by a length [m]."""
    heights = np.zeros(1)
    if axis.sweep is not None and axis.sweep.fit is not None:
        centres = np.array([circle.centre_m for circle in axis.sweep.fit.circles])
        heights = (centres - axis.axis.point_m) @ axis.axis.direction
    reach = np.array([heights.min() - length_m, heights.max() + length_m])
    ends = axis.axis.point_m + reach[:, None] * axis.axis.direction
    role = _role(result.arm.joints.index(axis.joint))
    return _Axis(axis.joint, role, transform_points(result.T_base_tracker, ends))


def _left_out(result: TrackedArm, record: TrackerRecord) -> Mask:
    """Points ``(M,)`` that a declared circle or the estimate left out, though their joints were known."""
    links = np.array([r.link for r in record.reflectors])[record.reflector_of]
    left = np.ones(len(record), dtype=np.bool_)
    left[list(result.used)] = False
    for link in np.unique(links).tolist():
        known = record.joints_known[:, needed_joints(result.arm, link)].all(axis=1)
        left[(links == link) & ~known] = False
    for sweep in result.sweeps:
        if sweep.fit is not None and not sweep.implied:
            left[sweep.rows[~sweep.fit.kept]] = True
    return left


def _joint_of(record: TrackerRecord, sweeps: Sequence[JointSweep]) -> Ints:
    """Index ``(M,)`` of the joint by which each point is coloured, or ``FREE``."""
    joints = np.array([FREE if s.joint is None else s.joint for s in record.sweeps], dtype=np.int64)[record.sweep_of]
    for sweep in sweeps:
        joints[sweep.rows[joints[sweep.rows] == FREE]] = sweep.joint
    return joints


def _role(joint: int) -> str:
    return f"g{joint % COLOURS}"


def _dots(eye: Eye, points: Floats, joints: Ints, left: Mask) -> list[Markup]:
    """Points that were used as dots, free ones first and soft; those that were left out as crosses inside the frame."""
    used = np.flatnonzero(~left)
    shown = used[evenly(len(used), MOST_DOTS)]
    shown = shown[np.argsort(joints[shown] != FREE, kind="stable")]
    parts = []
    for (u, v), joint in zip(eye(points[shown]).tolist(), joints[shown].tolist(), strict=True):
        role = "free" if joint == FREE else f"swept {_role(joint)}"
        parts.append(element("circle", cx=u, cy=v, r=1.4 if joint == FREE else 2.0, class_=role))
    crossed = np.flatnonzero(left)
    crossed = crossed[evenly(len(crossed), MOST_CROSSES)]
    for u, v in np.clip(eye(points[crossed]), 6.0, [WIDTH - 6.0, eye.height - 6.0]).tolist():
        parts.append(element("path", d=f"M{u - 4:.1f} {v - 4:.1f}l8 8m0 -8l-8 8", class_="left-out"))
    return parts


def _station(drop: Floats) -> list[Markup]:
    """The tracker as a mark, and the line ``(2, 2)`` from it to the floor."""
    u, v = drop[0].tolist()
    mark = outline(np.array([[u, v - 7.0], [u + 6.0, v], [u, v + 7.0], [u - 6.0, v]]), "station")
    inside = min(max(u, MARGIN), WIDTH - MARGIN)
    return [outline(drop, "drop", closed=False), mark, text(inside, v - 12.0, "tracker", "label", anchor="middle")]


def _names(eye: Eye, axes: Sequence[_Axis]) -> list[Markup]:
    """Names of the joints beyond the ends of their axes, moved apart where they would lie on each other."""
    parts = [grid_note(eye)]
    taken: list[tuple[float, float]] = []
    for axis in axes:
        tail, tip = eye(axis.ends)
        along = (tip - tail) / max(float(np.linalg.norm(tip - tail)), 1e-9)
        u, v = (tip + 12.0 * along + [0.0, 4.0]).tolist()
        while any(abs(u - a) < 8.0 * len(axis.joint) and abs(v - b) < 13.0 for a, b in taken):
            v += 2.0
        taken.append((u, v))
        parts.append(text(u, v, axis.joint, f"label {axis.role}", anchor="middle"))
    return parts
