"""Which way up was a target that looks the same after half a turn?

A board whose ends look alike can be read from either end. The robot knows: between two shots of one placement the
camera must turn by the same angle as the flange, whatever the head is. Each pair of shots votes for "read alike" or
"read oppositely", weighed by how much better that fits; the leading eigenvector of the votes is the joint verdict.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.head.problem import HeadProblem
from sixthlink.geometry import Floats, Ints, nearest_rotation, rotation_angle, transform

__all__ = ["half_turn_transform", "opposite_readings"]

VOTERS = 60
"""Shots of a placement that vote about every other shot; enough for a clear verdict, and linear in the shots."""


def half_turn_transform(points_m: Floats, half_turn: Ints) -> Floats:
    """``T_target_turned`` ``(4, 4)``: the rigid motion that carries each point to its name after half a turn."""
    here, there = points_m - points_m.mean(axis=0), points_m[half_turn] - points_m[half_turn].mean(axis=0)
    covariance = there.T @ here
    covariance[2, 2] += np.linalg.norm(covariance)  # a plane leaves its normal's sign open: keep it
    R = nearest_rotation(covariance)
    return transform(R, points_m[half_turn].mean(axis=0) - R @ points_m.mean(axis=0))


def opposite_readings(problem: HeadProblem, T_target_turned: Floats) -> npt.NDArray[np.bool_]:
    """``(N,)`` whether a shot was read from the other end than most shots of its placement."""
    turned = np.zeros(len(problem.placements), dtype=bool)
    for p in range(int(problem.placements.max()) + 1):
        members = np.flatnonzero(problem.placements == p)
        voters = members[np.linspace(0, len(members) - 1, min(len(members), VOTERS)).round().astype(np.int64)]
        votes = _votes(problem, members, voters, T_target_turned[:3, :3])
        among = votes[np.searchsorted(members, voters)]
        verdict = np.linalg.eigh(0.5 * (among + among.T))[1][:, -1]
        sign = np.sign(votes @ verdict)
        turned[members] = sign < 0 if np.count_nonzero(sign < 0) * 2 <= len(sign) else sign > 0
    return turned


def _votes(problem: HeadProblem, members: Ints, voters: Ints, H: Floats) -> Floats:
    """``(n, v)`` mismatch of turning angles if read oppositely, minus the mismatch if read alike."""
    outer, inner = problem.Ts_outer[:, :3, :3], problem.Ts_inner[:, :3, :3]
    robot = rotation_angle(np.swapaxes(outer[members], 1, 2)[:, None] @ outer[voters][None])
    alike = rotation_angle(inner[members][:, None] @ np.swapaxes(inner[voters], 1, 2)[None])
    opposite = rotation_angle((inner[members] @ H)[:, None] @ np.swapaxes(inner[voters], 1, 2)[None])
    return np.abs(opposite - robot) - np.abs(alike - robot)
