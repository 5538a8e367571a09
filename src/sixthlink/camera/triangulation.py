"""Where in space is a point that several cameras saw, and how well is that known?"""

from __future__ import annotations

import numpy as np

from sixthlink.camera.camera import rays_from_pixels
from sixthlink.camera.rig import CameraRig
from sixthlink.camera.rig_jacobian import rig_pixels
from sixthlink.geometry import Floats, Ints

__all__ = ["triangulate"]


def triangulate(rig: CameraRig, cameras: Ints, pixels: Floats, noise_px: float) -> tuple[Floats, Floats, float]:
    """One point from its pixels in two or more cameras, by least squares on the pixels.

    Args:
        rig: The head.
        cameras: ``(M,)`` index of the camera of each pixel.
        pixels: ``(M, 2)`` pixels, M at least 2.
        noise_px: Standard deviation of a pixel coordinate [pixel].

    Returns:
        ``(3,)`` point in the head frame [m], its ``(3, 3)`` covariance [m²] and the RMS pixel residual per
        coordinate [pixel].

    Raises:
        ValueError: Fewer than two cameras saw the point, or the rays do not meet in front of them.
    """
    seen = np.asarray(cameras, dtype=np.int64)
    if len(set(seen.tolist())) < 2:
        raise ValueError("triangulation needs the point in at least two cameras")
    point = _midpoint(rig, seen, pixels)
    for _ in range(20):
        residual, jacobian = _residual(rig, seen, pixels, point)
        step = np.linalg.lstsq(jacobian, -residual, rcond=None)[0]
        point = point + step
        if np.linalg.norm(step) < 1e-12 * max(1.0, float(np.linalg.norm(point))):
            break
    residual, jacobian = _residual(rig, seen, pixels, point)
    covariance: Floats = np.asarray(noise_px**2 * np.linalg.inv(jacobian.T @ jacobian), dtype=np.float64)
    return point, covariance, float(np.sqrt(np.mean(residual**2)))


def _midpoint(rig: CameraRig, seen: Ints, pixels: Floats) -> Floats:
    """Point nearest to all rays: the start of the refinement."""
    A, b = np.zeros((3, 3)), np.zeros(3)
    for c, pixel in zip(seen.tolist(), pixels, strict=True):
        R, t = rig.Ts_camera_head[c, :3, :3], rig.Ts_camera_head[c, :3, 3]
        ray = R.T @ rays_from_pixels(rig.cameras[c], pixel)
        ray = ray / np.linalg.norm(ray)
        P = np.eye(3) - np.outer(ray, ray)
        A, b = A + P, b + P @ (-R.T @ t)
    return np.asarray(np.linalg.solve(A, b), dtype=np.float64)


def _residual(rig: CameraRig, seen: Ints, pixels: Floats, point: Floats) -> tuple[Floats, Floats]:
    predicted, by_point, _, visible = rig_pixels(rig, seen, np.tile(point, (len(seen), 1)))
    if not visible.all():
        raise ValueError("the rays do not meet in front of the cameras")
    return (predicted - pixels).ravel(), by_point.reshape(-1, 3)
