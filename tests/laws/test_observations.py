"""Every kind of observation: its derivatives are those of its residual, and exact data leave none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from problems import random_transforms
from sixthlink.calibrate.arm import BLOCKS, arm_motions, arm_with_steps, link_parameters, optional_parameters
from sixthlink.calibrate.observations import (
    Columns,
    FixedPointTouches,
    JointState,
    KnownLengths,
    MarkSightings,
    MeasuredPoints,
    MeasuredPoses,
    SocketDistances,
    TargetPoseShots,
    moved,
)
from sixthlink.files import load_arm
from sixthlink.geometry import inverse, motion_between, transform, transform_points
from sixthlink.robot import flange_poses, link_poses

ROBOTS = ("abb_irb1400", "franka_fr3")
STEP = 1e-6


def arm_of(robot: str, rng: np.random.Generator):
    arm = load_arm(robot, folder=Path())
    return replace(arm, harmonics=rng.normal(0, 1e-3, (len(arm.joints), 4)))


def parameters(arm):
    return link_parameters(arm) + sum((optional_parameters(arm, block) for block in BLOCKS), ())


def joints(arm, rng, n):
    return rng.uniform(*arm.limits.T, (n, len(arm.joints)))


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_parameter_moves_the_flange_as_its_column_says(robot):
    rng = np.random.default_rng(0)
    arm = arm_of(robot, rng)
    q, free = joints(arm, rng, 4), parameters(arm)
    poses, by_parameter, _ = arm_motions(arm, q, free)
    assert poses == pytest.approx(flange_poses(arm, q), abs=1e-12)
    for a in range(len(free)):
        steps = np.zeros(len(free))
        steps[a] = STEP
        ends = [flange_poses(arm_with_steps(arm, free, s * steps), q) for s in (-1, 1)]
        slope = motion_between(*ends) / (2 * STEP)
        assert by_parameter[:, :, a] == pytest.approx(slope, abs=1e-6), free[a].name


def state_of(arm, rng) -> JointState:
    return JointState(
        arm=arm,
        X=random_transforms(rng, 1, 0.3)[0],
        tool_m=rng.normal(0, 0.1, 3),
        lens_step=np.zeros(2),
        arm_step=np.zeros(0),
        Ts_stand_target=random_transforms(rng, 2),
        points_m=rng.normal(0, 0.5, (2, 2, 3)),
        marks_m=rng.normal(0, 0.5, (2, 2, 3)),
        reflectors_m=rng.normal(0, 0.1, (2, 3)),
        Rs_link_reflector=random_transforms(rng, 2)[:, :3, :3],
        Ts_base_instrument=random_transforms(rng, 2),
    )


def shots(arm, state, rng, *, fixed_head: bool, n: int = 5) -> TargetPoseShots:
    q, placements = joints(arm, rng, n), np.arange(n) % 2
    Ts_base_flange = flange_poses(arm, q)
    if fixed_head:
        Ts_head_target = inverse(state.X) @ Ts_base_flange @ state.Ts_stand_target[placements]
    else:
        Ts_head_target = inverse(Ts_base_flange @ state.X) @ state.Ts_stand_target[placements]
    noises = {"pixels": np.tile(np.eye(6), (n, 1, 1))}
    by_lens = rng.normal(0, 0.1, (n, 6, 2))
    return TargetPoseShots(q, Ts_head_target, placements, noises, np.full(len(arm.joints), 5e-5), by_lens, fixed_head)


def lengths(arm, state, rng, *, fixed_head: bool) -> KnownLengths:
    q = joints(arm, rng, 6)
    return KnownLengths(
        joints=q,
        points_head=rng.normal(0, 0.3, (6, 3)),
        covariances=np.tile(1e-10 * np.eye(3), (6, 1, 1)),
        lengths=np.array([0, 0, 0, 1, 1, 1]),
        ends=np.array([0, 0, 1, 0, 1, 1]),
        length_m=1.0,
        uncertainty_m=1e-6,
        repeatability_rad=np.full(len(arm.joints), 5e-5),
        by_lens=rng.normal(0, 0.1, (6, 3, 2)),
        fixed_head=fixed_head,
    )


def sightings(arm, rng, *, fixed_head: bool) -> MarkSightings:
    return MarkSightings(
        joints=joints(arm, rng, 5),
        points_head=rng.normal(0, 0.3, (5, 3)),
        covariances=np.tile(1e-10 * np.eye(3), (5, 1, 1)),
        places=np.array([0, 0, 0, 1, 1]),
        marks=np.array([0, 0, 1, 0, 1]),
        repeatability_rad=np.full(len(arm.joints), 5e-5),
        by_lens=rng.normal(0, 0.1, (5, 3, 2)),
        fixed_head=fixed_head,
    )


KINDS = ("shots", "shots fixed", "lengths", "lengths fixed", "marks", "marks fixed", "touches", "distances", "measured")
KINDS += ("probed",)


def probed(arm, state: JointState, q) -> MeasuredPoses:
    """Exact poses of a reflector on the flange: large residual turns bend the derivative to first order."""
    at, station = np.ones(len(q), dtype=int), np.arange(len(q)) % 2
    reflector = transform(state.Rs_link_reflector[1], state.reflectors_m[1])
    Ts = inverse(state.Ts_base_instrument)[station] @ link_poses(arm, q, len(arm.joints)) @ reflector
    return MeasuredPoses(q, Ts[:, :3, 3], station, at, np.full(len(arm.joints), 5e-5), rotations=Ts[:, :3, :3])


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_the_residual(robot, kind):
    rng = np.random.default_rng(1)
    arm = load_arm(robot, folder=Path())
    state, free = state_of(arm, rng), link_parameters(arm)
    state = replace(state, arm_step=np.zeros(len(free)))
    seen = {
        "shots": lambda: shots(arm, state, rng, fixed_head=False),
        "shots fixed": lambda: shots(arm, state, rng, fixed_head=True),
        "lengths": lambda: lengths(arm, state, rng, fixed_head=False),
        "lengths fixed": lambda: lengths(arm, state, rng, fixed_head=True),
        "marks": lambda: sightings(arm, rng, fixed_head=False),
        "marks fixed": lambda: sightings(arm, rng, fixed_head=True),
        "touches": lambda: FixedPointTouches(
            joints(arm, rng, 4), np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1]), np.full(len(arm.joints), 5e-5)
        ),
        "distances": lambda: SocketDistances(np.array([0, 1]), 0.05, 1e-4),
        "measured": lambda: MeasuredPoints(
            joints(arm, rng, 4),
            rng.normal(0, 1, (4, 3)),
            np.array([0, 0, 1, 1]),
            np.array([0, 1, 1, 0]),
            np.full(len(arm.joints), 5e-5),
            links=(3, len(arm.joints)),
        ),
        "probed": lambda: probed(arm, state, joints(arm, rng, 5)),
    }[kind]()
    columns = Columns(head=True, tool=True, reflectors=("a", "b"), turned=(1,), lens=2, arm=free)
    linear = seen.linearised(state, columns)

    def residuals(shared, own):
        block = [(seen.block, own)] if seen.block else []
        return seen.linearised(moved(state, columns, shared, block), columns).residuals

    G, L = columns.size, linear.own.shape[2]
    for g in range(G):
        step = np.zeros(G)
        step[g] = STEP
        none = np.zeros((2, L))
        slope = (residuals(step, none) - residuals(-step, none)) / (2 * STEP)
        assert linear.shared[:, :, g] == pytest.approx(slope, abs=2e-6)
    for k in range(L):
        step = np.zeros((2, L))
        step[:, k] = STEP
        slope = (residuals(np.zeros(G), step) - residuals(np.zeros(G), -step)) / (2 * STEP)
        assert linear.own[:, :, k] == pytest.approx(slope, abs=2e-6)


@pytest.mark.parametrize("fixed_head", [False, True])
def test_noise_patterns_are_what_small_errors_do(fixed_head):
    rng = np.random.default_rng(2)
    arm = load_arm("franka_fr3", folder=Path())
    state = replace(state_of(arm, rng), lens_step=np.zeros(0))
    seen = replace(shots(arm, state, rng, fixed_head=fixed_head), by_lens=np.zeros((0, 6, 0)))
    linear = seen.linearised(state, Columns())
    assert np.abs(linear.residuals).max() < 1e-12
    slopes = []
    for j in range(len(arm.joints)):
        error = np.zeros(len(arm.joints))
        error[j] = STEP
        ends = [replace(seen, joints=seen.joints + s * error).linearised(state, Columns()).residuals for s in (-1, 1)]
        slopes.append((ends[1] - ends[0]) / (2 * STEP) * 5e-5)
    J = np.stack(slopes, axis=2)
    assert linear.noises["joints"] == pytest.approx(J @ np.swapaxes(J, 1, 2), abs=1e-14)


def test_a_length_is_that_of_the_points_in_space():
    rng = np.random.default_rng(3)
    arm = load_arm("abb_irb1400", folder=Path())
    state = replace(state_of(arm, rng), lens_step=np.zeros(0))
    seen = replace(lengths(arm, state, rng, fixed_head=False), by_lens=np.zeros((0, 3, 0)))
    points = transform_points(flange_poses(arm, seen.joints) @ state.X, seen.points_head)
    expected = [np.linalg.norm(points[2] - points[:2].mean(0)), np.linalg.norm(points[4:].mean(0) - points[3])]
    assert seen.linearised(state, Columns()).residuals[:, 0] + 1.0 == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("fixed_head", [False, True])
def test_shots_as_predicted_leave_no_residual(fixed_head):
    rng = np.random.default_rng(5)
    arm = load_arm("franka_fr3", folder=Path())
    state = replace(state_of(arm, rng), lens_step=np.zeros(0))
    seen = replace(shots(arm, state, rng, fixed_head=fixed_head), by_lens=np.zeros((0, 6, 0)))
    other = replace(state, X=random_transforms(rng, 1, 0.3)[0])
    assert np.abs(seen.as_predicted(other).linearised(other, Columns()).residuals).max() < 1e-12
