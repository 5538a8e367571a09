"""What does one simulated recording hold: a fresh arm, a fresh head, fresh noise?

Truth comes from the simulator's kinematics, never from the arm model that is being judged.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint import HeadShots, JointData
from sixthlink.calibrate.observations import Columns, JointState, KnownLengths, TargetPoseShots
from sixthlink.geometry import Floats, apply_motion, inverse, transform_points
from sixthlink.robot import Arm, flange_poses
from sixthlink.simulate import built_arm, chain_of_arm, chain_poses, mounted_head
from sixthlink.study.plan import Plan

__all__ = ["Draw", "drawn_poses", "told"]

WRONG_BY = 2.0
"""By what the noise is understated in the control of that name."""

NEXT_TO_NOTHING_RAD = 1e-12
"""Repeatability of joints whose noise shall not enter any weight."""


@dataclass(frozen=True, eq=False)
class Draw:
    """One recording and its truth.

    Attributes:
        arm: The arm as it was built.
        T_flange_head: ``(4, 4)`` the head as it was mounted.
        exact: ``(N, 4, 4)`` target poses at the commanded joints without any noise.
        data: What was observed, with the noise that is true of it.
        lengths: The ruler's marks as they were seen, with the noise that is true of them.
        lens_truth: ``(g,)`` step of the cameras' free unknowns to the cameras as they were built.
        lens_names: Names of these unknowns.
    """

    arm: Arm
    T_flange_head: Floats
    exact: Floats
    data: JointData
    lengths: KnownLengths
    lens_truth: Floats = field(default_factory=lambda: np.zeros(0))
    lens_names: tuple[str, ...] = ()


def drawn_poses(plan: Plan, random: np.random.Generator) -> Draw:
    """A recording that begins with target poses and ruler marks, each with the noise that its pixels would give it."""
    arm = built_arm(plan.scenario, plan.arm, random)
    T_flange_head = drawn_head_of(plan, random)
    chain = chain_of_arm(arm)
    repeatability_rad = plan.scenario.joint_repeatability_rad

    def head_at(joints: Floats) -> Floats:
        return chain_poses(chain, joints) @ T_flange_head

    def stopped(joints: Floats) -> Floats:
        return joints + repeatability_rad * random.standard_normal(joints.shape)

    Ts_base_target = plan.Ts_base_target[plan.placements]
    true_poses = inverse(head_at(stopped(plan.joints))) @ Ts_base_target
    Ts_head_target = apply_motion(true_poses, _drawn(plan.covariances, random))
    marks = transform_points(inverse(head_at(stopped(plan.ruler_joints))), plan.marks_base)
    problem = HeadProblem(flange_poses(plan.arm, plan.joints), Ts_head_target, plan.placements)
    return Draw(
        arm,
        T_flange_head,
        exact=inverse(head_at(plan.joints)) @ Ts_base_target,
        data=JointData(plan.arm, HeadShots(plan.joints, problem, covariances=plan.covariances)),
        lengths=KnownLengths(
            plan.ruler_joints,
            marks + _drawn(plan.mark_covariances, random),
            plan.mark_covariances,
            plan.lengths,
            plan.ends,
            plan.length_m,
            0.0,
            np.full(plan.joints.shape[1], repeatability_rad),
        ),
    )


def drawn_head_of(plan: Plan, random: np.random.Generator) -> Floats:
    """``T_flange_head`` ``(4, 4)`` mounted a little beside the drawing."""
    drawing = plan.cell.recording.head.nominal
    assert drawing is not None  # noqa: S101 - a simulated recording always has a drawing
    return mounted_head(plan.scenario, drawing, random)


def told(draw: Draw, control: str) -> tuple[JointData, KnownLengths]:
    """What the estimator is told: the truth about the noise, or what a control says instead."""
    data, lengths, shots = draw.data, draw.lengths, draw.data.shots
    assert shots is not None  # noqa: S101 - every draw has shots
    assert shots.covariances is not None  # noqa: S101 - and they know their noise
    if control == "weights-wrong-by-two":
        arm = replace(data.arm, joint_repeatability_rad=data.arm.joint_repeatability_rad / WRONG_BY)
        shots = replace(shots, covariances=shots.covariances / WRONG_BY**2)
        lengths = replace(
            lengths,
            repeatability_rad=lengths.repeatability_rad / WRONG_BY,
            covariances=lengths.covariances / WRONG_BY**2,
        )
    elif control == "unwhitened":
        arm = replace(data.arm, joint_repeatability_rad=NEXT_TO_NOTHING_RAD)
        shots = replace(shots, covariances=_same_for_all(data, draw))
    else:
        return data, lengths
    return replace(data, arm=arm, shots=shots), lengths


def _same_for_all(data: JointData, draw: Draw) -> Floats:
    """Covariances ``(N, 6, 6)`` of the right size on average, but one number for metres and one for radians."""
    shots = data.shots
    assert shots is not None  # noqa: S101
    kind = TargetPoseShots(
        shots.joints,
        shots.problem.Ts_inner,
        shots.problem.placements,
        {"pixels": np.asarray(shots.covariances)},
        np.full(shots.joints.shape[1], data.arm.joint_repeatability_rad),
    )
    placements = int(shots.problem.placements.max()) + 1
    state = JointState(data.arm, X=draw.T_flange_head, Ts_stand_target=np.tile(np.eye(4), (placements, 1, 1)))
    variances = sum(np.einsum("nii->ni", noise) for noise in kind.linearised(state, Columns()).noises.values())
    across, turn = np.mean(variances[:, :3]), np.mean(variances[:, 3:])
    return np.tile(np.diag(np.repeat([across, turn], 3)), (len(shots.joints), 1, 1))


def _drawn(covariances: Floats, random: np.random.Generator) -> Floats:
    """Normal errors ``(N, d)`` of given covariances ``(N, d, d)``."""
    z = random.standard_normal(covariances.shape[:2])
    return np.asarray((np.linalg.cholesky(covariances) @ z[:, :, None])[:, :, 0], dtype=np.float64)
