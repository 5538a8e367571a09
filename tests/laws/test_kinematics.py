"""The arm is a product of elementary motions, whatever dialect it was written in."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.files import load_arm, maker_names
from sixthlink.robot import (
    Arm,
    Coupling,
    Joint,
    Link,
    arm_from_links,
    arm_with_values,
    flange_jacobian,
    flange_poses,
    joint_jacobian,
    last_link,
    link5_poses,
)

RECORDED = Path(__file__).resolve().parents[3] / "shared" / "data"
DEG = np.pi / 180


def motion(kind, value):
    """4×4 matrix of one elementary motion, written out entry by entry."""
    c, s = np.cos(value), np.sin(value)
    return {
        "rx": np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]]),
        "ry": np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]]),
        "rz": np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
        "tx": np.array([[1, 0, 0, value], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
        "ty": np.array([[1, 0, 0, 0], [0, 1, 0, value], [0, 0, 1, 0], [0, 0, 0, 1]]),
        "tz": np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, value], [0, 0, 0, 1]]),
    }[kind]


def product(*motions):
    T = np.eye(4)
    for kind, value in motions:
        T = T @ motion(kind, value)
    return T


def joints_within(arm, count, rng):
    return rng.uniform(arm.limits[:, 0], arm.limits[:, 1], size=(count, len(arm.joints)))


def arm_of_every_kind(rng):
    """Twelve steps of all kinds; joint b slides, joint c also turns two steps that are not its own."""
    kinds = ("tx", "rz", "ry", "ty", "tz", "rx", "rz", "tx", "rx", "ty", "rz", "tz")
    joint_map = np.zeros((12, 3))
    joint_map[1, 0], joint_map[4, 1], joint_map[10, 2] = 1.0, -1.0, 1.003
    joint_map[2, 2], joint_map[8, 2] = 0.4, -0.3
    return Arm(
        name="every kind",
        source="random",
        dialect="steps",
        kinds=kinds,
        parameters=tuple(f"p{k}" for k in range(12)),
        values=rng.normal(size=12),
        joint_map=joint_map,
        joints=("a", "b", "c"),
        limits=[[-3, 3], [-0.5, 0.5], [-2, 2]],
    )


def arms(rng):
    return [load_arm(name, folder=Path()) for name in maker_names()] + [arm_of_every_kind(rng)]


def test_forward_kinematics_is_the_plain_product_of_its_steps():
    rng = np.random.default_rng(1)
    for arm in arms(rng):
        for q in joints_within(arm, 5, rng):
            values = arm.values + arm.joint_map @ q
            expected = product(*zip(arm.kinds, values, strict=True))
            np.testing.assert_allclose(flange_poses(arm, q[None])[0], expected, atol=1e-14)


def test_a_dh_table_is_rz_tz_tx_rx_ry_and_a_modified_one_rx_tx_ry_rz_tz():
    rng = np.random.default_rng(2)
    links = [Link(*rng.normal(size=4), beta_rad=rng.normal()) for _ in range(4)]
    joints = [
        Joint("a", -1, 1),
        Joint("b", -1, 1, sliding=True),
        Joint("c", -1, 1, direction=-1),
        Joint("d", -1, 1, scale=1.01),
    ]
    x, y, z, yaw, pitch, roll = flange = rng.normal(size=6)
    q = rng.uniform(-1, 1, 4)
    theta = [links[0].theta_rad + q[0], links[1].theta_rad, links[2].theta_rad - q[2] + 0.7 * q[1]]
    theta += [links[3].theta_rad + 1.01 * q[3]]
    d = [links[0].d_m, links[1].d_m + q[1], links[2].d_m, links[3].d_m]
    dh, mdh = np.eye(4), np.eye(4)
    for i, row in enumerate(links):
        a, alpha, beta = ("tx", row.a_m), ("rx", row.alpha_rad), ("ry", row.beta_rad)
        dh = dh @ product(("rz", theta[i]), ("tz", d[i]), a, alpha, beta)
        mdh = mdh @ product(alpha, a, beta, ("rz", theta[i]), ("tz", d[i]))
    end = product(("tx", x), ("ty", y), ("tz", z), ("rz", yaw), ("ry", pitch), ("rx", roll))
    for dialect, expected in (("dh", dh @ end), ("mdh", mdh @ end)):
        arm = arm_from_links("x", "x", dialect, links, joints, couplings=[Coupling(3, 2, 0.7)], flange=flange)
        np.testing.assert_allclose(flange_poses(arm, q[None])[0], expected, atol=1e-14)


def test_modified_and_classical_tables_of_the_same_robot_agree():
    rng = np.random.default_rng(3)
    theta, d, a, alpha = rng.normal(size=(4, 6))
    joints = [Joint(f"q{i}", -3, 3) for i in range(6)]
    before = [Link(theta[i], d[i], a[i - 1] if i else 0, alpha[i - 1] if i else 0) for i in range(6)]
    after = [Link(*row) for row in zip(theta, d, a, alpha, strict=True)]
    q = rng.uniform(-3, 3, (20, 6))
    modified = flange_poses(arm_from_links("m", "x", "mdh", before, joints), q)
    classical = flange_poses(arm_from_links("c", "x", "dh", after, joints), q)
    # The classical table goes one common normal further than the modified one.
    np.testing.assert_allclose(modified @ motion("tx", a[5]) @ motion("rx", alpha[5]), classical, atol=1e-13)


@pytest.mark.parametrize("link", range(1, 6))
def test_turning_a_common_normal_round_gives_the_same_arm(link):
    """Every DH row has a twin: the normal counted the other way, and the next joint half a turn on."""
    rng = np.random.default_rng(link)
    arm = load_arm("abb_irb1400", folder=Path())
    values = dict(zip(arm.parameters, arm.values, strict=True))
    values[f"theta{link}"] += np.pi
    values[f"theta{link + 1}"] += np.pi
    for symbol in ("a", "alpha", "beta"):
        if f"{symbol}{link}" in values:
            values[f"{symbol}{link}"] *= -1
    twin = arm_with_values(arm, list(values.values()))
    q = joints_within(arm, 20, rng)
    np.testing.assert_allclose(flange_poses(twin, q), flange_poses(arm, q), atol=1e-14)


def motion_per_unit(poses_at, unit, step=1e-6):
    """Central difference of poses as (δp, δθ) in base axes; the turn is the skew part of dR · Rᵀ."""
    plus, minus, here = poses_at(step * unit), poses_at(-step * unit), poses_at(0 * unit)
    turned = (plus[:, :3, :3] - minus[:, :3, :3]) @ here[:, :3, :3].swapaxes(1, 2) / (2 * step)
    shifted = (plus[:, :3, 3] - minus[:, :3, 3]) / (2 * step)
    return np.column_stack([shifted, turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]])


@pytest.mark.parametrize("arm", arms(np.random.default_rng(4)), ids=lambda arm: arm.name)
def test_flange_jacobian_is_the_slope_of_every_step(arm):
    q = joints_within(arm, 4, np.random.default_rng(4))

    def poses_at(change):
        return flange_poses(arm_with_values(arm, arm.values + change), q)

    poses, jacobian = flange_jacobian(arm, q)
    np.testing.assert_allclose(poses, flange_poses(arm, q), atol=1e-14)
    for k, unit in enumerate(np.eye(len(arm.kinds))):
        slope = motion_per_unit(poses_at, unit)
        np.testing.assert_allclose(jacobian[:, :, k], slope, atol=1e-8, err_msg=arm.parameters[k])


@pytest.mark.parametrize("arm", arms(np.random.default_rng(5)), ids=lambda arm: arm.name)
def test_joint_jacobian_is_the_slope_of_every_joint(arm):
    q = joints_within(arm, 4, np.random.default_rng(5))

    def poses_at(change):
        return flange_poses(arm, q + change)

    _, jacobian = joint_jacobian(arm, q)
    for j, unit in enumerate(np.eye(len(arm.joints))):
        slope = motion_per_unit(poses_at, unit)
        np.testing.assert_allclose(jacobian[:, :, j], slope, atol=1e-8, err_msg=arm.joints[j])


def test_link5_turns_about_its_own_z_with_the_last_joint():
    rng = np.random.default_rng(6)
    for arm in arms(rng):
        q = joints_within(arm, 6, rng)
        q[:] = q[0]
        q[:, -1] = np.linspace(*arm.limits[-1], 6)
        poses = link5_poses(arm, q)
        np.testing.assert_allclose(poses @ last_link(arm), flange_poses(arm, q), atol=1e-13)
        if arm.name == "every kind":
            continue  # its last joint drives more than its own step
        np.testing.assert_allclose(poses[:, :3, 2:], np.broadcast_to(poses[0, :3, 2:], (6, 3, 2)), atol=1e-13)


def test_irb1400_stands_as_its_drawing_says():
    arm = load_arm("abb_irb1400", folder=Path())
    expected = [
        [0, 0, 1, 0.150 + 0.720 + 0.085],
        [0, 1, 0, 0],
        [-1, 0, 0, 0.475 + 0.600 + 0.120],
        [0, 0, 0, 1],
    ]
    np.testing.assert_allclose(flange_poses(arm, np.zeros((1, 6)))[0], expected, atol=1e-15)


def test_irb1400_lower_arm_moves_without_turning_the_upper_arm():
    """The parallelogram: axis 2 alone carries the flange along a circle of the lower arm's length."""
    arm = load_arm("abb_irb1400", folder=Path())
    q = np.zeros((5, 6))
    q[:, 1] = [-60 * DEG, -20 * DEG, 0, 30 * DEG, 70 * DEG]
    poses = flange_poses(arm, q)
    np.testing.assert_allclose(poses[:, :3, :3], poses[2, :3, :3][None].repeat(5, 0), atol=1e-14)
    circle = np.column_stack([0.6 * np.sin(q[:, 1]), np.zeros(5), 0.6 * np.cos(q[:, 1]) - 0.6])
    np.testing.assert_allclose(poses[:, :3, 3] - poses[2, :3, 3], circle, atol=1e-14)


