"""How do rigid transforms compose, invert and differ?

A transform ``T_a_b`` is a 4×4 matrix that maps coordinates in frame b to frame a; neighbours cancel in products.
A small motion of a pose is the 6-vector (δp [m], δθ [rad]) in the axes of the outer frame: p becomes p + δp and R
becomes exp(δθ) R. All functions take leading batch axes.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.geometry.arrays import Floats
from sixthlink.geometry.rotations import exp_rotation, log_rotation, nearest_rotation

__all__ = [
    "ORTHONORMAL_TOLERANCE",
    "apply_motion",
    "checked_transforms",
    "inverse",
    "mean_transform",
    "motion_between",
    "transform",
    "transform_points",
]

ORTHONORMAL_TOLERANCE = 1e-3
"""Largest entry of RᵀR - I that is taken for rounding in a text file; more is a mistake, not a rotation."""


def transform(rotations: npt.ArrayLike, translations_m: npt.ArrayLike) -> Floats:
    """Transforms ``(..., 4, 4)`` from rotations ``(..., 3, 3)`` and translations ``(..., 3)`` [m]."""
    R = np.asarray(rotations, dtype=np.float64)
    t = np.asarray(translations_m, dtype=np.float64)
    T = np.zeros((*np.broadcast_shapes(R.shape[:-2], t.shape[:-1]), 4, 4))
    T[..., :3, :3] = R
    T[..., :3, 3] = t
    T[..., 3, 3] = 1.0
    return T


def inverse(Ts_a_b: Floats) -> Floats:
    """Inverse ``Ts_b_a`` of ``(..., 4, 4)`` rigid transforms."""
    Rt = np.swapaxes(Ts_a_b[..., :3, :3], -1, -2)
    return transform(Rt, -(Rt @ Ts_a_b[..., :3, 3:])[..., 0])


def transform_points(Ts_a_b: Floats, points_b: Floats) -> Floats:
    """Points in frame a: ``(..., 3)`` points in frame b moved by ``(..., 4, 4)`` transforms [m]."""
    return (Ts_a_b[..., :3, :3] @ points_b[..., None])[..., 0] + Ts_a_b[..., :3, 3]


def apply_motion(Ts_a_b: Floats, motions: Floats) -> Floats:
    """Poses moved by small motions (δp [m], δθ [rad]) given in the axes of frame a.

    Args:
        Ts_a_b: ``(..., 4, 4)`` poses.
        motions: ``(..., 6)`` motions.

    Returns:
        ``(..., 4, 4)`` moved poses.
    """
    return transform(exp_rotation(motions[..., 3:]) @ Ts_a_b[..., :3, :3], Ts_a_b[..., :3, 3] + motions[..., :3])


def motion_between(Ts_a_b_from: Floats, Ts_a_b_to: Floats) -> Floats:
    """Motions ``(..., 6)`` that carry the first poses to the second: the inverse of :func:`apply_motion`."""
    R = Ts_a_b_to[..., :3, :3] @ np.swapaxes(Ts_a_b_from[..., :3, :3], -1, -2)
    shift = Ts_a_b_to[..., :3, 3] - Ts_a_b_from[..., :3, 3]
    return np.concatenate([shift, log_rotation(R)], axis=-1)


def mean_transform(Ts_a_b: Floats) -> Floats:
    """Mean pose of ``(N, 4, 4)`` transforms: mean translation and chordal mean rotation."""
    return transform(nearest_rotation(np.mean(Ts_a_b[:, :3, :3], axis=0)), Ts_a_b[:, :3, 3].mean(axis=0))


def checked_transforms(matrices: npt.ArrayLike, name: str) -> Floats:
    """Rigid transforms from matrices that a file rounded: checked, then put exactly on the group.

    Args:
        matrices: ``(..., 4, 4)`` matrices, translations in metres.
        name: Name for the error message.

    Returns:
        ``(..., 4, 4)`` transforms.

    Raises:
        ValueError: A matrix is sheared, scaled, mirrored, not finite, or its last row is not (0, 0, 0, 1).
    """
    T = np.asarray(matrices, dtype=np.float64)
    if T.shape[-2:] != (4, 4):
        raise ValueError(f"{name} has shape {T.shape}, expected (..., 4, 4)")
    if not np.isfinite(T).all():
        raise ValueError(f"{name} has entries that are not finite")
    R = T[..., :3, :3]
    shear = float(np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0))
    if shear > ORTHONORMAL_TOLERANCE:
        raise ValueError(
            f"{name} is not a rotation: its columns miss orthonormality by {shear:.2g}, "
            f"at most {ORTHONORMAL_TOLERANCE:g} is rounding"
        )
    if (np.linalg.det(R) < 0).any():
        raise ValueError(f"{name} is mirrored (determinant -1): a left-handed frame or swapped columns")
    if np.abs(T[..., 3, :] - np.array([0.0, 0.0, 0.0, 1.0])).max(initial=0.0) > 1e-9:
        raise ValueError(f"{name} has a last row other than (0, 0, 0, 1); is it transposed?")
    return transform(nearest_rotation(R), T[..., :3, 3])
