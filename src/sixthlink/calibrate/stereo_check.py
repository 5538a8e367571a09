"""Does the given stereo calibration still fit the images that the head takes today?

A point that both cameras see must lie on its epipolar line, whatever it is a point of. How far it lies beside that line
(the vertical disparity of rectified images) needs no robot and no board: where the distances follow the place in the
image, beyond what noise makes of them, the cameras have moved against each other since they were calibrated. The
board's declared size adds what the epipolar lines cannot show: the baseline and the vergence.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.camera import Camera, CameraRig, rays_from_pixels
from sixthlink.geometry import Floats, Ints, hat, inverse
from sixthlink.recording import Detections, Recording, selected, shots_of_kind
from sixthlink.target import turn_names

__all__ = ["StereoCheck", "given_rig", "stereo_checks", "stereo_gates"]

FALSE_ALARM = 1e-4
STALE_PX = 0.2
"""Systematic distance from the epipolar lines from which a calibration is stale: good ones leave a few hundredths."""

STALE_SHARE, STANDARD_DEVIATIONS = 0.003, 5.0
"""What the triangulated size of the board must be off by to be told, both as a share and against its scatter."""

FEWEST_POINTS = 12


@dataclass(frozen=True)
class StereoCheck:
    """What the images say of the given calibration of two cameras.

    Attributes:
        cameras: Names of the two.
        shots: Shots in which both saw the target.
        points: Points that both saw.
        epipolar_rms_px: RMS distance of the second camera's points from their epipolar lines [pixel].
        systematic_px: The part of it that follows the place in the image [pixel].
        noise_px: What is left of it without that part [pixel].
        scale: Size of the board as triangulated, over its declared size.
        scale_std: Standard deviation of it, by the scatter of the points.
        length_m: Longest side of the board's points as triangulated [m].
        declared_m: The same as declared [m].
        stale: Whether the calibration no longer fits, or the board's size does not.
        words: All of it for people, and what to do.
    """

    cameras: tuple[str, str]
    shots: int
    points: int
    epipolar_rms_px: float
    systematic_px: float
    noise_px: float
    scale: float
    scale_std: float
    length_m: float
    declared_m: float
    stale: bool
    words: str


def stereo_checks(recording: Recording, detections: Detections) -> tuple[StereoCheck, ...]:
    """Check every camera of a head whose lenses and poses are given against the reference.

    Args:
        recording: The recording.
        detections: What its cameras saw of the target, ellipses' middles corrected to those of discs.
    """
    cameras, target = recording.head.cameras, recording.target
    if target is None or len(cameras) < 2 or cameras[0].camera is None:
        return ()
    checks = []
    for k, other in enumerate(cameras[1:], start=1):
        if other.camera is None or other.T_camera_head is None:
            continue
        rig = CameraRig(
            (cameras[0].name, other.name), (cameras[0].camera, other.camera), np.stack([np.eye(4), other.T_camera_head])
        )
        pairs = _pairs(rig, detections, k, turn_names(target.turn, len(target.points_m)))
        if sum(len(p.points) for p in pairs) >= FEWEST_POINTS:
            checks.append(_check(rig, pairs, target.points_m))
    return tuple(checks)


def given_rig(recording: Recording) -> CameraRig | None:
    """The head as it was given; None where a lens or a pose is left to these images."""
    cameras = recording.head.cameras
    lenses = [d.camera for d in cameras if d.camera is not None]
    poses = [np.eye(4), *(d.T_camera_head for d in cameras[1:] if d.T_camera_head is not None)]
    if not len(cameras) == len(lenses) == len(poses):
        return None
    return CameraRig(tuple(d.name for d in cameras), tuple(lenses), np.stack(poses))


def stereo_gates(recording: Recording, cameras: RigCalibration | None) -> tuple[Gate, ...]:
    """Whether the given calibration of the cameras against each other still fits the calibration shots."""
    if cameras is None:
        return ()
    seen = selected(cameras.detections, np.isin(cameras.detections.shots, shots_of_kind(recording, "calibrate")))
    return tuple(
        Gate(f"stereo calibration fits ({' and '.join(check.cameras)})", not check.stale, check.words)
        for check in stereo_checks(recording, seen)
    )


@dataclass(frozen=True, eq=False)
class _Pair:
    """Common points of one shot: indices, rays at z = 1 in both cameras, pixels in the second."""

    points: Ints
    rays: Floats
    others: Floats
    pixels: Floats


def _pairs(rig: CameraRig, detections: Detections, camera: int, names: Ints) -> list[_Pair]:
    """Common points of every shot; a target that looks the same after a turn is named as the lines fit better."""
    pairs = []
    for shot in np.unique(detections.shots).tolist():
        first, second = (
            {int(p): i for i, p in zip(rows, detections.points[rows], strict=True)}
            for rows in (np.flatnonzero((detections.shots == shot) & (detections.cameras == c)) for c in (0, camera))
        )
        found = []
        for name in names:
            both = [(p, first[p], second[int(name[p])]) for p in first if int(name[p]) in second]
            if len(both) >= 3:
                points, i, j = np.array(both).T
                pixels = detections.pixels[j]
                rays = rays_from_pixels(rig.cameras[0], detections.pixels[i])
                found.append(_Pair(points, rays, rays_from_pixels(rig.cameras[1], pixels), pixels))
        if found:
            pairs.append(min(found, key=lambda p: float(np.mean(_epipolar_px(rig, p) ** 2))))
    return pairs


def _epipolar_px(rig: CameraRig, pair: _Pair) -> Floats:
    """Distance ``(N,)`` of the second camera's points from their epipolar lines [pixel], signed."""
    T_second_first = rig.Ts_camera_head[1] @ inverse(rig.Ts_camera_head[0])
    lines = pair.rays @ (hat(T_second_first[:3, 3]) @ T_second_first[:3, :3]).T
    distances: Floats = np.sum(pair.others * lines, axis=1) / np.linalg.norm(lines[:, :2], axis=1)
    return distances * float(np.mean(rig.cameras[1].focal_px))


