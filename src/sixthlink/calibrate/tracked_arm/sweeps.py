"""What does every sweep of a tracker record show: an axis, or why there is none?

A sweep's axis comes from the reflectors that the swept joint carries rigidly; behind a coupling (a parallelogram) a
reflector turns about other axes as well. Free measurements at the corners of a grid hold sweeps too: where only one
joint differs, its circle is fitted like any other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sixthlink.calibrate.tracker import (
    AxisFit,
    CircleFinding,
    NoCircleError,
    Sweep,
    arc_of,
    degrees,
    drift_findings,
    fit_axis,
    millimetres,
)
from sixthlink.geometry import Floats, Ints
from sixthlink.recording import TrackerRecord
from sixthlink.robot import Arm

__all__ = ["JointSweep", "followers", "joint_sweeps", "surest_sweeps", "tracker_findings"]

SAME_RAD = 2e-3
"""Joint values nearer than this count as one stop."""

FEWEST_IMPLIED, SHORTEST_IMPLIED_RAD = 6, np.deg2rad(30.0)
"""Points and arc from which free measurements count as a sweep."""


@dataclass(frozen=True, eq=False)
class JointSweep:
    """One sweep of one joint.

    Attributes:
        name: Its name; of free measurements, the name of the joint and where the others stood.
        joint: Index of the joint, from 0.
        rows: ``(N,)`` indices of its points in the record, those that say where the axis is.
        stop: ``(J,)`` middle value of every joint during the sweep [rad or m].
        fit: The axis; None where the points show no circle, or no reflector is carried rigidly.
        findings: Everything that it tells about itself.
        implied: Whether it was found in free measurements.
    """

    name: str
    joint: int
    rows: Ints
    stop: Floats
    fit: AxisFit | None
    findings: tuple[CircleFinding, ...]
    implied: bool = False

    @property
    def usable(self) -> bool:
        """Whether its axis can be used."""
        return self.fit is not None and not any(f.grave for f in self.findings)


def followers(arm: Arm, joint: int) -> Ints:
    """Joints that a joint drives by a coupling, from 0."""
    own = list(arm.own_steps)
    return np.array([f for f in range(len(own)) if f != joint and arm.joint_map[own[f], joint] != 0.0], dtype=np.int64)


def joint_sweeps(record: TrackerRecord, arm: Arm | None, covariances: Floats | None) -> tuple[JointSweep, ...]:
    """All sweeps of a record, in measured order, then those that its free measurements imply.

    Args:
        record: The record.
        arm: Its arm as far as known, for its couplings.
        covariances: ``(M, 3, 3)`` noise of every point, the arm's own share included [m²]; None where it is unknown.
    """
    found = [
        _fitted(record, arm, covariances, name=sweep.name, joint=sweep.joint, rows=np.flatnonzero(record.sweep_of == s))
        for s, sweep in enumerate(record.sweeps)
        if sweep.joint is not None and (record.sweep_of == s).any()
    ]
    for joint, rows in _implied(record):
        stop = np.median(record.joints[rows], axis=0)
        implied = _fitted(record, arm, covariances, name=_implied_name(arm, joint, stop), joint=joint, rows=rows)
        found.append(replace(implied, implied=True))
    return tuple(found)


def surest_sweeps(record: TrackerRecord, sweeps: Sequence[JointSweep]) -> dict[int, JointSweep]:
    """By joint the usable sweep whose direction is surest, among those that know their own and all earlier joints."""
    best: dict[int, JointSweep] = {}
    for sweep in sweeps:
        known = record.joints_known[sweep.rows][:, : sweep.joint + 1].all()
        if known and sweep.usable and sweep.fit is not None and sweep.fit.signed:
            other = best.get(sweep.joint)
            if other is None or sweep.fit.direction_uncertainty_rad < _doubt(other):
                best[sweep.joint] = sweep
    return best


def tracker_findings(record: TrackerRecord, noise_m: float | None) -> tuple[CircleFinding, ...]:
    """Whether the tracker stood still, by its reference points."""
    names = [record.sweeps[s].name for s in _in_order(record)]
    if record.references is None:
        return drift_findings([*names, "the end"], [{}] * (len(names) + 1), noise_m)
    groups: dict[str, dict[str, list[Floats]]] = {name: {} for name in names}
    groups["the end"] = {}
    for k, after in enumerate(record.references.after.tolist()):
        name = record.sweeps[int(record.sweep_of[after])].name if after < len(record) else "the end"
        reflector = record.reflectors[int(record.references.reflectors[k])].name
        groups[name].setdefault(reflector, []).append(record.references.points[k])
    measured = {name: group for name, group in groups.items() if group or name != "the end"}
    means = [{n: np.mean(points, axis=0) for n, points in group.items()} for group in measured.values()]
    stated = record.references.covariances
    if stated is not None:
        noise_m = float(np.sqrt(np.mean(np.einsum("kii->ki", stated))))
    return drift_findings(list(measured), means, noise_m)


def _doubt(sweep: JointSweep) -> float:
    return np.inf if sweep.fit is None else sweep.fit.direction_uncertainty_rad


def _in_order(record: TrackerRecord) -> list[int]:
    """Sweeps in the order of their first points."""
    return list(dict.fromkeys(record.sweep_of.tolist()))


def _fitted(
    record: TrackerRecord, arm: Arm | None, covariances: Floats | None, *, name: str, joint: int, rows: Ints
) -> JointSweep:
    stop = np.median(record.joints[rows], axis=0)
    links = np.array([r.link for r in record.reflectors])[record.reflector_of[rows]]
    behind = followers(arm, joint) if arm is not None else np.empty(0, dtype=np.int64)
    rigid = links <= (int(behind.min()) if len(behind) else len(stop))
    if not rigid.any():
        return JointSweep(name, joint, rows, stop, None, (_behind_a_coupling(record, rows, joint, int(behind.min())),))
    if arm is not None and not arm.turns[arm.own_steps[joint]]:
        words = "a sliding joint draws a line, not a circle; its points refine the arm"
        return JointSweep(name, joint, rows, stop, None, (CircleFinding("sliding joint", words, {}, grave=False),))
    rows = rows[rigid]
    present, index = np.unique(record.reflector_of[rows], return_inverse=True)
    known = record.joints_known[rows, joint].all()
    sweep = Sweep(
        record.points[rows],
        index.astype(np.int64).ravel(),
        tuple(record.reflectors[k].name for k in present),
        record.joints[rows, joint] if known else None,
        None if covariances is None else covariances[rows],
    )
    try:
        fit = fit_axis(sweep)
    except NoCircleError as problem:
        return JointSweep(name, joint, rows, stop, None, problem.findings)
    return JointSweep(name, joint, rows, stop, fit, fit.findings)


def _behind_a_coupling(record: TrackerRecord, rows: Ints, joint: int, follower: int) -> CircleFinding:
    names = ", ".join(record.reflectors[k].name for k in np.unique(record.reflector_of[rows]))
    words = (
        f"{names} rides behind the coupling of joint {follower + 1} to joint {joint + 1}: its path is not about the "
        f"axis of joint {joint + 1} alone and is not used as its circle; the points still refine the arm. Put a "
        f"reflector on link {joint + 1} to see the axis itself"
    )
    return CircleFinding("behind a coupling", words, {"link": float(follower + 1)}, grave=False)


def _implied(record: TrackerRecord) -> Iterator[tuple[int, Ints]]:
    """Free measurements of one reflector in which only one joint differs: the joint and the rows."""
    free = [s for s, sweep in enumerate(record.sweeps) if sweep.joint is None]
    rows = np.flatnonzero(np.isin(record.sweep_of, free) & record.joints_known.all(axis=1))
    if len(rows) < FEWEST_IMPLIED:
        return
    stops = np.column_stack([_stops_of(record.joints[rows, j]) for j in range(record.joints.shape[1])])
    for j in range(stops.shape[1]):
        keys = np.column_stack([np.delete(stops, j, axis=1), record.reflector_of[rows]])
        group_of = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
        for g in np.flatnonzero(np.bincount(group_of) >= FEWEST_IMPLIED).tolist():
            members = rows[group_of == g]
            if arc_of(record.joints[members, j]) >= SHORTEST_IMPLIED_RAD:
                yield j, members


def _implied_name(arm: Arm | None, joint: int, stop: Floats) -> str:
    """The joint that turns, and where the others stand."""
    names = [f"q{j + 1}" for j in range(len(stop))] if arm is None else list(arm.joints)
    slides = [arm is not None and not arm.turns[step] for step in (range(len(stop)) if arm is None else arm.own_steps)]
    others = [
        f"{name} = {millimetres(v) if slide else degrees(v)}"
        for j, (name, v, slide) in enumerate(zip(names, stop.tolist(), slides, strict=True))
        if j != joint
    ]
    return f"{names[joint]} turning" + (f", {', '.join(others)}" if others else "")


def _stops_of(values: Floats) -> Ints:
    """Number of the stop of each joint value: values nearer than ``SAME_RAD`` to a neighbour share one."""
    order = np.argsort(values, kind="stable")
    numbers = np.empty(len(values), dtype=np.int64)
    numbers[order] = np.concatenate([[0], np.cumsum(np.diff(values[order]) > SAME_RAD)])
    return numbers
