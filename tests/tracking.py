"""Tracker records of a simulated arm, and the simple mistakes that people make with them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.files import load_arm
from sixthlink.geometry import Floats, inverse, transform_points
from sixthlink.recording import TrackerRecord
from sixthlink.robot import Arm, link_poses
from sixthlink.simulate import SCENARIOS, SimulatedTracking, TrackerSession, simulate_tracking

SCENARIO = replace(SCENARIOS["paper"], coupling_sigma=1e-3)


def irb1400() -> Arm:
    return load_arm("abb_irb1400", folder=Path())


def session(seed: int = 0, **changes) -> SimulatedTracking:
    return simulate_tracking(SCENARIO, replace(TrackerSession(), **changes), irb1400(), seed=seed)


def rows_of(record: TrackerRecord, rows) -> TrackerRecord:
    """The record with some of its points, and without reference points."""
    rows = np.flatnonzero(rows) if np.asarray(rows).dtype == bool else np.asarray(rows)
    used, seen = np.unique(record.sweep_of[rows]), np.unique(record.reflector_of[rows])
    return replace(
        record,
        sweeps=tuple(record.sweeps[s] for s in used),
        reflectors=tuple(record.reflectors[k] for k in seen),
        points=record.points[rows],
        names=tuple(record.names[i] for i in rows),
        sweep_of=np.searchsorted(used, record.sweep_of[rows]),
        reflector_of=np.searchsorted(seen, record.reflector_of[rows]),
        joints=record.joints[rows],
        joints_known=record.joints_known[rows],
        covariances=record.covariances[rows],
        oriented=record.oriented[rows],
        references=None,
    )


def moved_points(record: TrackerRecord, change) -> TrackerRecord:
    """All points, those on the ground too, after a change of the tracker's coordinates."""
    references = replace(record.references, points=change(record.references.points))
    return replace(record, points=change(record.points), references=references)


def fresh_poses(arm: Arm, count: int, seed: int) -> Floats:
    spare = 0.04 * np.diff(arm.limits, axis=1)[:, 0]
    low, high = arm.limits[:, 0] + spare, arm.limits[:, 1] - spare
    return np.random.default_rng(10_000 + seed).uniform(low, high, (count, len(arm.joints)))


def fresh_errors_m(found, sim: SimulatedTracking, count: int = 1000, seed: int = 0) -> Floats:
    """How far the reflector is from where the tracker would truly see it, at poses that nobody measured."""
    q = fresh_poses(found.nominal, count, seed)
    place = np.tile(found.reflectors[0].place_m, (count, 1))
    link = len(found.arm.joints)
    seen = transform_points(inverse(found.T_base_tracker), transform_points(link_poses(found.arm, q, link), place))
    return np.linalg.norm(seen - sim.truth.seen_at(q, "R1", link), axis=1)
