"""From exact axis lines come the exact DH numbers back, whatever the dialect, the signs and where the sweeps stood."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.calibrate.tracked_arm import JointSweep
from sixthlink.calibrate.tracked_arm.axes import arm_axes
from sixthlink.calibrate.tracked_arm.extraction import arm_without_drawing, extracted_arm
from sixthlink.calibrate.tracker import fit_axis, sweep_of
from sixthlink.geometry import exp_rotation, inverse, transform, transform_points
from sixthlink.robot import Arm, Coupling, Joint, Link, Tolerances, arm_from_links, arm_with_values, link_poses

SIGMAS = {"r": 2e-3, "t": 2e-3}
GAUGE = {
    "dh": {"theta1", "d1", "theta6", "d6", "a6", "alpha6"},
    "mdh": {"alpha1", "a1", "theta1", "d1", "theta6", "d6"},
}


def drawn(dialect: str) -> Arm:
    """Six joints, the second and third parallel, one that counts backwards, one that another drives."""
    quarter = np.pi / 2
    shift = int(dialect == "mdh")
    rows = [
        (0.0, 0.475, 0.15, -quarter, None),
        (-quarter, 0.0, 0.6, 0.0, 0.0),
        (0.0, 0.0, 0.12, -quarter, None),
        (0.0, 0.72, 0.0, quarter, None),
        (0.0, 0.0, 0.0, -quarter, None),
        (np.pi, 0.085, 0.0, 0.0, None),
    ]
    if shift:
        across = [(a, alpha, beta) for _, _, a, alpha, beta in rows]
        rows = [(t, d, *across[k - 1]) if k else (t, d, 0.0, 0.0, None) for k, (t, d, *_) in enumerate(rows)]
    joints = [Joint(f"q{k + 1}", -2.5, 2.5, direction=-1 if k == 4 else 1) for k in range(6)]
    return arm_from_links("six", "test", dialect, [Link(*r) for r in rows], joints, couplings=[Coupling(3, 2, -1.0)])


def built(arm: Arm, seed: int) -> Arm:
    rng = np.random.default_rng(seed)
    steps = np.array([SIGMAS[kind[0]] for kind in arm.kinds]) * rng.standard_normal(len(arm.kinds))
    fixed = [p[0] == "d" and f"beta{int(p[1]) + (arm.dialect == 'mdh')}" in arm.parameters for p in arm.parameters]
    own = [name in GAUGE[arm.dialect] for name in arm.parameters]
    return arm_with_values(arm, arm.values + np.where(np.array(fixed) | np.array(own), 0.0, steps))


def swept(arm: Arm, seed: int) -> tuple[dict[int, JointSweep], np.ndarray]:
    """Exact points of a reflector on each joint's own link, every sweep from another stop of the other joints."""
    rng = np.random.default_rng(seed + 50)
    T_tracker_base = transform(exp_rotation(rng.uniform(-1, 1, 3)), rng.uniform(-2, 2, 3))
    sweeps = {}
    for j in range(len(arm.joints)):
        stop = rng.uniform(-0.8, 0.8, len(arm.joints))
        q = np.tile(stop, (20, 1))
        q[:, j] = np.linspace(-1.0, 1.0, 20)
        place = np.tile(rng.uniform(0.2, 0.5, 3), (20, 1))
        points = transform_points(T_tracker_base, transform_points(link_poses(arm, q, j + 1), place))
        fit = fit_axis(sweep_of(points, angles_rad=q[:, j]))
        sweeps[j] = JointSweep(f"A{j + 1}", j, np.arange(20), np.where(np.arange(6) == j, 0.0, stop), fit, ())
    return sweeps, T_tracker_base


@pytest.mark.parametrize("dialect", ["dh", "mdh"])
@pytest.mark.parametrize("seed", range(5))
def test_exact_axes_give_the_numbers_back(dialect, seed):
    nominal = drawn(dialect)
    true = built(nominal, seed)
    sweeps, T_tracker_base = swept(true, seed)
    found = extracted_arm(nominal, sweeps)
    assert found is not None
    names = [p for p in nominal.parameters if p not in GAUGE[dialect]]
    value = dict(zip(found.arm.parameters, found.arm.values, strict=True))
    truth = dict(zip(true.parameters, true.values, strict=True))
    assert [value[n] for n in names] == pytest.approx([truth[n] for n in names], abs=1e-8)
    assert np.abs(true.values - nominal.values).max() > 1e-3
    assert found.T_instrument_base == pytest.approx(T_tracker_base, abs=1e-8)


@pytest.mark.parametrize("dialect", ["dh", "mdh"])
def test_the_axes_of_an_arm_are_where_its_joints_turn(dialect):
    """An axis keeps its place when its own joint turns, and the part behind it turns about it by the right hand."""
    arm, T_base_tracker = built(drawn(dialect), 3), transform(exp_rotation(np.array([0.3, -0.2, 1.0])), [1.0, 2.0, 0.5])
    stop = np.array([0.3, -0.4, 0.5, 0.6, -0.7, 0.8])
    for j, line in enumerate(arm_axes(arm, T_base_tracker, stop)):
        turned = stop.copy()
        turned[j] += 0.3
        before, after = (link_poses(arm, q[None], j + 1)[0] for q in (stop, turned))
        moved = inverse(T_base_tracker) @ after @ inverse(before) @ T_base_tracker
        assert transform_points(moved, line.point_m) == pytest.approx(line.point_m, abs=1e-12)
        assert moved[:3, :3] == pytest.approx(exp_rotation(0.3 * line.direction), abs=1e-12)


def test_without_a_drawing_the_chain_turns_the_same_way():
    """Whatever frames it chooses, points on the last link move as those of the true arm."""
    nominal = drawn("dh")
    joint_map = np.abs(nominal.joint_map) * (nominal.joint_map > 0)
    joint_map[nominal.own_steps[4], 4] = 1.0
    plain = Arm(**(vars(nominal) | {"joint_map": joint_map}))
    true = built(plain, 1)
    sweeps, T_tracker_base = swept(true, 1)
    found = arm_without_drawing("none", "axes", sweeps, np.tile([-1.0, 1.0], (6, 1)), Tolerances())
    q = np.random.default_rng(0).uniform(-1.5, 1.5, (20, 6))
    at_zero = np.zeros((1, 6))
    for arm, T in ((true, T_tracker_base), (found.arm, found.T_instrument_base)):
        moved = T @ link_poses(arm, q, 6) @ inverse(link_poses(arm, at_zero, 6)) @ inverse(T)
        if arm is true:
            wanted = moved
    assert moved == pytest.approx(wanted, abs=1e-7)
