"""Whose word about a flange's rotation is better, the robot's or the head's, and by how much?

The robot says that shot i has the rotation R_i, the head says R_Z (R_X C_i)ᵀ. Both are noisy, and their lever arm, the
distance to the target, turns noise into millimetres. With M_i(w) at share w between the robot's word (w = 0) and the
head's (w = 1), the target's position

    M_i(w_s) R_X c_i + M_i(w_m) t + p_i

scatters least where w is the robot's share of the variance: the shots themselves say whom to trust. The sight R_X c_i
and the mount t have a share each, since a head that errs about its own origin moves the target, and one that errs
about the target does not. The scatter is all but linear in (t, w_s, w_m), so that a few least squares of five unknowns
find them. Few shots say little: each share is drawn towards what is expected of it, with the scatter that is left as
the weight, and shots without noise leave both at one half.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.placement_sums import centred, means, triangular
from sixthlink.geometry import Floats, Ints, nearest_rotation

__all__ = ["HeadShares", "head_shares", "rotations_by_head"]

EXPECTED = np.array([0.5, 0.0])
"""Share of the sight, and how much more that of the mount is, before any shot is seen."""

SPREADS = np.array([12.0**-0.5, 0.3])
"""Standard deviations of both: the share is anywhere from 0 to 1, the mount's seldom far from it."""

STEPS = 2
"""Least squares taken after the first: the scatter is linear in the shares up to second order in the noise."""

ROUNDING_RAD = 1e-12
"""Mismatch of robot and head below which there is nothing to share."""


@dataclass(frozen=True)
class HeadShares:
    """How far the flange's rotations lean from the robot's word towards the head's, 0 to 1.

    Attributes:
        sight: Share with which the rotations turn the target's position as the head sees it.
        mount: Share with which they turn the head's own translation.
    """

    sight: float
    mount: float


def rotations_by_head(rotations: Floats, target_rotations: Floats, placements: Ints, rotation_head: Floats) -> Floats:
    """Rotations ``(N, 3, 3)`` of the flange as the head says: R_Z (R_X C_i)ᵀ, with the mean R_Z of each placement."""
    heads = rotation_head @ target_rotations
    targets = nearest_rotation(means(rotations @ heads, placements))[placements]
    return targets @ np.swapaxes(heads, 1, 2)


def head_shares(
    rotations: Floats, by_head: Floats, positions_m: Floats, sights_m: Floats, placements: Ints
) -> HeadShares:
    """Shares under which the target's position scatters least.

    Args:
        rotations: ``(N, 3, 3)`` rotation of the flange as the robot says.
        by_head: ``(N, 3, 3)`` the same as the head says.
        positions_m: ``(N, 3)`` position of the flange in the base frame [m].
        sights_m: ``(N, 3)`` R_X c_i, from head to target in the axes of the flange [m].
        placements: ``(N,)`` placement of each shot, numbered without gaps.
    """
    apart = by_head - rotations
    if np.sum(apart**2) < 2.0 * len(placements) * ROUNDING_RAD**2:
        return HeadShares(*EXPECTED[[0, 0]])
    spare = max(3 * (len(placements) - int(placements.max()) - 1) - 5, 1)
    seen = [rotations, apart, rotations @ sights_m[..., None], apart @ sights_m[..., None], positions_m[..., None]]
    # Every least squares below combines the same nine columns: one triangular factor serves them all.
    U = triangular(centred(np.concatenate(seen, axis=2), placements).reshape(-1, 9))
    leans, t = EXPECTED, _translation(U)
    scatter_m: float | None = None
    for _ in range(STEPS + 1):
        J, right = _linearised(U, leans, t)
        if scatter_m is None:
            # The first solution without expectations says how much scatter there is beside the shares.
            free = np.asarray(np.linalg.lstsq(J, right)[0], dtype=np.float64)
            scatter_m = _scatter(J, right, free, spare)
        found = _drawn(J, right, scatter_m / SPREADS, EXPECTED - leans)
        scatter_m = _scatter(J, right, found, spare)
        t, leans = found[:3], leans + found[3:]
    sight, mount = np.clip([leans[0], leans.sum()], 0.0, 1.0)
    return HeadShares(float(sight), float(mount))


def _translation(U: Floats) -> Floats:
    """Translation ``(3,)`` at equal shares."""
    half = EXPECTED[0]
    found: Floats = np.linalg.lstsq(U[:, :3] + half * U[:, 3:6], -(U[:, 6] + half * U[:, 7] + U[:, 8]))[0]
    return found


def _linearised(U: Floats, leans: Floats, t: Floats) -> tuple[Floats, Floats]:
    """Columns on (t, change of the sight's share, change of the mount's lead) and the right-hand side."""
    sight, mount = leans[0], leans.sum()
    R, apart, turned, apart_turned, positions = U[:, :3], U[:, 3:6], U[:, 6], U[:, 7], U[:, 8]
    J = np.column_stack([R + mount * apart, apart_turned + apart @ t, apart @ t])
    return J, -(turned + sight * apart_turned + positions)


def _drawn(J: Floats, right: Floats, weights: Floats, wanted: Floats) -> Floats:
    """Least squares ``(5,)`` of J on the right, with the last two unknowns drawn to the wanted values."""
    expectations = np.zeros((2, 5))
    expectations[:, 3:] = np.diag(weights)
    found: Floats = np.linalg.lstsq(np.concatenate([J, expectations]), np.concatenate([right, weights * wanted]))[0]
    return found


def _scatter(J: Floats, right: Floats, found: Floats, spare: int) -> float:
    """Standard deviation of what is left [m]."""
    return float(np.linalg.norm(right - J @ found) / np.sqrt(spare))
