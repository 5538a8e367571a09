"""What does a real arm do wrong that no parameter of it describes, and how alike is it from touch to touch?

The joints of a real arm do not scatter independently. What its model leaves (gears, bearings, links that bend) is a
smooth function of the pose: touches in similar poses err alike, and averaging thirty of them in one socket averages
little of it. What changes from one socket to the next (the arm was moved, warmed up, pushed from another side) is the
same for all touches of a socket. Only the rest is noise. So the joint errors have three parts, each of its own size:

``joints``: anew with every touch; ``socket``: one constant error per joint and socket; ``pose``: per joint a smooth
random function of the pose, whose values at two poses correlate by exp(-|Δq|² / 2ℓ²).
"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.arm import arm_motions
from sixthlink.calibrate.observations import FixedPointTouches, JointState, carried
from sixthlink.geometry import Floats, Ints
from sixthlink.robot import Arm

__all__ = ["PARTS", "SMOOTHNESS_RAD", "error_patterns", "sockets_of"]

PARTS = ("joints", "contact", "socket", "pose")
"""Origins of the noise of touches, in the order of their patterns; the joints' as multiples of the repeatability."""

SMOOTHNESS_RAD = (1.0, 2.0, 4.0)
"""Lengths ℓ over which joint errors may change [rad]; the likelihood chooses."""

SLIDING_RAD_PER_M = 2.0
"""How far a sliding joint's metre counts beside the radians of the others."""


def sockets_of(touches: FixedPointTouches) -> Ints:
    """Number ``(N,)`` of the socket of every touch, over all places."""
    return np.unique(np.stack([touches.places, touches.points]), axis=1, return_inverse=True)[1].ravel()


def error_patterns(touches: FixedPointTouches, state: JointState, smoothness_rad: float) -> Floats:
    """Covariance ``(4, 3N, 3N)`` of the touched points per unit of the variance of each of ``PARTS``."""
    assert state.tool_m is not None  # noqa: S101 - a touch is a touch with some point of the flange
    Ts_base_flange, _, by_joint = arm_motions(state.arm, touches.joints, ())
    levers = Ts_base_flange[:, :3, :3] @ state.tool_m
    J = carried(levers)[:, :3] @ by_joint * touches.repeatability_rad
    N = len(J)
    flat = J.reshape(3 * N, -1)
    alike: Floats = flat @ flat.T
    sockets = sockets_of(touches)
    way = touches.joints * _radians(state.arm)
    apart = np.sum((way[:, None] - way[None]) ** 2, axis=2)
    likeness = (np.eye(N), sockets[:, None] == sockets[None], np.exp(-0.5 * apart / smoothness_rad**2))
    joints, socket, pose = (alike * np.repeat(np.repeat(m, 3, axis=0), 3, axis=1) for m in likeness)
    return np.stack([joints, np.eye(3 * N), socket, pose])


def _radians(arm: Arm) -> Floats:
    """Radians ``(J,)`` that a unit of each joint counts as."""
    turning = np.array([arm.turns[np.abs(arm.joint_map[:, j]) > 0.0].any() for j in range(len(arm.joints))])
    return np.where(turning, 1.0, SLIDING_RAD_PER_M)
