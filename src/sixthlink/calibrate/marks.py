"""Where in the head frame is a mark of the length standard, and how does that follow the cameras?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.camera import CameraRig, RigUnknowns, rig_pixels, triangulate
from sixthlink.geometry import Floats, Ints
from sixthlink.recording import Detections, Rejection

__all__ = ["MarkPoint", "mark_points"]


@dataclass(frozen=True, eq=False)
class MarkPoint:
    """One mark seen by the head in one shot.

    Attributes:
        shot: Index of the shot in the recording.
        mark: Index of the mark on the length standard.
        point_head: ``(3,)`` position in the head frame [m].
        covariance: ``(3, 3)`` of that position, from the pixels alone [m²].
        rms_px: RMS pixel residual of the triangulation [pixel].
        by_rig: ``(3, G)`` how the position follows the rig's unknowns.
    """

    shot: int
    mark: int
    point_head: Floats
    covariance: Floats
    rms_px: float
    by_rig: Floats


def mark_points(
    rig: CameraRig, detections: Detections, shot_ids: tuple[str, ...], unknowns: RigUnknowns | None = None
) -> tuple[tuple[MarkPoint, ...], tuple[Rejection, ...]]:
    """Triangulate every mark that at least two cameras saw.

    Args:
        rig: The head.
        detections: Marks seen, their point index being the mark.
        shot_ids: Names of the recording's shots, for the rejections.
        unknowns: What of the rig is uncertain; none by default.
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
                by_rig = _by_rig(rig, detections.cameras[seen], point, unknowns)
                found.append(MarkPoint(int(shot), int(mark), point, covariance, rms_px, by_rig))
    return tuple(found), tuple(rejections)


def _by_rig(rig: CameraRig, cameras: Ints, point: Floats, unknowns: RigUnknowns | None) -> Floats:
    """Derivative ``(3, G)`` of a triangulated point: the pixels stay, so the point makes up for the rig."""
    _, by_point, by_rig, _ = rig_pixels(rig, cameras, np.tile(point, (len(cameras), 1)), unknowns)
    J = by_point.reshape(-1, 3)
    return np.asarray(-np.linalg.lstsq(J, by_rig.reshape(len(J), -1), rcond=None)[0], dtype=np.float64)
