"""The target's pose in one shot, seen by the head: what does it say about head, arm, lenses and placement?

The loop of eq. (10) closes at the target: where the robot and the head put it against where its placement is, as a
motion in base axes. Its noise: every joint's error carried to the target by the arm's Jacobian, and the head's error.
For a fixed head the target rides on the flange; the loop closes at the same point, and the robot's part changes sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sixthlink.calibrate.arm import arm_motions
from sixthlink.calibrate.observations.linearised import Linearised
from sixthlink.calibrate.observations.state import Columns, JointState
from sixthlink.geometry import Floats, Ints, hat, inverse, motion_between
from sixthlink.robot import flange_poses

__all__ = ["TargetPoseShots", "carried"]


@dataclass(frozen=True, eq=False)
class TargetPoseShots:
    """N shots of a target.

    Attributes:
        joints: ``(N, J)`` joint values [rad or m].
        Ts_head_target: ``(N, 4, 4)`` target poses as the head saw them.
        placements: ``(N,)`` number of the target's placement.
        noises: Covariance ``(N, 6, 6)`` of those poses, as motions in head axes, per unit of each origin's variance.
        by_lens: ``(N, 6, g)`` motion of those poses in head axes per unit of the cameras' free unknowns.
        repeatability_rad: ``(J,)`` standard deviation of every joint that counts as scale 1 [rad or m].
        fixed_head: Whether the head stands still and the target rides on the flange.
    """

    joints: Floats
    Ts_head_target: Floats
    placements: Ints
    noises: Mapping[str, Floats]
    repeatability_rad: Floats
    by_lens: Floats = field(default_factory=lambda: np.zeros((0, 6, 0)))
    fixed_head: bool = False
    block: str = "placements"

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(N, 6)`` (δp [m], δθ [rad]) in base axes, and derivatives."""
        assert state.X is not None  # noqa: S101 - a target is only seen by a head
        N = len(self.joints)
        Ts_base_flange, by_arm, by_joint = arm_motions(state.arm, self.joints, columns.arm)
        still = np.broadcast_to(np.eye(4), Ts_base_flange.shape)
        Ts_base_carrier, Ts_base_stand = (still, Ts_base_flange) if self.fixed_head else (Ts_base_flange, still)
        Ts_stand_target = state.Ts_stand_target[self.placements]
        Ts_placed = Ts_base_stand @ Ts_stand_target
        Ts_seen = Ts_base_carrier @ state.X @ self.Ts_head_target
        R_carrier, R_head = Ts_base_carrier[:, :3, :3], Ts_base_carrier[:, :3, :3] @ state.X[:3, :3]
        by_flange = carried(Ts_seen[:, :3, 3] - Ts_base_flange[:, :3, 3]) * (-1.0 if self.fixed_head else 1.0)
        arm_lever = (R_head @ self.Ts_head_target[:, :3, 3:])[:, :, 0]
        head_axes = _twice(R_head)
        residuals = motion_between(Ts_placed, Ts_seen)
        shared = np.zeros((N, 6, columns.size))
        shared[:, :, columns.head_slice] = carried(arm_lever) @ _twice(R_carrier)
        shared[:, :, columns.arm_slice] = by_flange @ by_arm
        if columns.lens:
            # The pose that the pixels give changes with the lens; to first order its measured value moves along.
            moved = head_axes @ self.by_lens
            shared[:, :, columns.lens_slice] = moved
            residuals = residuals + moved @ state.lens_step
        noises = {"joints": _squared(by_flange @ by_joint * self.repeatability_rad)}
        noises |= {name: head_axes @ pattern @ np.swapaxes(head_axes, 1, 2) for name, pattern in self.noises.items()}
        return Linearised(residuals, shared, -_twice(Ts_base_stand[:, :3, :3]), self.placements, noises)

    def as_predicted(self, state: JointState) -> TargetPoseShots:
        """The same shots as they would be seen at a state without any error."""
        assert state.X is not None  # noqa: S101
        Ts_base_flange = flange_poses(state.arm, self.joints)
        Ts_stand_target = state.Ts_stand_target[self.placements]
        outer = inverse(Ts_base_flange) if self.fixed_head else Ts_base_flange
        return replace(self, Ts_head_target=inverse(outer @ state.X) @ Ts_stand_target)


def carried(levers_m: Floats) -> Floats:
    """Matrices ``(N, 6, 6)`` that carry a motion to a point ``(N, 3)`` away on the same body [m]."""
    M = np.tile(np.eye(6), (len(levers_m), 1, 1))
    M[:, :3, 3:] = -hat(levers_m)
    return M


def _twice(rotations: Floats) -> Floats:
    """Matrices ``(N, 6, 6)`` that turn a motion's axes by rotations ``(N, 3, 3)``."""
    M = np.zeros((len(rotations), 6, 6))
    M[:, :3, :3] = M[:, 3:, 3:] = rotations
    return M


def _squared(J: Floats) -> Floats:
    return J @ np.swapaxes(J, 1, 2)
