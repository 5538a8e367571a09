"""How is a head polished once it is in the right valley?

Damped least squares (Levenberg-Marquardt) on the rotation group. The translation is eliminated exactly at every
step, so that the narrow curved valley in which rotation and translation compensate each other is not walked but
jumped over: three unknowns, a ten-row residual.
"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.head.factor import Objective, best_translation
from sixthlink.geometry import Floats, hat

__all__ = ["polished", "polished_rotation", "rotation_jacobian"]

ITERATIONS = 60
STEP_TOLERANCE_RAD = 1e-9
"""A Gauss-Newton step this small leaves an error smaller by the ratio of residual to curvature."""

_GENERATORS = hat(np.eye(3))


def polished(objective: Objective, rotation: Floats) -> Floats:
    """Head ``(4, 4)`` at the local minimum of eq. (11) reached from a rotation ``(3, 3)``."""
    return best_translation(objective, polished_rotation(objective.rotation_factor, rotation))


def polished_rotation(U2: Floats, rotation: Floats) -> Floats:
    """Rotation ``(3, 3)`` at the local minimum of |U₂ (vec R, 1)|² reached from ``rotation``."""
    R = rotation
    residual = _residual(U2, R)
    value, damping = float(residual @ residual), 1e-9
    for _ in range(ITERATIONS):
        J = rotation_jacobian(U2, R)
        H, g = J.T @ J, J.T @ residual
        size = float(H[0, 0] + H[1, 1] + H[2, 2])
        step = np.asarray(np.linalg.solve(H + (damping * size + 1e-300) * np.eye(3), -g), dtype=np.float64)
        tried = _turn(step) @ R
        tried_residual = _residual(U2, tried)
        tried_value = float(tried_residual @ tried_residual)
        if tried_value <= value:
            R, residual, value, damping = tried, tried_residual, tried_value, damping * 0.1
            if step @ step < STEP_TOLERANCE_RAD**2:
                break
        else:
            if step @ step < STEP_TOLERANCE_RAD**2:
                break
            damping = max(damping, 1e-12) * 10.0
    return R


def rotation_jacobian(U2: Floats, R: Floats) -> Floats:
    """Derivative ``(10, 3)`` of U₂ (vec R, 1) by a small turn of R about the outer axes."""
    return U2[:, :9] @ (_GENERATORS @ R).reshape(3, 9).T


def _turn(step_rad: Floats) -> Floats:
    """Cayley's rotation of a step: the exponential to second order, exactly a rotation, and a few products."""
    half = 0.5 * step_rad
    S = (half @ _GENERATORS.reshape(3, 9)).reshape(3, 3)
    return np.eye(3) + 2.0 / (1.0 + half @ half) * (S + S @ S)


def _residual(U2: Floats, R: Floats) -> Floats:
    return U2[:, :9] @ R.ravel() + U2[:, 9]
