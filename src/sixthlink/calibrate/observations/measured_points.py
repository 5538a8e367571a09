"""A reflector on the flange, measured by an instrument that stands beside the robot: what does it say about the arm?

A laser tracker, a measuring arm or cameras on a wall give the reflector's position in their own axes. Where the
instrument stands is not known and found too, station by station; so are the reflectors' places on the flange.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.arm import arm_motions
from sixthlink.calibrate.observations.linearised import Linearised
from sixthlink.calibrate.observations.state import Columns, JointState
from sixthlink.calibrate.observations.target_poses import carried
from sixthlink.geometry import Floats, Ints

__all__ = ["MeasuredPoints"]


@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """N measured points of r reflectors from B stations of an instrument.

    Attributes:
        joints: ``(N, J)`` joint values [rad or m].
        points_m: ``(N, 3)`` measured points in the instrument's axes [m].
        stations: ``(N,)`` number of the station, 0 to B - 1.
        reflectors: ``(N,)`` which reflector, 0 to r - 1.
        repeatability_rad: ``(J,)`` standard deviation of every joint that counts as scale 1 [rad or m].
        covariances: ``(N, 3, 3)`` of the points, as the instrument states them [m²]; None where it states none: their
            noise is then the same in all directions, and its size is estimated.
    """

    joints: Floats
    points_m: Floats
    stations: Ints
    reflectors: Ints
    repeatability_rad: Floats
    covariances: Floats | None = None
    block: str = "instruments"

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(N, 3)`` [m] in the instrument's axes, and derivatives."""
        N = len(self.joints)
        Ts_base_flange, by_arm, by_joint = arm_motions(state.arm, self.joints, columns.arm)
        R = Ts_base_flange[:, :3, :3]
        levers = np.einsum("nij,nj->ni", R, state.reflectors_m[self.reflectors])
        by_motion = carried(levers)[:, :3]
        Ts_base_instrument = state.Ts_base_instrument[self.stations]
        turn = np.swapaxes(Ts_base_instrument[:, :3, :3], 1, 2)
        sight = levers + Ts_base_flange[:, :3, 3] - Ts_base_instrument[:, :3, 3]
        shared = np.zeros((N, 3, columns.size))
        start = columns.reflectors_slice.start
        for k in range(3):
            shared[np.arange(N), :, start + 3 * self.reflectors + k] = R[:, :, k]
        shared[:, :, columns.arm_slice] = by_motion @ by_arm
        J = turn @ by_motion @ by_joint * self.repeatability_rad
        noises = {"joints": J @ np.swapaxes(J, 1, 2)}
        if self.covariances is None:
            noises["readings"] = np.tile(np.eye(3), (N, 1, 1))
        else:
            noises["instrument"] = self.covariances
        residuals = np.einsum("nij,nj->ni", turn, sight) - self.points_m
        return Linearised(residuals, turn @ shared, -turn @ carried(sight)[:, :3], self.stations, noises)
