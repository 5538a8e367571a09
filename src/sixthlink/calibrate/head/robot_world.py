"""Which head do the methods for AX = ZB find, where the target's placement Z is an unknown of its own?

A = T_base_flange, X = T_flange_head, B = T_target_head and Z = T_base_target, one per placement; X is shared
by all. Each placement's Z enters only the rows of its own shots, is eliminated there, and leaves a small
system in X alone: the work is linear in the shots however many placements there are.
"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.head.loops import (
    Loops,
    balanced_length,
    head_loops,
    head_with_rotation,
    loop_rows,
    midpoints,
    triangular,
)
from sixthlink.geometry import Floats, Ints, nearest_rotation

__all__ = ["li", "shah"]


def shah(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Floats:
    """Head ``(4, 4)`` by Shah's Kronecker product.

    The entries of R_Z and R_X are the leading singular pair of one 9×9 matrix, the mean of the shots'
    Kronecker products; eliminating every R_Z leaves the centred system that gives R_X for any number of
    placements. The translation follows linearly.

    Source: M. Shah, "Solving the robot-world/hand-eye calibration problem using the Kronecker product",
    Journal of Mechanisms and Robotics 5 (2013) 031007. Arguments and errors: those of :mod:`~.closed_form`.
    """
    loops = head_loops(Ts_base_flange, Ts_head_target, placements)
    return head_with_rotation(loops, loops.rotation_head)


def li(Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> Floats:
    """Head ``(4, 4)`` by the joint linear system of Li, Wang and Wu.

    All entries of X and Z, rotations and translations together, solve one linear system, so that shifts help
    to find the rotation. Lengths are divided by the balanced length, which makes the answer independent of
    their unit; the rotation is then put on the group and the translation found again for it.

    Source: A. Li, L. Wang, D. Wu, "Simultaneous robot-world and hand-eye calibration using dual-quaternions
    and Kronecker product", International Journal of the Physical Sciences 5 (2010) 1530-1536, the Kronecker
    form. Arguments and errors: those of :mod:`~.closed_form`.
    """
    loops = head_loops(Ts_base_flange, Ts_head_target, placements)
    length_m = balanced_length(loops, head_with_rotation(loops, loops.rotation_head))
    # R_Z comes first and is eliminated within its placement; then translation and scale, over all of them.
    rows = [
        triangular(_rows(loops, np.flatnonzero(loops.placements == p), length_m))[9:, 9:]
        for p in range(int(loops.placements.max()) + 1)
    ]
    U = triangular(np.concatenate(rows))
    M = np.linalg.svd(U[4:, 4:])[2][-1].reshape(3, 3)
    return head_with_rotation(loops, nearest_rotation(np.sign(np.linalg.det(M)) * M))


def _rows(loops: Loops, shots: Ints, length_m: float) -> Floats:
    """Rows ``(12 n, 22)`` of one placement on (R_Z, t_X / length, scale, R_X); centring removes its t_Z."""
    n = len(shots)
    R, C = loops.rotations[shots], loops.target_rotations[shots]
    M = midpoints(loops, loops.rotation_head)[shots]
    heads = np.swapaxes(C, 1, 2) @ loops.target_positions_m[shots, :, None]
    turns, shifts = np.zeros((n, 9, 22)), np.zeros((n, 3, 22))
    turns[:, :, :9] = -np.eye(9)
    turns[:, :, 13:] = loop_rows(R, C)
    shifts[:, :, :9] = np.einsum("ij,nk->nijk", np.eye(3), heads[..., 0]).reshape(n, 3, 9)
    shifts[:, :, 9:12] = M * length_m
    shifts[:, :, 12] = loops.positions_m[shots]
    return np.concatenate([turns.reshape(-1, 22), ((shifts - shifts.mean(axis=0)) / length_m).reshape(-1, 22)])
