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
    flange_rotations,
    head_loops,
    head_with_rotation,
    loop_rows,
)
from sixthlink.calibrate.head.placement_sums import centred, triangular, without_nuisance
from sixthlink.geometry import Floats, Ints, nearest_rotation

__all__ = ["joint_rotation", "li", "shah"]


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
    return head_with_rotation(loops, joint_rotation(loops))


def joint_rotation(loops: Loops) -> Floats:
    """Rotation ``(3, 3)`` of the head from turns and shifts in one linear system of X and every Z.

    With the head's share w, the target's position is (1 - w) R_i R_X c_i + w R_Z C_iᵀ c_i + M_i t + p_i: linear in X
    and Z together. R_Z is eliminated within its placement, then translation and scale over all of them.
    """
    length_m = balanced_length(loops, head_with_rotation(loops, loops.rotation_head))
    U = triangular(without_nuisance(_rows(loops, length_m), loops.placements, 9))
    M = np.linalg.svd(U[4:, 4:])[2][-1].reshape(3, 3)
    return nearest_rotation(np.sign(np.linalg.det(M)) * M)


def _rows(loops: Loops, length_m: float) -> Floats:
    """Rows ``(N, 12, 22)`` on (R_Z, t_X / length, scale, R_X); centring removes each placement's t_Z."""
    N = len(loops.placements)
    R, C, c = loops.rotations, loops.target_rotations, loops.target_positions_m
    share = loops.shares.sight
    inward = (np.swapaxes(C, 1, 2) @ c[..., None])[..., 0]
    turns, shifts = np.zeros((N, 9, 22)), np.zeros((N, 3, 22))
    turns[:, :, :9] = -np.eye(9)
    turns[:, :, 13:] = loop_rows(R, C)
    shifts[:, :, :9] = share * np.einsum("ij,nk->nijk", np.eye(3), inward).reshape(N, 3, 9)
    shifts[:, :, 9:12] = flange_rotations(loops, loops.rotation_head)[1] * length_m
    shifts[:, :, 12] = loops.positions_m
    shifts[:, :, 13:] = (1.0 - share) * (R[..., None] * c[:, None, None, :]).reshape(N, 3, 9)
    return np.concatenate([turns, centred(shifts, loops.placements) / length_m], axis=1)
