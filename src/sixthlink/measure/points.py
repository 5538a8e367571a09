"""Where is a marked point in the robot's base frame?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.camera import CameraRig, triangulate
from sixthlink.geometry import Floats, transform_points
from sixthlink.recording import Detections, Rejection

__all__ = ["MarkPoint", "base_points", "mark_points"]


@dataclass(frozen=True, eq=False)
class MarkPoint:
    """One mark seen by the head in one shot.

    Attributes:
        shot: Index of the shot in the recording.
        mark: Index of the mark on the length standard.
        point_head: ``(3,)`` position in the head frame [m].
        covariance: ``(3, 3)`` of that position, from the pixels alone [m²].
        rms_px: RMS pixel residual of the triangulation [pixel].
    """

    shot: int
    mark: int
    point_head: Floats
    covariance: Floats
    rms_px: float


def mark_points(
    rig: CameraRig, detections: Detections, shot_ids: tuple[str, ...]
) -> tuple[tuple[MarkPoint, ...], tuple[Rejection, ...]]:
    """Triangulate every mark that at least two cameras saw.

    Args:
        rig: The head.
        detections: Marks seen, their point index being the mark.
        shot_ids: Names of the recording's shots, for the rejections.
    """
    found: list[MarkPoint] = []
    rejections: list[Rejection] = []
    for shot in np.unique(detections.shots):
        rows = np.flatnonzero(detections.shots == shot)
        for mark in np.unique(detections.points[rows]):
            seen = rows[detections.points[rows] == mark]
            noise_px = float(np.mean(detections.sigmas_px[seen]))
            try:
                point, covariance, rms_px = triangulate(
                    rig, detections.cameras[seen], detections.pixels[seen], noise_px
                )
            except ValueError as problem:
                rejections.append(Rejection(shot_ids[int(shot)], "", str(problem)))
            else:
                found.append(MarkPoint(int(shot), int(mark), point, covariance, rms_px))
    return tuple(found), tuple(rejections)


def base_points(points: tuple[MarkPoint, ...], Ts_outer: Floats, X: Floats) -> Floats:
    """Points ``(M, 3)`` carried by arm and head into the frame in which the standard stands still [m].

    Args:
        points: Marks in the head frame.
        Ts_outer: ``(N, 4, 4)`` T_base_flange (eye-in-hand) or T_flange_base (eye-to-hand) of every shot.
        X: ``(4, 4)`` the head.
    """
    shots = [p.shot for p in points]
    return transform_points(Ts_outer[shots] @ X, np.array([p.point_head for p in points]).reshape(-1, 3))
