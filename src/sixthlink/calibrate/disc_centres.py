"""Where would the middle of each disc be seen, where the middle of its image was found?

A disc is seen as an ellipse, and the ellipse's middle is not the image of the disc's: near and far half are not
foreshortened alike. With the disc's middle C, its normal n, its distance d = n·C from the camera and its radius ρ, a
ray x meets its rim where

    xᵀ M x = 0,   M = d² I - d (C nᵀ + n Cᵀ) + (|C|² - ρ²) n nᵀ

and the ellipse's middle c in the plane z = 1 solves M₂₂ c = -m, with M₂₂ the upper left block and m the upper right
column. The lens then bends the ellipse, which moves its middle again. What is found less the difference between that
and the image of C is where the middle would be seen; it needs the target's pose only roughly, and is found with the
poses that the uncorrected middles give, twice.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sixthlink.calibrate.target_poses import locate_targets
from sixthlink.camera import Camera, CameraRig, pixels_from_points
from sixthlink.geometry import Floats, Ints
from sixthlink.recording import BOARD_KINDS, Detections, Recording, joined, selected

__all__ = ["boards_with_disc_centres", "eccentricities", "with_disc_centres"]

ROUNDS = 2

CORNERS = 32
"""Corners of the polygon that shows what the lens does to a disc's image."""


def boards_with_disc_centres(recording: Recording, detections: Detections, rig: CameraRig) -> Detections:
    """The same for all shots of a recording's target; those of marks stay as they are."""
    target = recording.target
    if target is None or not target.circle_radii_m.any():
        return detections
    boards = np.array([kind in BOARD_KINDS for kind in recording.kinds])[detections.shots]
    corrected = with_disc_centres(
        rig,
        target.points_m,
        target.circle_radii_m,
        selected(detections, boards),
        recording.ids,
        turn=target.turn,
    )
    return joined([corrected, selected(detections, ~boards)])


def with_disc_centres(
    rig: CameraRig,
    points_m: Floats,
    radii_m: Floats,
    detections: Detections,
    shot_ids: tuple[str, ...],
    *,
    turn: Ints | None,
) -> Detections:
    """Detections in which ellipses' middles have become the images of the discs' middles.

    Args:
        rig: The cameras, roughly.
        points_m: ``(P, 3)`` middles of the target's discs [m].
        radii_m: ``(P,)`` their radii [m].
        detections: What was found in images of the target.
        shot_ids: Names of the recording's shots.
        turn: As in :func:`~.target_poses.locate_targets`.
    """
    corrected = detections
    for _ in range(ROUNDS):
        poses = locate_targets(rig, points_m, corrected, shot_ids, turn=turn)
        shifts = np.zeros_like(detections.pixels)
        for shot, T_head_target in zip(poses.shots.tolist(), poses.Ts_head_target, strict=True):
            for c in range(len(rig.cameras)):
                rows = np.flatnonzero((detections.shots == shot) & (detections.cameras == c))
                if len(rows):
                    T_camera_target = rig.Ts_camera_head[c] @ T_head_target
                    points, radii = points_m[detections.points[rows]], radii_m[detections.points[rows]]
                    shifts[rows] = eccentricities(rig.cameras[c], T_camera_target, points, radii)
        corrected = replace(detections, pixels=detections.pixels - shifts)
    located = np.isin(detections.shots, poses.shots)
    return selected(corrected, located)


def eccentricities(camera: Camera, T_camera_target: Floats, points_m: Floats, radii_m: Floats) -> Floats:
    """Middle of each disc's image less the image of its middle ``(N, 2)`` [pixel].

    Args:
        camera: The camera.
        T_camera_target: ``(4, 4)`` where the target is.
        points_m: ``(N, 3)`` middles of the discs in the target's frame [m].
        radii_m: ``(N,)`` their radii [m].
    """
    R, t = T_camera_target[:3, :3], T_camera_target[:3, 3]
    C, n = points_m @ R.T + t, R[:, 2]
    d = C @ n
    cross = C[:, :, None] * n + n[:, None] * C[:, None, :]
    size = np.sum(C**2, axis=1) - radii_m**2
    M = d[:, None, None] ** 2 * np.eye(3) - d[:, None, None] * cross + size[:, None, None] * np.outer(n, n)
    middle = -np.linalg.solve(M[:, :2, :2], M[:, :2, 2:])[:, :, 0]
    # The lens bends the rim too: what it does to the middle of a polygon on the rim, it does to that of the ellipse.
    turn = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    round_ = np.column_stack([np.cos(turn), np.sin(turn)]) @ R[:, :2].T
    rims = C[:, None] + radii_m[:, None, None] * round_
    plain = rims[..., :2] / rims[..., 2:]
    straight = (middle - _middles(plain)) * camera.focal_px
    return _middles(pixels_from_points(camera, rims)) + straight - pixels_from_points(camera, C)


def _middles(polygons: Floats) -> Floats:
    """Middle of the area ``(N, 2)`` of polygons ``(N, K, 2)``."""
    first = polygons[:, :1]
    u, v = np.moveaxis(polygons - first, -1, 0)
    cross = u * np.roll(v, -1, axis=1) - np.roll(u, -1, axis=1) * v
    moments = [np.sum((a + np.roll(a, -1, axis=1)) * cross, axis=1) for a in (u, v)]
    return first[:, 0] + np.stack(moments, axis=1) / (3.0 * np.sum(cross, axis=1, keepdims=True))
