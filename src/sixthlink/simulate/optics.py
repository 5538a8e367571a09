"""Which direction does a simulated pixel look in, and where does a point fall on the simulated sensor?

The simulator's own lens, written in vectors instead of coordinates: with x the undistorted position and
p = (p2, p1) the tangential coefficients, the distorted position is

    x · ((1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶) + 2 p·x) + (p + a) r² + b r⁴,    r² = x·x

(Brown 1971), with a = (s1, s3) and b = (s2, s4) where the lens is built askew. A fisheye sees a point that stands at
the angle θ to its axis at the distance θ + k1 θ³ + k2 θ⁵ + k3 θ⁷ + k4 θ⁹ from the middle (Kannala and Brandt 2006).

It shares the nouns of the calibrator's cameras but none of their functions. The centre of the first pixel is
(0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sixthlink.camera import FISHEYE, Camera
from sixthlink.geometry import Floats

__all__ = ["RayMap", "ray_map", "sensor_positions"]

Singles = npt.NDArray[np.float32]

_ROWS_AT_ONCE = 16
_INVERSION_STEPS, _CLOSE = 60, 1e-9
_WIDEST_RAD = np.deg2rad(89.0)
"""Rays farther from the axis of a fisheye are taken for rays at this angle."""


@dataclass(frozen=True, eq=False)
class RayMap:
    """What every pixel of a camera looks at.

    Attributes:
        x: ``(h, w)`` undistorted x of the ray at z = 1.
        y: ``(h, w)`` undistorted y of the ray at z = 1.
        light: ``(h, w)`` natural vignetting: cos⁴ of the angle to the optical axis.
    """

    x: Singles
    y: Singles
    light: Singles


def sensor_positions(camera: Camera, points_camera: Floats) -> Floats:
    """Pixels ``(..., 2)`` on which points ``(..., 3)`` in camera coordinates [m] fall; z must be above 0."""
    x = np.moveaxis(points_camera[..., :2] / points_camera[..., 2:], -1, 0)
    return camera.centre_px + camera.focal_px * np.moveaxis(_seen_at(camera.model, camera.distortion, x), 0, -1)


def ray_map(camera: Camera) -> RayMap:
    """Rays of all pixels of a camera; the maps of the last two cameras are kept."""
    numbers = (*camera.focal_px, *camera.centre_px, *camera.distortion)
    return _ray_map(camera.width_px, camera.height_px, camera.model, tuple(float(n) for n in numbers))


@lru_cache(maxsize=2)
def _ray_map(width_px: int, height_px: int, model: str, numbers: tuple[float, ...]) -> RayMap:
    focal, centre, distortion = (np.array(n) for n in (numbers[:2], numbers[2:4], numbers[4:]))
    looking_at = _fisheye_ray if model == FISHEYE else _pinhole_ray
    x, y, light = (np.empty((height_px, width_px), dtype=np.float32) for _ in range(3))
    columns = (np.arange(width_px) - centre[0]) / focal[0]
    for top in range(0, height_px, _ROWS_AT_ONCE):
        block = slice(top, min(top + _ROWS_AT_ONCE, height_px))
        rows = (np.arange(block.start, block.stop) - centre[1]) / focal[1]
        ray = looking_at(distortion, np.stack(np.broadcast_arrays(columns[None, :], rows[:, None])))
        x[block], y[block] = ray
        light[block] = 1.0 / np.square(1.0 + ray[0] * ray[0] + ray[1] * ray[1])
    for array in (x, y, light):
        array.flags.writeable = False
    return RayMap(x, y, light)


def _seen_at(model: str, distortion: Floats, x: Floats) -> Floats:
    """Distorted position ``(2, ...)`` of undistorted ones."""
    if model == FISHEYE:
        r = np.hypot(*x)
        return np.asarray(x * (_bent_angle(distortion, np.arctan(r)) / np.maximum(r, 1e-12)))
    stretch, shift = _lens(distortion, x)
    return x * stretch + shift


def _pinhole_ray(distortion: Floats, seen: Floats) -> Floats:
    """Undistorted positions: undoing the lens again with the last answer converges, the quicker the less it bends."""
    ray = seen
    for _ in range(_INVERSION_STEPS):
        stretch, shift = _lens(distortion, ray)
        last, ray = ray, (seen - shift) / stretch
        if np.abs(ray - last).max() < _CLOSE:
            break
    return ray


def _fisheye_ray(distortion: Floats, seen: Floats) -> Floats:
    """Undistorted positions: the angle by bisection, since its polynomial grows up to the edge of what is seen."""
    distance = np.hypot(*seen)
    low, high = np.zeros_like(distance), np.full_like(distance, _WIDEST_RAD)
    for _ in range(_INVERSION_STEPS):
        middle = 0.5 * (low + high)
        beyond = _bent_angle(distortion, middle) > distance
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.asarray(seen * (np.tan(low) / np.maximum(distance, 1e-12)))


def _bent_angle(distortion: Floats, theta: Floats) -> Floats:
    """Distance from the middle at which a fisheye shows an angle."""
    k1, k2, _, _, k3, k4 = distortion[:6]
    square = theta * theta
    return np.asarray(theta * (1.0 + square * (k1 + square * (k2 + square * (k3 + square * k4)))))


def _lens(distortion: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Stretch ``(...)`` along x ``(2, ...)`` and shift ``(2, ...)`` beside it."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = distortion
    r2 = x[0] * x[0] + x[1] * x[1]
    bent = (1.0 + ((k3 * r2 + k2) * r2 + k1) * r2) / (1.0 + ((k6 * r2 + k5) * r2 + k4) * r2)
    stretch = bent + 2.0 * (p2 * x[0] + p1 * x[1])
    return stretch, np.stack([(p2 + s1 + s2 * r2) * r2, (p1 + s3 + s4 * r2) * r2])
