"""How do rotations move, compare?

Every function takes leading batch axes; the last axes are the mathematics. ``(..., 3)`` rotation vectors are in
radians.
"""

from __future__ import annotations

import numpy as np

from sixthlink.geometry.arrays import Floats

__all__ = ["exp_rotation", "hat", "log_rotation", "nearest_rotation", "rotation_angle"]


def hat(vectors: Floats) -> Floats:
    """Skew matrix S(v) with S(v) w = v × w.

    Args:
        vectors: ``(..., 3)``.

    Returns:
        ``(..., 3, 3)``.
    """
    v = np.asarray(vectors, dtype=np.float64)
    matrix = np.zeros((*v.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2] = -v[..., 2], v[..., 1]
    matrix[..., 1, 0], matrix[..., 1, 2] = v[..., 2], -v[..., 0]
    matrix[..., 2, 0], matrix[..., 2, 1] = -v[..., 1], v[..., 0]
    return matrix


def exp_rotation(rotvecs_rad: Floats) -> Floats:
    """Rotation matrices of rotation vectors (Rodrigues' formula, smooth through zero).

    Args:
        rotvecs_rad: ``(..., 3)`` rotation vectors [rad].

    Returns:
        ``(..., 3, 3)`` rotation matrices.
    """
    v = np.asarray(rotvecs_rad, dtype=np.float64)
    angle = np.sqrt(np.einsum("...i,...i->...", v, v))[..., None, None]
    S = hat(v)
    # np.sinc(x) is sin(pi x) / (pi x); it stays exact at zero, so no series branch is needed.
    return np.eye(3) + np.sinc(angle / np.pi) * S + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (S @ S)


def log_rotation(rotations: Floats) -> Floats:
    """Rotation vectors of rotation matrices, exact through zero and through half a turn.

    Args:
        rotations: ``(..., 3, 3)`` rotation matrices.

    Returns:
        ``(..., 3)`` rotation vectors [rad] of length at most π.
    """
    from scipy.spatial.transform import Rotation

    R = np.asarray(rotations, dtype=np.float64)
    return Rotation.from_matrix(R.reshape(-1, 3, 3)).as_rotvec().reshape(*R.shape[:-2], 3)


def rotation_angle(rotations: Floats) -> Floats:
    """Angle of each rotation [rad], accurate for tiny angles and near half a turn.

    Args:
        rotations: ``(..., 3, 3)`` rotation matrices.

    Returns:
        ``(...)`` angles in [0, π].
    """
    R = np.asarray(rotations, dtype=np.float64)
    sine = 0.5 * np.linalg.norm(
        np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1),
        axis=-1,
    )
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    return np.arctan2(sine, cosine)


def nearest_rotation(matrices: Floats) -> Floats:
    """Rotation nearest to each matrix in the Frobenius norm (orthogonal Procrustes, Schönemann 1966).

    Args:
        matrices: ``(..., 3, 3)`` matrices.

    Returns:
        ``(..., 3, 3)`` proper rotations.
    """
    U, _, Vt = np.linalg.svd(matrices)
    handedness = np.linalg.det(U @ Vt)
    U[..., :, 2] *= handedness[..., None]
    return U @ Vt
