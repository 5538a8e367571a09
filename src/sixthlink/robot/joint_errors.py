"""Where does a joint really stand when its encoder says q?

Two effects that no DH number can hold: a reading that errs once and twice per turn (an eccentric encoder disc or gear)
and a joint that yields under the load's weight. Both add to q before the kinematics are evaluated.
"""

from __future__ import annotations

import numpy as np

from sixthlink.geometry import Floats

__all__ = ["HARMONICS", "harmonic_values", "lever_values"]

HARMONICS = ("sin", "cos", "sin2", "cos2")
"""Periodic errors of a joint: once and twice per turn."""


def harmonic_values(joints: Floats) -> Floats:
    """Values ``(N, J, 4)`` of the periodic functions for ``(N, J)`` joints [rad]."""
    return np.stack([np.sin(joints), np.cos(joints), np.sin(2.0 * joints), np.cos(2.0 * joints)], axis=-1)


def lever_values(axes: Floats, origins_m: Floats, load_m: Floats) -> Floats:
    """How far the load's weight turns each joint's way: torque per unit of weight [m].

    Args:
        axes: ``(N, J, 3)`` axis of each joint in base axes; base z points up.
        origins_m: ``(N, J, 3)`` a point of each axis [m].
        load_m: ``(N, 3)`` where the load hangs [m]; the flange stands for it.

    Returns:
        ``(N, J)`` levers: the torque of a unit weight about the axis.
    """
    down = np.array([0.0, 0.0, -1.0])
    return np.asarray(np.einsum("nji,nji->nj", axes, np.cross(load_m[:, None] - origins_m, down)), dtype=np.float64)
