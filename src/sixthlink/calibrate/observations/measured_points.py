"""A reflector on a link, measured by an instrument that stands beside the robot: what does it say about the arm?

A laser tracker, a measuring arm or cameras on a wall give the reflector's position in their own axes, a 6-D probe its
orientation too. Where the instrument stands is not known and found too, station by station; so are the reflectors'
places on their links. Most ride on the flange; one on the lower arm shows an axis that a parallelogram hides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.arm import arm_motions
from sixthlink.calibrate.observations.linearised import Linearised
from sixthlink.calibrate.observations.state import Columns, JointState
from sixthlink.calibrate.observations.target_poses import carried
from sixthlink.geometry import Floats, Ints, log_rotation
from sixthlink.robot import Arm, link_poses

__all__ = ["MeasuredPoints", "MeasuredPoses", "carrier_poses"]


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
        links: Link of each reflector, from 1; all on the flange when empty.
        names: Names of the reflectors; R1, R2, ... when empty.
    """

    joints: Floats
    points_m: Floats
    stations: Ints
    reflectors: Ints
    repeatability_rad: Floats
    covariances: Floats | None = None
    links: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    block: str = "instruments"

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(N, 3)`` [m] in the instrument's axes, and derivatives."""
        sight = _sighted(self, state, columns)
        J = sight.by_joint[:, :3] * self.repeatability_rad
        noises = {"joints": J @ np.swapaxes(J, 1, 2)} | _point_noise(self.covariances, len(self.joints), 3)
        residuals = sight.points_m - self.points_m
        return Linearised(residuals, sight.shared[:, :3], sight.own[:, :3], self.stations, noises)


@dataclass(frozen=True, eq=False, kw_only=True)
class MeasuredPoses(MeasuredPoints):
    """N measured points with the orientation of the reflector.

    Attributes:
        rotations: ``(N, 3, 3)`` measured orientations of the reflector in the instrument's axes.
        rotation_sigma_rad: Standard deviation of each component of an orientation [rad]; None where it is not stated:
            its size is then estimated.
    """

    rotations: Floats
    rotation_sigma_rad: float | None = None

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(N, 6)`` (δp [m], δθ [rad]) in the instrument's axes, and derivatives."""
        N = len(self.joints)
        sight = _sighted(self, state, columns)
        predicted = sight.R_instrument_link @ state.Rs_link_reflector[self.reflectors]
        turned = log_rotation(predicted @ np.swapaxes(self.rotations, 1, 2))
        J = sight.by_joint * self.repeatability_rad
        noises = {"joints": J @ np.swapaxes(J, 1, 2)} | _point_noise(self.covariances, N, 6)
        turning = np.tile(np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]), (N, 1, 1))
        stated = self.rotation_sigma_rad
        noises |= {"orientation": turning} if stated is None else {"probe": stated**2 * turning}
        residuals = np.concatenate([sight.points_m - self.points_m, turned], axis=1)
        return Linearised(residuals, sight.shared, sight.own, self.stations, noises)


@dataclass(frozen=True, eq=False)
class _Sight:
    """Where the instrument should see the reflectors, and how every unknown moves that, in the instrument's axes."""

    points_m: Floats
    R_instrument_link: Floats
    shared: Floats
    own: Floats
    by_joint: Floats


def carrier_poses(arm: Arm, measured: MeasuredPoints) -> Floats:
    """Poses ``T_base_link`` ``(N, 4, 4)`` of the link that carries each measured reflector."""
    poses = np.empty((len(measured.joints), 4, 4))
    for link, rows in _by_link(arm, measured).items():
        poses[rows] = link_poses(arm, measured.joints[rows], link)
    return poses


def _sighted(measured: MeasuredPoints, state: JointState, columns: Columns) -> _Sight:
    N, J = measured.joints.shape
    Ts_base_link = np.empty((N, 4, 4))
    by_arm, by_joint = np.empty((N, 6, len(columns.arm))), np.empty((N, 6, J))
    for link, rows in _by_link(state.arm, measured).items():
        Ts_base_link[rows], by_arm[rows], by_joint[rows] = arm_motions(
            state.arm, measured.joints[rows], columns.arm, link=link
        )
    R = Ts_base_link[:, :3, :3]
    levers = np.einsum("nij,nj->ni", R, state.reflectors_m[measured.reflectors])
    to_reflector = carried(levers)
    Ts_base_instrument = state.Ts_base_instrument[measured.stations]
    R_instrument_base = np.swapaxes(Ts_base_instrument[:, :3, :3], 1, 2)
    turn = np.zeros((N, 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = R_instrument_base
    sight = levers + Ts_base_link[:, :3, 3] - Ts_base_instrument[:, :3, 3]
    shared = np.zeros((N, 6, columns.size))
    rows = np.arange(N)
    for k in range(3):
        shared[rows, :3, columns.reflectors_slice.start + 3 * measured.reflectors + k] = R[:, :, k]
    place = {r: k for k, r in enumerate(columns.turned)}
    turned = np.array([place.get(r, -1) for r in measured.reflectors.tolist()])
    rows = np.flatnonzero(turned >= 0)
    for k in range(3):
        shared[rows, 3:, columns.turned_slice.start + 3 * turned[rows] + k] = R[rows, :, k]
    shared[:, :, columns.arm_slice] = to_reflector @ by_arm
    return _Sight(
        points_m=np.einsum("nij,nj->ni", R_instrument_base, sight),
        R_instrument_link=R_instrument_base @ R,
        shared=turn @ shared,
        own=-turn @ carried(sight),
        by_joint=turn @ to_reflector @ by_joint,
    )


def _by_link(arm: Arm, measured: MeasuredPoints) -> dict[int, Ints]:
    """Rows of the measurements by the link that carried the reflector."""
    if not measured.links:
        return {len(arm.joints): np.arange(len(measured.joints))}
    links = np.array(measured.links)[measured.reflectors]
    return {link: np.flatnonzero(links == link) for link in np.unique(links).tolist()}


def _point_noise(covariances: Floats | None, N: int, dimensions: int) -> dict[str, Floats]:
    pattern = np.zeros((N, dimensions, dimensions))
    pattern[:, :3, :3] = np.eye(3) if covariances is None else covariances
    return {"readings" if covariances is None else "instrument": pattern}
