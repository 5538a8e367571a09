"""Where does the target stand in each shot, seen by all cameras of the head at once?

Least squares on the pixels of every camera together, all shots in one batch. A plane seen from one side has two
nearly equal explanations; both are refined and the worse one is kept as a warning: the ratio of their residuals.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.camera import CameraRig, RigUnknowns, rays_from_pixels, rig_pixels
from sixthlink.geometry import (
    Floats,
    Ints,
    apply_motion,
    hat,
    inverse,
    nearest_rotation,
    rotation_angle,
    transform,
    transform_points,
)
from sixthlink.recording import Detections, Rejection, selected
from sixthlink.target import turn_names

__all__ = ["MINIMUM_POINTS", "TargetPoses", "locate_targets"]

MINIMUM_POINTS = 6
"""Points of the target that one camera must see for a pose to start from."""

AMBIGUITY_RATIO, AMBIGUITY_CHI2 = 1.2, 15.0
"""Two explanations of a plane cannot be told apart whose RMS residuals are closer than this, or whose squared residuals
differ by less than this many times the noise that the better one leaves: with few points chance alone does more."""

AMBIGUITY_ANGLE_RAD = np.deg2rad(5.0)
"""Two explanations closer than this are the same."""

ITERATIONS = 30


@dataclass(frozen=True, eq=False)
class TargetPoses:
    """The target's pose in the head frame, for every shot in which it could be found.

    Attributes:
        shots: ``(S,)`` index of each shot in the recording.
        Ts_head_target: ``(S, 4, 4)`` poses.
        informations: ``(S, 6, 6)`` inverse covariance of the motion (δp [m], δθ [rad]) in head axes.
        by_rig: ``(S, 6, G)`` motion of each pose in head axes per unit of the rig's unknowns: what the same pixels
            say when the rig is another.
        rms_px: ``(S,)`` RMS pixel residual per coordinate [pixel].
        points: ``(S,)`` number of observed points, all cameras together.
        rejections: Shots that could not be located, and why.
    """

    shots: Ints
    Ts_head_target: Floats
    informations: Floats
    by_rig: Floats
    rms_px: Floats
    points: Ints
    rejections: tuple[Rejection, ...]


def locate_targets(
    rig: CameraRig,
    points_m: Floats,
    detections: Detections,
    shot_ids: tuple[str, ...],
    *,
    turn: Ints | None = None,
    unknowns: RigUnknowns | None = None,
) -> TargetPoses:
    """Pose of the target in every shot.

    Args:
        rig: The head.
        points_m: ``(P, 3)`` points of the target [m].
        detections: What the cameras saw.
        shot_ids: Names of the recording's shots, for the rejections.
        turn: Names that the points get in the least turn after which the target looks the same, when an image cannot
            tell. The cameras of a shot are then made to agree with its first camera.
        unknowns: What of the rig is uncertain; none by default.
    """
    rejections: list[Rejection] = []
    starts: list[tuple[int, Floats]] = []
    detections = _agreeing(rig, points_m, detections, turn) if turn is not None else detections
    for shot in np.unique(detections.shots):
        candidates = _starting_poses(rig, points_m, selected(detections, detections.shots == shot))
        if candidates is None:
            reason = f"fewer than {MINIMUM_POINTS} points of the target in any one camera"
            rejections.append(Rejection(shot_ids[int(shot)], "", reason))
        else:
            starts.append((int(shot), candidates))
    if not starts:
        empty, none = np.empty(0, dtype=np.int64), np.empty((0, 6, 6))
        return TargetPoses(empty, np.empty((0, 4, 4)), none, none, np.empty(0), empty, tuple(rejections))
    shots = np.array([s for s, _ in starts])
    table = _Table(rig, points_m, detections, shots)
    fits = [_refined(table, np.stack([c[k] for _, c in starts])) for k in (0, 1)]
    costs = np.stack([cost for _, cost in fits])
    best = np.argmin(costs, axis=0)
    poses = np.where((best == 0)[:, None, None], fits[0][0], fits[1][0])
    apart = rotation_angle(np.swapaxes(fits[0][0][:, :3, :3], 1, 2) @ fits[1][0][:, :3, :3]) > AMBIGUITY_ANGLE_RAD
    ratio = np.sqrt(costs.max(axis=0) / np.maximum(costs.min(axis=0), 1e-300))
    spare = np.maximum(2.0 * table.per_shot(np.ones(len(table.slots))) - 6.0, 1.0)
    keep = ~(apart & (ratio < np.maximum(AMBIGUITY_RATIO, np.sqrt(1.0 + AMBIGUITY_CHI2 / spare))))
    for s in np.flatnonzero(~keep):
        reason = (
            "planar ambiguity: two orientations of the target explain the pixels almost equally well "
            f"(RMS ratio {ratio[s]:.2f}); tilt the target more or come closer"
        )
        rejections.append(Rejection(shot_ids[shots[s]], "", reason))
    informations, by_rig, rms, counts = _evidence(table, poses, unknowns)
    return TargetPoses(
        shots[keep], poses[keep], informations[keep], by_rig[keep], rms[keep], counts[keep], tuple(rejections)
    )


class _Table:
    """Detections of the located shots, sorted by shot, as arrays that one batch of residuals can index."""

    def __init__(self, rig: CameraRig, points_m: Floats, detections: Detections, shots: Ints) -> None:
        d = selected(detections, np.isin(detections.shots, shots))
        order = np.argsort(d.shots, kind="stable")
        self.rig = rig
        self.slots = np.searchsorted(shots, d.shots[order])
        self.starts = np.searchsorted(self.slots, np.arange(len(shots)))
        self.cameras = d.cameras[order]
        self.points = points_m[d.points[order]]
        self.pixels = d.pixels[order]
        self.sigmas = d.sigmas_px[order]

    def per_shot(self, rows: Floats) -> Floats:
        """Sum of rows over the points of each shot."""
        return np.add.reduceat(rows, self.starts, axis=0)

    def residuals(self, Ts_head_target: Floats) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
        """Whitened residuals ``(M, 2)``, their derivative ``(M, 2, 6)`` by the poses' motions, and visibility."""
        T = Ts_head_target[self.slots]
        lever = (T[:, :3, :3] @ self.points[:, :, None])[:, :, 0]
        points_head = lever + T[:, :3, 3]
        predicted, by_point, _, visible = rig_pixels(self.rig, self.cameras, points_head)
        residual = (predicted - self.pixels) / self.sigmas[:, None]
        by_motion = np.concatenate([by_point, -by_point @ hat(lever)], axis=-1) / self.sigmas[:, None, None]
        return residual, by_motion, visible