SIMULATED_IRB1410 = [
    # Joint angles in degrees, to 0.01; position in mm and quaternion (w, x, y, z) of ABB's simulator for the
    # IRB 1410, listed by Malla and Shanmugavel, Industrial Robot 51 (2024), doi 10.1108/IR-01-2024-0046.
    [30.80, -12.13, 15.33, -40, 59.80, -28, 691.027, 356.960, 921.353, 0.12924, -0.57273, 0.74682, -0.31231],
    [40.80, -17.73, 39.17, -30, 47.53, 32, 483.358, 375.808, 606.446, 0.13862, -0.24275, 0.94970, -0.14115],
    [-11.33, 27.07, 19.00, -30, 39.87, 80, 1160.640, -260.405, 822.485, 0.33426, 0.56295, 0.75530, -0.02980],
    [9.07, 39.20, 46.50, -8, 62.87, 44, 1072.337, 160.460, 420.616, 0.12517, -0.25528, -0.95056, 0.12492],
    [-20.40, 36.40, 63.00, 2, 35.27, 84, 870.067, -321.748, 286.787, 0.06600, -0.79714, -0.59942, 0.03030],
    [2.27, 0.93, 8.00, -62, -73.60, 28, 914.994, 108.270, 1128.117, 0.81860, -0.46042, 0.29097, 0.18231],
]


