"""Where do points of the base frame appear in a picture of what stood where?

Parallel projection from the side and above, turned so that the base appears on the left and the work on the right. The
floor grid in round millimetres and the base frame itself belong to every such picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from sixthlink.geometry import Floats
from sixthlink.report.quantities import millimetres
from sixthlink.report.svg import outline, text, tick_step
from sixthlink.units import DEG, MM

__all__ = ["MARGIN", "WIDTH", "Eye", "base_triad", "floor_grid", "grid_note"]

WIDTH, MARGIN, TALLEST = 860.0, 34.0, 620.0
ELEVATION_RAD = 24.0 * DEG
ASIDE_RAD = 62.0 * DEG
"""Angle at the base between eye and work: the base then appears on the left, the work on the right."""


@dataclass(frozen=True, eq=False)
class Eye:
    """Where points of the base frame appear.

    Attributes:
        projection: ``(2, 3)`` parallel projection [drawing units per m].
        origin: ``(2,)`` where the base appears.
        height: Height of a drawing that holds everything.
        grid_m: Step of the floor grid [m].
        floor: Lowest and highest x and y ``(2,)`` of that grid [m].
    """

    projection: Floats
    origin: Floats
    height: float
    grid_m: float
    floor: tuple[Floats, Floats]

    @staticmethod
    def looking_at(points: Floats, beside: Floats | None = None) -> Eye:
        """The eye whose picture holds all points.

        Args:
            points: ``(M, 3)`` what stands on the floor and must fit into the picture, in the base frame [m].
            beside: ``(K, 3)`` what must fit as well, but need not stand on the drawn floor [m].
        """
        work = points.mean(axis=0)
        azimuth = np.arctan2(work[1], work[0]) - ASIDE_RAD
        c, s, e = np.cos(azimuth), np.sin(azimuth), ELEVATION_RAD
        axes = np.array([[-s, c, 0.0], [c * np.sin(e), s * np.sin(e), -np.cos(e)]])
        span = float(np.ptp(points[:, :2], axis=0).max())
        grid_m = tick_step(max(span, 1e-3) / MM, 8) * MM
        low = np.floor(points[:, :2].min(axis=0) / grid_m) * grid_m
        high = np.ceil(points[:, :2].max(axis=0) / grid_m) * grid_m
        corners = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
        everything = [points, corners] if beside is None else [points, corners, beside]
        flat = np.concatenate(everything) @ axes.T
        left_top, size = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-6)
        scale = min((WIDTH - 2 * MARGIN) / size[0], TALLEST / size[1])
        aside = np.array([(WIDTH - scale * size[0]) / 2, MARGIN])
        return Eye(axes * scale, aside - left_top * scale, float(scale * size[1] + 2 * MARGIN), grid_m, (low, high))

    def __call__(self, points_base: Floats) -> Floats:
        """Where points ``(..., 3)`` of the base frame [m] appear ``(..., 2)``."""
        return points_base @ self.projection.T + self.origin


def floor_grid(eye: Eye) -> list[Markup]:
    """The base's xy plane in round steps."""
    low, high = eye.floor
    parts: list[Markup] = []
    for axis in (0, 1):
        steps = round((high[axis] - low[axis]) / eye.grid_m)
        for k in range(steps + 1):
            ends = np.array([[*low, 0.0], [*high, 0.0]])
            ends[:, axis] = low[axis] + k * eye.grid_m
            parts.append(outline(eye(ends), "grid", closed=False))
    return parts


def grid_note(eye: Eye) -> Markup:
    """The step of the floor grid in words."""
    return text(MARGIN / 2, eye.height - 8, f"floor grid {millimetres(eye.grid_m, 0)}", "note")


def base_triad(eye: Eye, length_m: float) -> list[Markup]:
    """The base frame, its axes of a length [m]."""
    parts: list[Markup] = []
    start = eye(np.zeros(3))
    for axis in range(3):
        tip = eye(np.eye(3)[axis] * length_m)
        u, v = start + (tip - start) * 1.12
        parts.append(outline(np.stack([start, tip]), f"triad t{axis}", closed=False))
        parts.append(text(float(u), float(v) + 4, "xyz"[axis], f"label t{axis}", anchor="middle"))
    inside = max(float(start[0]) - 8, MARGIN)  # the word needs as much room as the margin gives
    parts.append(text(inside, float(start[1]) + 16, "base", "label", anchor="end"))
    return parts