def _refined(table: _Table, Ts_head_target: Floats) -> tuple[Floats, Floats]:
    """Poses after damped least squares, every shot with its own damping, and their costs ``(S,)``."""
    T = Ts_head_target
    damping = np.full(len(T), 1e-4)
    residual, J, visible = table.residuals(T)
    cost = _costs(table, residual, visible)
    for _ in range(ITERATIONS):
        H = table.per_shot(np.einsum("mki,mkj->mij", J, J))
        g = table.per_shot(np.einsum("mki,mk->mi", J, residual))
        scale = np.einsum("sii->si", H)
        damped = H + np.eye(6) * (damping[:, None] * scale + 1e-12)[:, None, :]
        step = -np.linalg.solve(damped, g[:, :, None])[:, :, 0]
        tried = apply_motion(T, step)
        new_residual, new_J, new_visible = table.residuals(tried)
        new_cost = _costs(table, new_residual, new_visible)
        better = new_cost <= cost
        T = np.where(better[:, None, None], tried, T)
        rows = better[table.slots]
        residual = np.where(rows[:, None], new_residual, residual)
        J = np.where(rows[:, None, None], new_J, J)
        gain = cost - np.where(better, new_cost, cost)
        cost = np.where(better, new_cost, cost)
        damping = np.where(better, damping * 0.1, np.minimum(damping * 10.0, 1e6))
        if (better & (gain <= 1e-10 * cost + 1e-20)).all():
            break
    return T, cost


def _costs(table: _Table, residual: Floats, visible: npt.NDArray[np.bool_]) -> Floats:
    """Sum of squares per shot; a pose with points behind a camera is as bad as can be."""
    hidden = table.per_shot((~visible).astype(np.float64))
    return np.where(hidden > 0, np.inf, table.per_shot(np.sum(residual**2, axis=1)))


