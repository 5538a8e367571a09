"""A point on the flange that returned to one fixed place from many poses: what does it say about the arm?

A ball in a socket, a tip in a cone: whatever the joints, the point is where the socket is. Two sockets a known
distance apart add the scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.arm import arm_motions
from sixthlink.calibrate.observations.linearised import Linearised
from sixthlink.calibrate.observations.state import Columns, JointState
from sixthlink.calibrate.observations.target_poses import carried
from sixthlink.geometry import Floats, Ints

__all__ = ["FixedPointTouches", "SocketDistances"]


@dataclass(frozen=True, eq=False)
class FixedPointTouches:
    """N touches of fixed points, m points to a place.

    Attributes:
        joints: ``(N, J)`` joint values [rad or m].
        places: ``(N,)`` number of the place.
        points: ``(N,)`` which point of the place, 0 to m - 1.
        repeatability_rad: ``(J,)`` standard deviation of every joint that counts as scale 1 [rad or m].
    """

    joints: Floats
    places: Ints
    points: Ints
    repeatability_rad: Floats
    block: str = "points"

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(N, 3)`` [m] in base axes, and derivatives."""
        assert state.tool_m is not None  # noqa: S101 - a touch is a touch with some point of the flange
        N, m = len(self.joints), state.points_m.shape[1]
        Ts_base_flange, by_arm, by_joint = arm_motions(state.arm, self.joints, columns.arm)
        R = Ts_base_flange[:, :3, :3]
        levers = R @ state.tool_m
        by_motion = carried(levers)[:, :3]
        shared, own = np.zeros((N, 3, columns.size)), np.zeros((N, 3, 3 * m))
        shared[:, :, columns.tool_slice] = R
        shared[:, :, columns.arm_slice] = by_motion @ by_arm
        for k in range(3):
            own[np.arange(N), k, 3 * self.points + k] = -1.0
        J = by_motion @ by_joint * self.repeatability_rad
        noises = {"joints": J @ np.swapaxes(J, 1, 2), "contact": np.tile(np.eye(3), (N, 1, 1))}
        residuals = levers + Ts_base_flange[:, :3, 3] - state.points_m[self.places, self.points]
        return Linearised(residuals, shared, own, self.places, noises)


@dataclass(frozen=True, eq=False)
class SocketDistances:
    """Known distance between the first two points of some places.

    Attributes:
        places: ``(K,)`` number of each place.
        distance_m: Their distance [m].
        uncertainty_m: Its standard uncertainty [m].
        block: ``points`` for touched points, ``marks`` for marks that the head saw.
    """

    places: Ints
    distance_m: float
    uncertainty_m: float
    block: str = "points"

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(K, 1)`` [m], and derivatives."""
        points_m = state.marks_m if self.block == "marks" else state.points_m
        K, m = len(self.places), points_m.shape[1]
        between = points_m[self.places, 1] - points_m[self.places, 0]
        measured = np.linalg.norm(between, axis=1)
        unit = between / measured[:, None]
        own = np.zeros((K, 1, 3 * m))
        own[:, 0, :3], own[:, 0, 3:6] = -unit, unit
        return Linearised(
            (measured - self.distance_m)[:, None],
            np.zeros((K, 1, columns.size)),
            own,
            self.places,
            {"standard": np.full((K, 1, 1), self.uncertainty_m**2)},
        )
