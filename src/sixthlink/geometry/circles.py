"""Where do points lie beside a circle in space, and which circle passes through three of them?

A circle is its centre, a unit normal and a radius, with leading batch axes. Points are told by three numbers: their
phase about the normal (right-hand rule), how far outside and how far above they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.geometry.arrays import Floats, frozen_floats
from sixthlink.geometry.lines import Line
from sixthlink.geometry.transforms import transform_points

__all__ = [
    "Circle",
    "across_axes",
    "axis_of_circle",
    "beside_circle",
    "circle_through",
    "moved_circle",
    "phases_on_circle",
    "points_on_circle",
]


@dataclass(frozen=True, eq=False)
class Circle:
    """Circles in space.

    Attributes:
        centre_m: ``(..., 3)`` [m].
        normal: ``(..., 3)`` unit vectors; made unit on the way in. Phases grow about them by the right-hand rule.
        radius_m: ``(...)`` [m], not negative.
    """

    centre_m: Floats
    normal: Floats
    radius_m: Floats

    def __post_init__(self) -> None:
        axis = Line(self.centre_m, self.normal)
        radii = frozen_floats(self.radius_m, [None] * np.ndim(self.radius_m), "radius of a circle")
        if not (radii >= 0.0).all():
            raise ValueError("radius of a circle is negative")
        object.__setattr__(self, "centre_m", axis.point_m)
        object.__setattr__(self, "normal", axis.direction)
        object.__setattr__(self, "radius_m", radii)


def across_axes(directions: Floats) -> Floats:
    """Frames ``(..., 3, 3)`` whose rows are two unit vectors across each direction and the direction, right-handed.

    The first is the coordinate axis that the direction is least along, made perpendicular: no direction is singular.
    """
    n = np.asarray(directions, dtype=np.float64)
    n = n / np.linalg.norm(n, axis=-1, keepdims=True)
    axis = np.eye(3)[np.argmin(np.abs(n), axis=-1)]
    first = axis - np.sum(axis * n, axis=-1, keepdims=True) * n
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([first, np.cross(n, first), n], axis=-2)


def axis_of_circle(circle: Circle) -> Line:
    """The line through the centre along the normal."""
    return Line(circle.centre_m, circle.normal)


def points_on_circle(circle: Circle, phases_rad: Floats) -> Floats:
    """Points ``(..., 3)`` at phases ``(...)`` counted from the first axis of :func:`across_axes` [m]."""
    frame = across_axes(circle.normal)
    phases = np.asarray(phases_rad, dtype=np.float64)[..., None]
    spoke = np.cos(phases) * frame[..., 0, :] + np.sin(phases) * frame[..., 1, :]
    return circle.centre_m + circle.radius_m[..., None] * spoke


def phases_on_circle(circle: Circle, points_m: Floats) -> Floats:
    """Phases ``(...)`` of points ``(..., 3)`` in (-π, π]: the inverse of :func:`points_on_circle`."""
    frame = across_axes(circle.normal)
    v = points_m - circle.centre_m
    return np.arctan2(np.sum(v * frame[..., 1, :], axis=-1), np.sum(v * frame[..., 0, :], axis=-1))


def beside_circle(circle: Circle, points_m: Floats) -> Floats:
    """How far points lie outside and above a circle ``(..., 2)`` [m]; together their distance from it."""
    v = points_m - circle.centre_m
    above = np.sum(v * circle.normal, axis=-1)
    outside = np.linalg.norm(v - above[..., None] * circle.normal, axis=-1) - circle.radius_m
    return np.stack([outside, above], axis=-1)


def moved_circle(T_a_b: Floats, circle_b: Circle) -> Circle:
    """The same circle in frame a."""
    normal = (T_a_b[..., :3, :3] @ circle_b.normal[..., None])[..., 0]
    return Circle(transform_points(T_a_b, circle_b.centre_m), normal, circle_b.radius_m)


def circle_through(triples_m: Floats) -> Circle:
    """Circles through three points each; the phases of the points grow in their order.

    Args:
        triples_m: ``(..., 3, 3)``, one point per row [m].

    Raises:
        ValueError: Three points are on one line.
    """
    a = triples_m[..., 1, :] - triples_m[..., 0, :]
    b = triples_m[..., 2, :] - triples_m[..., 0, :]
    normal = np.cross(a, b)
    twice2 = np.sum(normal**2, axis=-1, keepdims=True)
    if not (twice2 > 0.0).all():
        raise ValueError("three points on one line have no circle")
    a2, b2 = np.sum(a**2, axis=-1, keepdims=True), np.sum(b**2, axis=-1, keepdims=True)
    # Circumcentre of a triangle with one corner at zero.
    offset = np.cross(a2 * b - b2 * a, normal) / (2.0 * twice2)
    return Circle(triples_m[..., 0, :] + offset, normal, np.linalg.norm(offset, axis=-1))