def _evidence(table: _Table, poses: Floats, unknowns: RigUnknowns | None) -> tuple[Floats, Floats, Floats, Ints]:
    """Information, derivative by the rig's unknowns, RMS residual and number of points of each pose."""
    residual, J, _ = table.residuals(poses)
    informations = table.per_shot(np.einsum("mki,mkj->mij", J, J))
    points_head = transform_points(poses[table.slots], table.points)
    J_rig = rig_pixels(table.rig, table.cameras, points_head, unknowns)[2] / table.sigmas[:, None, None]
    by_rig = np.asarray(-np.linalg.solve(informations, table.per_shot(np.einsum("mki,mkg->mig", J, J_rig))))
    counts = table.per_shot(np.ones(len(residual)))
    rms = np.sqrt(table.per_shot(np.sum((residual * table.sigmas[:, None]) ** 2, axis=1)) / (2.0 * counts))
    return informations, by_rig, rms, counts.astype(np.int64)


def _starting_poses(rig: CameraRig, points_m: Floats, seen: Detections) -> Floats | None:
    """Two starting poses ``(2, 4, 4)`` of one shot from the first camera that saw enough points."""
    for c in range(len(rig.cameras)):
        rows = seen.cameras == c
        if np.count_nonzero(rows) >= MINIMUM_POINTS:
            rays = rays_from_pixels(rig.cameras[c], seen.pixels[rows])
            T_head_camera = inverse(rig.Ts_camera_head[c])
            return T_head_camera @ _planar_poses(points_m[seen.points[rows]], rays[:, :2])
    return None


def _planar_poses(points_m: Floats, rays: Floats) -> Floats:
    """Two poses ``(2, 4, 4)`` of a plane from its homography: the decomposed one, and its mirror in the view line.

    The homography of a plane z = 0 has the columns (r1, r2, t) up to scale (Zhang 2000). A weak perspective view
    cannot tell a tilt from its mirror image, so the second start tilts the other way about the line of sight.
    """
    centre = points_m[:, :2].mean(axis=0)
    spread = float(np.sqrt(np.mean((points_m[:, :2] - centre) ** 2)))
    xy = (points_m[:, :2] - centre) / spread
    one, zero = np.ones(len(xy)), np.zeros((len(xy), 3))
    plane = np.column_stack([xy, one])
    A = np.concatenate(
        [
            np.hstack([plane, zero, -rays[:, :1] * plane]),
            np.hstack([zero, plane, -rays[:, 1:] * plane]),
        ]
    )
    H = np.linalg.svd(A, full_matrices=False)[2][-1].reshape(3, 3)
    H = H * np.sign(H[2, 2]) / np.sqrt(np.linalg.norm(H[:, 0]) * np.linalg.norm(H[:, 1]))
    R = nearest_rotation(np.column_stack([H[:, 0], H[:, 1], np.cross(H[:, 0], H[:, 1])]))
    middle = H[:, 2] * spread
    sight = middle / np.linalg.norm(middle)
    mirror = np.eye(3) - 2.0 * np.outer(sight, sight)
    # The mirrored plane keeps its in-plane axes as the camera sees them; its normal is reflected and turned forward.
    R_mirrored = nearest_rotation(mirror @ R @ np.diag([1.0, 1.0, -1.0]))
    offset = np.array([*centre, 0.0])
    return np.stack([transform(Q, middle - Q @ offset) for Q in (R, R_mirrored)])


def _agreeing(rig: CameraRig, points_m: Floats, detections: Detections, turn: Ints) -> Detections:
    """Detections in which every camera of a shot names the points of a symmetric target as its first camera does."""
    points = detections.points.copy()
    for shot in np.unique(detections.shots):
        rows = np.flatnonzero(detections.shots == shot)
        cameras = np.unique(detections.cameras[rows])
        for c in cameras[1:]:
            pair = rows[np.isin(detections.cameras[rows], (cameras[0], c))]
            other = pair[detections.cameras[pair] == c]
            names = [points]
            for _ in turn_names(turn, len(points_m))[1:]:
                names.append(names[-1].copy())
                names[-1][other] = turn[names[-1][other]]
            points = min(names, key=lambda named: _pair_cost(rig, points_m, detections, pair, named))
    return Detections(detections.shots, detections.cameras, points, detections.pixels, detections.sigmas_px)


def _pair_cost(rig: CameraRig, points_m: Floats, d: Detections, rows: Ints, points: Ints) -> float:
    seen = Detections(d.shots[rows], d.cameras[rows], points[rows], d.pixels[rows], d.sigmas_px[rows])
    candidates = _starting_poses(rig, points_m, seen)
    if candidates is None:
        return np.inf
    table = _Table(rig, points_m, seen, np.unique(seen.shots))
    return min(float(_refined(table, start[None])[1][0]) for start in candidates)