def test_irb1400_meets_the_poses_of_the_makers_simulator():
    """Same dimensions as the IRB 1410; what is left is the rounding of the joint angles."""
    arm = load_arm("abb_irb1400", folder=Path())
    table = np.array(SIMULATED_IRB1410)
    poses = flange_poses(arm, table[:, :6] * DEG)
    np.testing.assert_allclose(poses[:, :3, 3] * 1e3, table[:, 6:9], atol=0.1)
    turned = Rotation.from_matrix(poses[:, :3, :3]).inv() * Rotation.from_quat(table[:, 9:], scalar_first=True)
    assert turned.magnitude().max() < 0.01 * DEG


def test_ur_robots_stretched_out_reach_the_sums_of_their_lengths():
    """All joints at zero: the arm lies along -x, the tool looks along -y, as the maker's drawing shows."""
    for name, x, y, z in (
        ("ur5e", -0.425 - 0.3922, -0.1333 - 0.0996, 0.1625 - 0.0997),
        ("ur10e", -0.6127 - 0.57155, -0.17415 - 0.11655, 0.1807 - 0.11985),
    ):
        pose = flange_poses(load_arm(name, folder=Path()), np.zeros((1, 6)))[0]
        np.testing.assert_allclose(pose, [[1, 0, 0, x], [0, 0, -1, y], [0, 1, 0, z], [0, 0, 0, 1]], atol=1e-15)


