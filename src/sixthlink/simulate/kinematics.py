"""Where does the simulated flange stand, and which joints bring it somewhere?

Deliberately not the arm's own forward kinematics: plain products of 4 × 4 elementary matrices, with the steps
that no joint moves multiplied out beforehand, so that a mistake in either shows as a difference.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.robot import Arm

__all__ = ["Chain", "chain_link_poses", "chain_of_arm", "chain_poses", "joints_for_poses"]

_AXES = ("x", "y", "z")
IK_STEPS = 25
"""Damped steps of the inverse kinematics; starts that need more are given up."""
IK_LARGEST_STEP_RAD = 0.5
"""Longest step of one joint, so that a poor start does not jump between branches."""
IK_TOLERANCE = 1e-9
"""Largest miss [m and rad] of a solved pose."""


@dataclass(frozen=True, eq=False)
class Chain:
    """An arm multiplied out: fixed matrix, moving step, fixed matrix, moving step, ..., fixed matrix.

    Attributes:
        fixed: ``(S + 1, 4, 4)`` what stands before, between and behind the S moving steps.
        kinds: Kind of each moving step, as in :class:`sixthlink.robot.Arm`.
        rows: ``(S, J)`` how each moving step follows the joints.
        offsets: ``(S,)`` constant part of each moving step, multiplied into what stands before it [rad or m].
        limits: ``(J, 2)`` range of each joint [rad or m].
    """

    fixed: Floats
    kinds: tuple[str, ...]
    rows: Floats
    offsets: Floats
    limits: Floats


def chain_of_arm(arm: Arm) -> Chain:
    """The arm's steps multiplied out."""
    fixed, kinds, rows, offsets = [np.eye(4)], [], [], []
    for kind, value, row in zip(arm.kinds, arm.values, arm.joint_map, strict=True):
        fixed[-1] = fixed[-1] @ _elementary(kind, value)
        if row.any():
            kinds.append(kind)
            rows.append(row)
            offsets.append(value)
            fixed.append(np.eye(4))
    return Chain(np.array(fixed), tuple(kinds), np.array(rows), np.array(offsets), arm.limits)


def chain_poses(chain: Chain, joints: npt.ArrayLike) -> Floats:
    """Poses ``T_base_flange`` ``(N, 4, 4)`` of ``(N, J)`` joint values [rad or m]."""
    poses: Floats = _before_each_step(chain, np.asarray(joints, dtype=np.float64))[-1] @ chain.fixed[-1]
    return poses


def chain_link_poses(chain: Chain, joints: npt.ArrayLike, link: int) -> Floats:
    """Poses ``T_base_link`` ``(N, 4, 4)`` of the part that joint ``link`` (from 1) carries, the last being the flange.

    Every joint drives one step of its own, in their order; the part ends where the next joint's step begins.
    """
    if link == len(chain.kinds):
        return chain_poses(chain, joints)
    before = _before_each_step(chain, np.asarray(joints, dtype=np.float64))[link]
    poses: Floats = before @ _elementary(chain.kinds[link], -chain.offsets[link])
    return poses


def joints_for_poses(
    chain: Chain, Ts_base_flange: Floats, starts: Floats, reserve: float
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Joint values that bring the flange to poses: damped least squares from one start per pose.

    The damping follows the remaining miss (Sugihara 2011), so that far starts crawl and near ones converge
    quadratically; joints are kept inside their limits on the way.

    Args:
        chain: The arm.
        Ts_base_flange: ``(N, 4, 4)`` wanted poses.
        starts: ``(N, J)`` joint values to start from [rad or m].
        reserve: Distance that joints keep from their limits, as a part of their range.

    Returns:
        ``(N, J)`` joint values and ``(N,)`` whether they reach their pose within 1e-9 m and rad.
    """
    spare = reserve * (chain.limits[:, 1] - chain.limits[:, 0])
    lower, upper = chain.limits[:, 0] + spare, chain.limits[:, 1] - spare
    q = np.clip(starts, lower, upper)
    for _ in range(IK_STEPS):
        miss, J = _miss_and_jacobian(chain, q, Ts_base_flange)
        damping = 0.5 * np.einsum("ni,ni->n", miss, miss) + 1e-12
        normal = np.swapaxes(J, 1, 2) @ J + damping[:, None, None] * np.eye(q.shape[1])
        step = np.linalg.solve(normal, np.einsum("nij,ni->nj", J, miss)[..., None])[..., 0]
        longest = np.abs(step).max(axis=1, keepdims=True)
        step *= np.minimum(1.0, IK_LARGEST_STEP_RAD / np.maximum(longest, 1e-12))
        q = np.clip(q + step, lower, upper)
    miss, _ = _miss_and_jacobian(chain, q, Ts_base_flange)
    # The rotation's miss is a sine: it also vanishes half a turn away, where the trace gives it away.
    turn = np.swapaxes(chain_poses(chain, q)[:, :3, :3], 1, 2) @ Ts_base_flange[:, :3, :3]
    return q, (np.abs(miss).max(axis=1) < IK_TOLERANCE) & (np.trace(turn, axis1=1, axis2=2) > 2.9)


def _before_each_step(chain: Chain, q: Floats) -> list[Floats]:
    """Frames ``(N, 4, 4)`` in which each moving step happens, then the frame behind the last of them."""
    frames = [np.broadcast_to(chain.fixed[0], (len(q), 4, 4))]
    for kind, row, fixed in zip(chain.kinds, chain.rows, chain.fixed[1:-1], strict=False):
        frames.append(frames[-1] @ (_elementary(kind, q @ row) @ fixed))
    last = len(chain.kinds) - 1
    frames.append(frames[-1] @ _elementary(chain.kinds[last], q @ chain.rows[last]))
    return frames


def _miss_and_jacobian(chain: Chain, q: Floats, Ts_wanted: Floats) -> tuple[Floats, Floats]:
    """What misses the wanted poses ``(N, 6)`` and how the joints reduce it ``(N, 6, J)``, in base axes."""
    *frames, end = _before_each_step(chain, q)
    T = end @ chain.fixed[-1]
    turn = 0.5 * np.cross(T[:, :3, :3], Ts_wanted[:, :3, :3], axis=1).sum(axis=2)
    miss = np.concatenate([Ts_wanted[:, :3, 3] - T[:, :3, 3], turn], axis=1)
    steps = np.arange(len(frames))
    stacked = np.stack(frames)
    axes = stacked[steps, :, :3, [_AXES.index(kind[1]) for kind in chain.kinds]]
    turns = np.array([kind[0] == "r" for kind in chain.kinds])[:, None, None]
    by_turning = np.concatenate([np.cross(axes, T[:, :3, 3] - stacked[:, :, :3, 3]), axes], axis=2)
    by_sliding = np.concatenate([axes, np.zeros_like(axes)], axis=2)
    J: Floats = np.einsum("sni,sj->nij", np.where(turns, by_turning, by_sliding), chain.rows)
    return miss, J


def _elementary(kind: str, value: npt.ArrayLike) -> Floats:
    """Elementary matrices ``(..., 4, 4)``: a turn about, or a shift along, one axis."""
    v = np.asarray(value, dtype=np.float64)
    k = _AXES.index(kind[1])
    T = np.zeros((*v.shape, 4, 4))
    T[..., range(4), range(4)] = 1.0
    if kind[0] == "t":
        T[..., k, 3] = v
        return T
    i, j = (k + 1) % 3, (k + 2) % 3
    T[..., i, i] = T[..., j, j] = np.cos(v)
    T[..., j, i] = np.sin(v)
    T[..., i, j] = -T[..., j, i]
    return T
