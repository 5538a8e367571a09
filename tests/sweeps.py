"""Sweeps of one joint as a tracker sees them, for the tests of circle points."""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.tracker import Sweep, sweep_of
from sixthlink.geometry import Floats, Line, exp_rotation, moved_line, transform, transform_points

NOISE_M = 2e-5
RADIUS_M = 0.8


def angles(arc_deg: float = 120.0, points: int = 30) -> Floats:
    return np.linspace(-0.4, -0.4 + np.deg2rad(arc_deg), points)


def circle(q: Floats, radius_m: float = RADIUS_M, height_m: float = 0.0, phase: float = 0.3) -> Floats:
    """Points of a reflector that turns about z by q."""
    return np.column_stack([radius_m * np.cos(q + phase), radius_m * np.sin(q + phase), height_m + 0.0 * q])


def anywhere(seed: int) -> Floats:
    """Where the joint stands in the tracker's frame."""
    rng = np.random.default_rng(seed)
    return transform(exp_rotation(rng.uniform(-2, 2, 3)), rng.uniform(-3, 3, 3))


def true_axis(seed: int) -> Line:
    return moved_line(anywhere(seed), Line(np.zeros(3), np.array([0.0, 0.0, 1.0])))


def seen(points_m: Floats, seed: int, noise_m: float = NOISE_M) -> Floats:
    """The points in the tracker's frame, with its noise."""
    rng = np.random.default_rng(seed + 1000)
    return transform_points(anywhere(seed), points_m) + noise_m * rng.normal(size=points_m.shape)


def good_sweep(seed: int, arc_deg: float = 120.0, points: int = 30, *, stated: bool = True) -> Sweep:
    """A sweep with nothing wrong: unequal steps, joints that repeat to 0.02 mm."""
    rng = np.random.default_rng(seed + 2000)
    q = np.deg2rad(arc_deg) * np.r_[0.0, np.sort(rng.uniform(0.0, 1.0, points - 2)), 1.0]
    read = q + 2e-5 / RADIUS_M * rng.normal(size=points)
    return sweep_of(seen(circle(q), seed), angles_rad=read, noise_m=NOISE_M if stated else None)
