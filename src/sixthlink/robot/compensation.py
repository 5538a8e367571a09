"""Which joint values bring the calibrated arm to where its controller believes it goes?

For controllers that accept no new kinematics: the programmed joint values are changed a little, so that the arm as it
is reaches the pose that the arm as drawn would have reached. Damped Gauss-Newton on the pose (Levenberg), from the
programmed values, so that the configuration of the arm stays what it was; every answer is put through the calibrated
arm's forward kinematics again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, frozen_floats, motion_between
from sixthlink.robot.arm import Arm, flange_poses, joint_jacobian

__all__ = ["Compensation", "compensated_joints"]

STEPS = 60
ARRIVED_M = 1e-9
"""Distance, and angle in radians, within which a pose counts as reached."""

DAMPING = 1e-3
"""Share of the miss that damps a step: far starts crawl, near ones converge quadratically."""

TURN_LENGTH_M = 1.0
"""Metres that one radian counts where a pose cannot be reached in full."""


@dataclass(frozen=True, eq=False)
class Compensation:
    """Corrected joint values.

    Attributes:
        joints: ``(N, J)`` corrected values [rad or m].
        before: ``(N, 2)`` miss of the uncorrected values: distance [m] and angle [rad].
        after: ``(N, 2)`` what is left by the corrected ones, through the calibrated arm's forward kinematics [m, rad].
        reached: ``(N,)`` whether the pose is reached.
        inside: ``(N,)`` whether all joints stay inside their limits.
    """

    joints: Floats
    before: Floats
    after: Floats
    reached: npt.NDArray[np.bool_]
    inside: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        N = len(self.joints)
        object.__setattr__(self, "joints", frozen_floats(self.joints, (N, None), "joints"))
        for name in ("before", "after"):
            object.__setattr__(self, name, frozen_floats(getattr(self, name), (N, 2), name))


def compensated_joints(arm: Arm, Ts_base_flange: npt.ArrayLike, programmed: npt.ArrayLike) -> Compensation:
    """Joint values with which the calibrated arm reaches poses.

    Args:
        arm: The calibrated arm.
        Ts_base_flange: ``(N, 4, 4)`` desired poses.
        programmed: ``(N, J)`` joint values to start from [rad or m]; the answer stays in their configuration.

    Returns:
        The corrected values; ``reached`` and ``inside`` say which can be used.
    """
    wanted, q = np.asarray(Ts_base_flange, dtype=np.float64), np.array(programmed, dtype=np.float64)
    weights = np.array([1.0, 1.0, 1.0, TURN_LENGTH_M, TURN_LENGTH_M, TURN_LENGTH_M])
    before = _sizes(motion_between(flange_poses(arm, q), wanted))
    for _ in range(STEPS):
        poses, by_joint = joint_jacobian(arm, q)
        miss = motion_between(poses, wanted) * weights
        sizes = np.linalg.norm(miss, axis=1)
        if (sizes < ARRIVED_M * 1e-3).all():
            break
        J = by_joint * weights[:, None]
        normal = np.swapaxes(J, 1, 2) @ J + (DAMPING * sizes**2 + 1e-12)[:, None, None] * np.eye(q.shape[1])
        q += np.linalg.solve(normal, np.einsum("nij,ni->nj", J, miss)[:, :, None])[:, :, 0]
    after = _sizes(motion_between(flange_poses(arm, q), wanted))
    outside = ((q < arm.limits[:, 0]) | (q > arm.limits[:, 1])).sum(axis=1)
    return Compensation(q, before, after, after.max(axis=1) <= ARRIVED_M, outside == 0)


def _sizes(motions: Floats) -> Floats:
    return np.stack([np.linalg.norm(motions[:, :3], axis=1), np.linalg.norm(motions[:, 3:], axis=1)], axis=1)