def test_ur_robots_stand_upright_with_shoulder_and_wrist_at_minus_ninety_degrees():
    """The home position: everything above the base but the two offsets of the wrist."""
    for name, height, offset in (
        ("ur5e", 0.1625 + 0.425 + 0.3922 + 0.0997, 0.1333 + 0.0996),
        ("ur10e", 0.1807 + 0.6127 + 0.57155 + 0.11985, 0.17415 + 0.11655),
    ):
        q = np.array([[0, -90, 0, -90, 0, 0]]) * DEG
        position = flange_poses(load_arm(name, folder=Path()), q)[0, :3, 3]
        np.testing.assert_allclose(position, [0, -offset, height], atol=1e-15)


def test_kuka_iiwa_stands_1306_mm_tall():
    pose = flange_poses(load_arm("kuka_lbr_iiwa14", folder=Path()), np.zeros((1, 7)))[0]
    np.testing.assert_allclose(pose, motion("tz", 1.306), atol=1e-15)


def recorded(name):
    folder = RECORDED / name
    if not folder.is_dir():
        message = f"recorded data {name} are not beside the repository (../shared/data)"
        pytest.fail(message) if os.environ.get("CI") else pytest.skip(message)
    return folder


def test_fr3_meets_the_poses_that_its_controller_reported():
    """The controller's tool is turned by 45 degrees against the flange.

    Joints and pose were sampled a moment apart: they differ at random by 18 µm RMS, and no table explains it.
    """
    folder = recorded("fr3_joint_camera")
    q = np.loadtxt(folder / "joints.csv", delimiter=",", skiprows=1)
    reported = np.genfromtxt(folder / "controller_tcp_poses.csv", delimiter=",", skip_header=2)[:, 1:]
    reported = reported.reshape(-1, 4, 4)
    reported[:, :3, 3] *= 1e-3
    computed = flange_poses(load_arm("franka_fr3", folder=Path()), q) @ motion("rz", 45 * DEG)
    assert len(q) == 114
    np.testing.assert_allclose(computed, reported, atol=1e-4, rtol=0)
    apart_m = np.linalg.norm(computed[:, :3, 3] - reported[:, :3, 3], axis=1)
    assert np.sqrt(np.mean(apart_m**2)) < 20e-6


def test_iiwa_holds_a_socketed_ball_still():
    """A wrong sign in the table would move the ball by decimetres; the arm's own errors move it by 0.6 mm."""
    arm = load_arm("kuka_lbr_iiwa14", folder=Path())
    files = sorted(recorded("mukca_two_socket_50mm").glob("kuka_14/*/socket_*.csv"))
    assert files
    for file in files:
        T = flange_poses(arm, np.loadtxt(file, delimiter=",", skiprows=1))
        # R ball + p = socket, linear in the ball's place on the flange and the socket's place.
        A = np.concatenate([T[:, :3, :3], -np.eye(3)[None].repeat(len(T), 0)], axis=2).reshape(-1, 6)
        b = -T[:, :3, 3].ravel()
        x = np.linalg.lstsq(A, b)[0]
        rms_m = np.sqrt(np.mean(np.sum((A @ x - b).reshape(-1, 3) ** 2, axis=1)))
        assert rms_m < 0.7e-3, file
