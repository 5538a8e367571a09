"""How do rotations multiply as linear maps on unit quaternions?

Quaternions are ``(..., 4)``, scalar first. A rotation has two of them, q and -q: whoever adds quaternions has
to choose the signs first.
"""

from __future__ import annotations

import numpy as np

from sixthlink.geometry import Floats

__all__ = [
    "conjugate",
    "left_products",
    "quaternions_from_rotations",
    "right_products",
    "rotation_from_quaternion",
]


def quaternions_from_rotations(rotations: Floats) -> Floats:
    """Unit quaternions ``(..., 4)`` of rotations ``(..., 3, 3)``, either sign."""
    from scipy.spatial.transform import Rotation

    R = rotations.reshape(-1, 3, 3)
    q: Floats = Rotation.from_matrix(R).as_quat(scalar_first=True).reshape(*rotations.shape[:-2], 4)
    return q


def rotation_from_quaternion(quaternion: Floats) -> Floats:
    """Rotation ``(3, 3)`` of a quaternion ``(4,)`` of any length above zero."""
    from scipy.spatial.transform import Rotation

    R: Floats = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    return R


def conjugate(quaternions: Floats) -> Floats:
    """Quaternions ``(..., 4)`` of the inverse rotations."""
    return np.multiply(quaternions, [1.0, -1.0, -1.0, -1.0])


def left_products(quaternions: Floats) -> Floats:
    """Matrices ``(..., 4, 4)`` L(q) with L(q) r = q r."""
    return _products(quaternions, 1.0)


def right_products(quaternions: Floats) -> Floats:
    """Matrices ``(..., 4, 4)`` R(q) with R(q) r = r q."""
    return _products(quaternions, -1.0)


def _products(quaternions: Floats, side: float) -> Floats:
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    sx, sy, sz = side * x, side * y, side * z
    rows = [[w, -x, -y, -z], [x, w, -sz, sy], [y, sz, w, -sx], [z, -sy, sx, w]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
