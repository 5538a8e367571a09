"""From which lens does the refinement of a camera start, and which of its views does it refuse?

From OpenCV's planar calibration (Zhang 2000), one camera at a time; where the field of view is so wide that this fails,
from a fisheye.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.fisheye_start import guessed_fisheye
from sixthlink.calibrate.rig_refinement import unseen_lens
from sixthlink.calibrate.target_poses import MINIMUM_POINTS, locate_targets
from sixthlink.camera import Camera, CameraRig, rays_from_pixels
from sixthlink.errors import CalibrationError, TooFewShotsError
from sixthlink.geometry import Floats
from sixthlink.recording import CameraDescription, Detections

__all__ = ["FEWEST_VIEWS", "LensStart", "beyond_reason", "start_lens", "view_poses", "views_beyond"]

FEWEST_VIEWS = 3
"""Shots that a lens, or the pose of a camera beside the reference, needs at least."""

OUTLIER_FACTOR, OUTLIER_FLOOR_PX = 4.0, 0.1
"""A view is refused when its RMS exceeds both this multiple of the median and this many pixels."""

WELL_EXPLAINED_PX, FAR_BETTER = 0.3, 0.5
"""A pinhole lens that leaves more than this gives way to a fisheye that leaves less than this share of it."""

NARROW = 0.5
"""Distance from the image's centre, in focal lengths, that the points of every lens reach that may be a fisheye."""


@dataclass(frozen=True, eq=False)
class LensStart:
    """First intrinsics of one camera, and the shots that it refused on the way."""

    camera: Camera
    refused: dict[int, str]


def views_beyond(rms_px: Floats) -> list[int]:
    """Positions of the views whose RMS is way beyond that of the others."""
    limit = max(OUTLIER_FACTOR * float(np.median(rms_px)), OUTLIER_FLOOR_PX)
    return [int(k) for k in np.flatnonzero(rms_px > limit)]


def start_lens(description: CameraDescription, points_m: Floats, seen: Detections) -> LensStart:
    """First intrinsics of one camera from its own views alone.

    Args:
        description: What is known of the camera.
        points_m: ``(P, 3)`` points of the target, all at z = 0 [m].
        seen: What this camera saw.

    Raises:
        TooFewShotsError: Fewer than three views with six points.
        CalibrationError: The views do not determine a lens.
    """
    shots = [int(s) for s in np.unique(seen.shots) if np.count_nonzero(seen.shots == s) >= MINIMUM_POINTS]
    refused: dict[int, str] = {}
    while True:
        if len(shots) < FEWEST_VIEWS:
            raise TooFewShotsError(
                f"camera {description.name!r}: {len(shots)} usable views, expected at least {FEWEST_VIEWS} with "
                f"{MINIMUM_POINTS} points each; record more shots of the tilted target, or give the intrinsics",
                needed=FEWEST_VIEWS,
                usable=len(shots),
            )
        camera, rms_px = _calibrated(description, points_m, seen, shots)
        beyond = views_beyond(rms_px)
        if not beyond:
            return LensStart(camera, refused)
        median = float(np.median(rms_px))
        for k in beyond:
            refused[shots[k]] = beyond_reason(float(rms_px[k]), median)
        shots = [s for s in shots if s not in refused]


def beyond_reason(rms_px: float, median_px: float) -> str:
    """Why a view with such an RMS was refused."""
    return (
        f"its RMS of {rms_px:.2f} pixel is way beyond the median of {median_px:.2f}; blurred, or has the target "
        "moved or bent?"
    )


def _calibrated(
    description: CameraDescription, points_m: Floats, seen: Detections, shots: list[int]
) -> tuple[Camera, Floats]:
    """The first lens and the RMS of each view per coordinate [pixel]."""
    try:
        camera, per_view = _pinhole(description, points_m, seen, shots)
    except CalibrationError:
        wide = guessed_fisheye(description, points_m, seen, shots)
        if wide is None:
            raise
        return wide
    farthest = float(np.linalg.norm((seen.pixels - camera.centre_px) / camera.focal_px, axis=1).max())
    if np.median(per_view) > WELL_EXPLAINED_PX and farthest > NARROW:
        wide = guessed_fisheye(description, points_m, seen, shots)
        if wide is not None and np.median(wide[1]) < FAR_BETTER * np.median(per_view):
            return wide
    return camera, per_view


def _pinhole(
    description: CameraDescription, points_m: Floats, seen: Detections, shots: list[int]
) -> tuple[Camera, Floats]:
    """OpenCV's answer with k1, k2, p1, p2 and the RMS of each view per coordinate [pixel].

    A lens so wide that the polynomial folds inside the image is started with the rational terms.
    """
    import cv2

    plain = cv2.CALIB_FIX_K3 | (cv2.CALIB_ZERO_TANGENT_DIST if len(shots) < 6 else 0)
    camera, per_view = _by_opencv(description, points_m, seen, shots, plain)
    try:
        rays_from_pixels(camera, seen.pixels)
    except ValueError:
        camera, per_view = _by_opencv(description, points_m, seen, shots, cv2.CALIB_RATIONAL_MODEL)
    return camera, per_view


def _by_opencv(
    description: CameraDescription, points_m: Floats, seen: Detections, shots: list[int], flags: int
) -> tuple[Camera, Floats]:
    import cv2

    rows = [seen.shots == shot for shot in shots]
    objects = [points_m[seen.points[r]].astype(np.float32) for r in rows]
    images = [seen.pixels[r].astype(np.float32) for r in rows]
    size = (description.width_px, description.height_px)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
    K0, k0 = np.eye(3), np.zeros(8 if flags & cv2.CALIB_RATIONAL_MODEL else 5)
    try:
        _, K, k, _, _, _, _, per_view = cv2.calibrateCameraExtended(
            objects, images, size, K0, k0, flags=flags, criteria=criteria
        )
        lens = np.asarray(K, dtype=np.float64)
        terms = np.asarray(k, dtype=np.float64).ravel()[: len(k0)]
        camera = Camera(*size, np.diag(lens)[:2], lens[:2, 2], terms)
    except (cv2.error, ValueError) as failure:
        raise CalibrationError(unseen_lens(f" of camera {description.name!r}")) from failure
    return camera, np.asarray(per_view, dtype=np.float64).ravel() / np.sqrt(2.0)


def view_poses(name: str, camera: Camera, points_m: Floats, seen: Detections) -> dict[int, Floats]:
    """``T_camera_target`` of every shot that one camera can locate by itself."""
    alone = CameraRig((name,), (camera,), np.eye(4)[None])
    first = Detections(seen.shots, np.zeros(len(seen), dtype=np.int64), seen.points, seen.pixels, seen.sigmas_px)
    ids = tuple(str(s) for s in range(int(seen.shots.max(initial=-1)) + 1))
    located = locate_targets(alone, points_m, first, ids)
    return {int(s): T for s, T in zip(located.shots, located.Ts_head_target, strict=True)}
