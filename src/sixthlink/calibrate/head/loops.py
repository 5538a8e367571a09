"""What do all closed forms share before they differ?

Every shot closes the loop R_Z = R_i R_X C_i, with R_i the flange's rotation, C_i the target's as the head
sees it, and R_Z the same for all shots of a placement. Four things follow before any method is chosen:

- *Sums over all pairs in one pass.* A motion between shots i and j, multiplied back by R_j and C_i, is the
  difference of two loops, and the sum of squared differences over all pairs is n times the sum about the
  mean. So the methods that are linear in X are written on loops centred within their placement: linear in the
  shots, nothing thrown away, no choice of pairs to argue about. Several placements share X and need nothing
  more.
- *A rotation that needs no signs.* Centred, R_i R_X C_i = R_Z is linear in the nine entries of R_X. Its
  answer then decides between q and -q, once per shot, also where a motion is exactly half a turn.
- *The verdict on the motion.* The second smallest singular value of that system is the swing: how far the
  least visible direction of the head turns from shot to shot. Without swing there is no head.
- *Rotations between two witnesses.* Robot and head both say how the flange is turned. Whom to trust, the shots
  themselves tell (:mod:`~.shares`); the translation is found with rotations in between.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.placement_sums import centred
from sixthlink.calibrate.head.shares import HeadShares, head_shares, rotations_by_head
from sixthlink.errors import DegenerateMotionError, TooFewShotsError
from sixthlink.geometry import (
    Floats,
    Ints,
    frozen_floats,
    frozen_ints,
    nearest_rotation,
    transform,
)

__all__ = [
    "Loops",
    "balanced_length",
    "flange_rotations",
    "head_loops",
    "head_with_rotation",
    "loop_rows",
]

MINIMUM_SWING_RAD = np.deg2rad(0.5)
"""Smallest swing that is accepted: below it a robot's own noise of some 0.02° passes for motion."""

SWING_OVER_MISMATCH = 3.0
"""How far the swing must stand above the disagreement between robot and head to be believed."""

LENGTH_RANGE = 30.0
"""The balanced length stays within this factor of the target's distance: exact data leaves no residuals."""

CURE = "record shots that tilt the flange by 20° and more about two axes that are not parallel"
"""What every refusal of a motion advises."""


@dataclass(frozen=True, eq=False)
class Loops:
    """N shots ready for a closed form, with the rotation that needs no signs.

    Attributes:
        rotations: ``(N, 3, 3)`` R of T_base_flange.
        positions_m: ``(N, 3)`` position of the flange in the base frame [m].
        target_rotations: ``(N, 3, 3)`` R of T_head_target.
        target_positions_m: ``(N, 3)`` position of the target in the head's frame [m].
        placements: ``(N,)`` placement of each shot, numbered 0 to P - 1 without gaps.
        rotation_head: ``(3, 3)`` first R_X, from the nine-entry linear system.
        length_m: Median distance from head to target: the length that balances turns and shifts [m].
        shares: How far the rotations lean from the robot's word towards the head's.
    """

    rotations: Floats
    positions_m: Floats
    target_rotations: Floats
    target_positions_m: Floats
    placements: Ints
    rotation_head: Floats
    length_m: float
    shares: HeadShares


