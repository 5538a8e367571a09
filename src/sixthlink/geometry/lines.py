"""How do lines in space lie to each other: feet, distances, angles, common normals?

A line is a point on it and a unit direction. Lines carry leading batch axes like transforms do; the point may be any
point of the line, and no answer depends on which.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.geometry.arrays import Floats, frozen_floats
from sixthlink.geometry.transforms import transform_points

__all__ = ["CommonNormal", "Line", "common_normal", "distances_to_line", "feet_on_line", "moved_line"]


@dataclass(frozen=True, eq=False)
class Line:
    """Directed lines in space.

    Attributes:
        point_m: ``(..., 3)`` a point of each line [m].
        direction: ``(..., 3)`` unit vectors; made unit on the way in.
    """

    point_m: Floats
    direction: Floats

    def __post_init__(self) -> None:
        directions = _vectors(self.direction, "direction of a line")
        lengths = np.linalg.norm(directions, axis=-1, keepdims=True)
        if not (lengths > 0.0).all():
            raise ValueError("direction of a line has length 0")
        object.__setattr__(self, "point_m", _vectors(self.point_m, "point of a line"))
        object.__setattr__(self, "direction", _vectors(directions / lengths, "direction of a line"))


@dataclass(frozen=True, eq=False)
class CommonNormal:
    """The shortest connection of two lines.

    Attributes:
        feet_first_m: ``(..., 3)`` its end on the first line [m].
        feet_second_m: ``(..., 3)`` its end on the second line [m].
        distance_m: ``(...)`` its length [m].
        angle_rad: ``(...)`` angle between the directions, 0 to π.
    """

    feet_first_m: Floats
    feet_second_m: Floats
    distance_m: Floats
    angle_rad: Floats


def feet_on_line(line: Line, points_m: Floats) -> Floats:
    """Nearest points ``(..., 3)`` of a line to points ``(..., 3)`` [m]."""
    along = np.sum((points_m - line.point_m) * line.direction, axis=-1, keepdims=True)
    return line.point_m + along * line.direction


def distances_to_line(line: Line, points_m: Floats) -> Floats:
    """Distances ``(...)`` of points ``(..., 3)`` from a line [m]."""
    return np.linalg.norm(np.cross(points_m - line.point_m, line.direction), axis=-1)


def moved_line(T_a_b: Floats, line_b: Line) -> Line:
    """The same line in frame a."""
    return Line(transform_points(T_a_b, line_b.point_m), (T_a_b[..., :3, :3] @ line_b.direction[..., None])[..., 0])


def common_normal(first: Line, second: Line) -> CommonNormal:
    """Shortest connection of two lines, batch axes broadcast.

    Parallel lines have infinitely many; theirs starts at the first line's own point. Lines that are parallel but for
    noise have one, far away and without meaning: the angle tells.
    """
    across = np.cross(first.direction, second.direction)
    sine2 = np.sum(across**2, axis=-1, keepdims=True)
    gap = second.point_m - first.point_m
    parallel = sine2 < np.finfo(np.float64).eps ** 2
    safe = np.where(parallel, 1.0, sine2)
    # Solves gap + s2 d2 - s1 d1 = k (d1 × d2) for s1 by Cramer's rule.
    along = np.sum(np.cross(gap, second.direction) * across, axis=-1, keepdims=True) / safe
    feet_first = first.point_m + np.where(parallel, 0.0, along) * first.direction
    feet_second = feet_on_line(second, feet_first)
    # Where the lines are skew the triple product keeps the digits that a difference of feet would lose.
    skew = np.abs(np.sum(gap * across, axis=-1)) / np.sqrt(safe[..., 0])
    distance = np.where(parallel[..., 0], np.linalg.norm(feet_second - feet_first, axis=-1), skew)
    angle = np.arctan2(np.sqrt(sine2[..., 0]), np.sum(first.direction * second.direction, axis=-1))
    return CommonNormal(feet_first, feet_second, distance, angle)


def _vectors(values: Floats, name: str) -> Floats:
    return frozen_floats(values, [*[None] * (np.ndim(values) - 1), 3], name)