def _check(rig: CameraRig, pairs: list[_Pair], points_m: Floats) -> StereoCheck:
    off = np.concatenate([_epipolar_px(rig, p) for p in pairs])
    place = np.concatenate([p.pixels for p in pairs])
    systematic, noise, chance = _split(off, place, rig.cameras[1])
    ratios, spread = zip(*(_scale(rig, p, points_m) for p in pairs), strict=True)
    weights = 1.0 / np.array(spread) ** 2
    scale, scale_std = float(np.average(ratios, weights=weights)), float(1.0 / np.sqrt(weights.sum()))
    declared = float(np.ptp(points_m[:, :2], axis=0).max())
    moved = systematic > STALE_PX and chance < FALSE_ALARM
    sized = abs(scale - 1.0) <= max(STALE_SHARE, STANDARD_DEVIATIONS * scale_std)
    rms = float(np.sqrt(np.mean(off**2)))
    words = (
        f"{rig.names[1]} against {rig.names[0]}: points lie {rms:.3f} pixel (RMS) beside their epipolar lines, "
        f"{systematic:.3f} of it by their place in the image and {noise:.3f} by chance; "
        f"{declared * 1e3:.2f} mm of the board measure {scale * declared * 1e3:.3f} ± "
        f"{scale_std * declared * 1e3:.3f} mm"
    )
    if moved or not sized:
        cause = "" if moved else f", or the size of the board is declared wrong by {100.0 * (scale - 1.0):+.2f} %"
        words += (
            f": stale, the cameras have moved against each other since they were calibrated{cause}; calibrate the head "
            "again, or leave its poses out and let these images calibrate it"
        )
    return StereoCheck(
        (rig.names[0], rig.names[1]),
        len(pairs),
        len(off),
        rms,
        systematic,
        noise,
        scale,
        scale_std,
        scale * declared,
        declared,
        moved or not sized,
        words,
    )


def _split(off: Floats, place: Floats, camera: Camera) -> tuple[float, float, float]:
    """Systematic and random part of the distances [pixel], and the chance of so large a part without any cause.

    A camera that has moved shifts, rolls and tilts: first and second order in the place.
    """
    u, v = ((place - camera.centre_px) / camera.focal_px).T
    terms = np.column_stack([np.ones_like(u), u, v, u * u, u * v, v * v])
    fitted = terms @ np.linalg.lstsq(terms, off, rcond=None)[0]
    dof = max(len(off) - terms.shape[1], 1)
    left = float(np.sum((off - fitted) ** 2)) / dof
    explained = float(np.mean(fitted**2))
    F = float(np.sum(fitted**2)) / terms.shape[1] / max(left, 1e-12)
    return float(np.sqrt(explained)), float(np.sqrt(left)), float(fdtrc(terms.shape[1], dof, F))


def _scale(rig: CameraRig, pair: _Pair, points_m: Floats) -> tuple[float, float]:
    """Size of the triangulated points over that of the board's, and its standard deviation by their scatter."""
    found, declared = _triangulated(rig, pair), points_m[pair.points]
    a, b = declared - declared.mean(axis=0), found - found.mean(axis=0)
    U, s, Vt = np.linalg.svd(b.T @ a)
    s[2] *= np.sign(np.linalg.det(U @ Vt))
    size = float(np.sum(a**2))
    scale = float(s.sum()) / size
    R = U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    left = float(np.sum((b - scale * a @ R.T) ** 2)) / max(3 * len(a) - 7, 1)
    return scale, float(np.sqrt(left / size))


def _triangulated(rig: CameraRig, pair: _Pair) -> Floats:
    """Points ``(N, 3)`` of the first camera's frame, midway between the two rays [m]."""
    T_first_second = rig.Ts_camera_head[0] @ inverse(rig.Ts_camera_head[1])
    start, turned = T_first_second[:3, 3], pair.others @ T_first_second[:3, :3].T
    aa, ab, bb = (np.sum(x * y, axis=1) for x, y in ((pair.rays, pair.rays), (pair.rays, turned), (turned, turned)))
    along, across = pair.rays @ start, turned @ start
    det = aa * bb - ab * ab
    first, second = (bb * along - ab * across) / det, (ab * along - aa * across) / det
    points: Floats = 0.5 * (first[:, None] * pair.rays + start + second[:, None] * turned)
    return points