def head_loops(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Loops:
    """Check the shots and their motion, and take the first step that every method shares.

    Args:
        Ts_base_flange: ``(N, 4, 4)`` flange poses [m].
        Ts_head_target: ``(N, 4, 4)`` target poses as the head sees them [m].
        placements: ``(N,)`` any integers; equal ones share a target placement.

    Raises:
        ValueError: A shape differs or a value is not finite.
        TooFewShotsError: Fewer than two motions within placements.
        DegenerateMotionError: The motion leaves a direction of the head unseen.
    """
    Ts_outer = frozen_floats(Ts_base_flange, (None, 4, 4), "Ts_base_flange")
    N = len(Ts_outer)
    Ts_inner = frozen_floats(Ts_head_target, (N, 4, 4), "Ts_head_target")
    names, members = np.unique(frozen_ints(placements, (N,), "placements"), return_inverse=True)
    if N - len(names) < 2:
        raise TooFewShotsError(
            f"a head needs two motions of the flange about different axes, and {N} shots of {len(names)} "
            f"placements make {max(N - len(names), 0)}; record {len(names) + 2} shots or more, better 15",
            needed=len(names) + 2,
            usable=N,
        )
    R, C, p, c = Ts_outer[:, :3, :3], Ts_inner[:, :3, :3], Ts_outer[:, :3, 3], Ts_inner[:, :3, 3]
    rotation, swing_rad, mismatch_rad = _first_rotation(R, C, members)
    _check_motion(R, members, swing_rad, mismatch_rad)
    length_m = float(np.median(np.linalg.norm(c, axis=1)))
    by_head = rotations_by_head(R, C, members, rotation)
    return Loops(
        R,
        p,
        C,
        c,
        frozen_ints(members, (N,), "placements"),
        frozen_floats(rotation, (3, 3), "rotation_head"),
        # A target frame that sits in the head itself leaves no distance; then any length will do.
        length_m or 1.0,
        head_shares(R, by_head, p, c @ rotation.T, members),
    )


def loop_rows(rotations: Floats, target_rotations: Floats) -> Floats:
    """Rows ``(N, 9, 9)`` of R_i R_X C_i on the entries of R_X, row by row."""
    rows: Floats = np.einsum("nik,nlj->nijkl", rotations, target_rotations).reshape(-1, 9, 9)
    return rows


def flange_rotations(loops: Loops, rotation_head: Floats) -> tuple[Floats, Floats]:
    """Flange's rotations that turn the sight and the mount, each ``(N, 3, 3)``, between robot and head.

    They are rotations up to second order in what robot and head disagree about.
    """
    apart = rotations_by_head(loops.rotations, loops.target_rotations, loops.placements, rotation_head)
    apart -= loops.rotations
    return loops.rotations + loops.shares.sight * apart, loops.rotations + loops.shares.mount * apart


def head_with_rotation(loops: Loops, rotation_head: Floats) -> Floats:
    """Head ``(4, 4)`` of a rotation ``(3, 3)``: its translation by least squares on the centred loops.

    The target's position M_i R_X c_i + M'_i t + p_i, with the flange's rotations M_i for the sight and M'_i for the
    mount, is the same within a placement.
    """
    M_sight, M_mount = flange_rotations(loops, rotation_head)
    known = (M_sight @ (rotation_head @ loops.target_positions_m[..., None]))[..., 0] + loops.positions_m
    rows, right = centred(M_mount, loops.placements), centred(known, loops.placements)
    return transform(rotation_head, np.linalg.lstsq(rows.reshape(-1, 3), -right.reshape(-1))[0])


def balanced_length(loops: Loops, X: Floats) -> float:
    """Length [m] at which turns and shifts weigh by their own noise: the ratio of their residuals."""
    targets = loops.rotations @ X[:3, :3] @ loops.target_rotations
    M_sight, M_mount = flange_rotations(loops, X[:3, :3])
    sights = loops.target_positions_m @ X[:3, :3].T
    ends = (M_sight @ sights[..., None])[..., 0] + M_mount @ X[:3, 3] + loops.positions_m
    shifts = centred(ends, loops.placements)
    turns = centred(targets, loops.placements)
    # A small turn δ changes the nine entries of a rotation by √2 |δ|.
    turn, shift = np.linalg.norm(turns) / np.sqrt(2.0), np.linalg.norm(shifts)
    floor = np.finfo(np.float64).tiny
    ratio = float(shift / max(turn, floor) / loops.length_m)
    return loops.length_m * float(np.clip(ratio, 1.0 / LENGTH_RANGE, LENGTH_RANGE))


def _first_rotation(R: Floats, C: Floats, placements: Ints) -> tuple[Floats, float, float]:
    """R_X ``(3, 3)`` of the nine-entry system, the swing and the RMS mismatch of robot and head [rad]."""
    motions = len(R) - int(placements.max()) - 1
    rows = centred(loop_rows(R, C), placements).reshape(-1, 9)
    values, vectors = np.linalg.eigh(rows.T @ rows)
    M = vectors[:, 0].reshape(3, 3)
    spread = np.sqrt(np.maximum(values, 0.0) / motions)
    # The answer has length 1 instead of √3, and a turn δ of a rotation counts √2 |δ|.
    return nearest_rotation(np.sign(np.linalg.det(M)) * M), float(spread[1]), float(spread[0] * np.sqrt(1.5))


def _check_motion(R: Floats, placements: Ints, swing_rad: float, mismatch_rad: float) -> None:
    needed_rad = max(MINIMUM_SWING_RAD, SWING_OVER_MISMATCH * mismatch_rad)
    if swing_rad >= needed_rad:
        return
    turns = centred(R, placements).reshape(-1, 3)
    motions = len(R) - int(placements.max()) - 1
    swings_rad, axes = np.linalg.svd(turns / np.sqrt(motions), full_matrices=False)[1:]
    axis = axes[-1] * np.copysign(1.0, axes[-1, np.abs(axes[-1]).argmax()])
    words = ", ".join(f"{v:.2f}" for v in np.where(np.abs(axis) < 5e-3, 0.0, axis))
    along = (f"translation along the flange's ({words})",)
    if swing_rad >= MINIMUM_SWING_RAD:
        raise DegenerateMotionError(
            f"robot and head disagree by {np.rad2deg(mismatch_rad):.2g}° (RMS), too much beside the "
            f"{np.rad2deg(swing_rad):.2g}° by which the least visible direction of the head turns (flange "
            f"axis {words}); {CURE}. If they do, look for shots paired with the wrong pose, a wrong "
            "orientation convention or a board read from the other end",
            directions=along,
        )
    if swings_rad[-1] >= needed_rad:
        raise DegenerateMotionError(
            "all motions are half turns, which leave several rotations of the head equally good; "
            "add shots at other angles",
            directions=("rotation of the head",),
        )
    if swings_rad[0] >= needed_rad:
        raise DegenerateMotionError(
            f"the flange turns about one axis only, ({words}) in its own frame, and the head's place along "
            f"that axis cannot be seen; {CURE}",
            directions=along,
        )
    raise DegenerateMotionError(
        f"the flange hardly turns between shots ({np.rad2deg(swings_rad[0]):.2g}° RMS), and the head's "
        f"translation cannot be seen; {CURE}",
        directions=tuple(f"translation along the flange's {name}" for name in "xyz"),
    )
