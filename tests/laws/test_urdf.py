"""A robot description is the product of its joint origins and motions, about whatever axis."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sixthlink.errors import InputError
from sixthlink.files import arm_from_urdf, load_arm, read_arm, write_arm
from sixthlink.robot import flange_poses, joint_jacobian, link5_poses


def joint_xml(name, kind, parent, child, xyz=(0, 0, 0), rpy=(0, 0, 0), axis=None, inner=""):
    words = [" ".join(repr(float(v)) for v in values) for values in (xyz, rpy)]
    axis_xml = "" if axis is None else f'<axis xyz="{" ".join(repr(float(v)) for v in axis)}"/>'
    return (
        f'  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words[0]}" rpy="{words[1]}"/>{axis_xml}{inner}</joint>\n'
    )


def robot_xml(joints, links):
    return '<?xml version="1.0"?>\n<robot name="r">\n' + "".join(
        [f'  <link name="{link}"/>\n' for link in links] + joints + ["</robot>\n"]
    )


def saved(tmp_path, text):
    path = tmp_path / "robot.urdf"
    path.write_text(text, encoding="utf-8")
    return path


def placed(xyz, rpy):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), xyz
    return T


LIMIT = '<limit lower="-1.5" upper="2.0" effort="1" velocity="1"/>'
LINKS = [f"l{k}" for k in range(9)]
TYPES = ["revolute", "fixed", "prismatic", "continuous", "revolute", "revolute", "prismatic", "revolute"]
AXES = [(0, 0, 1), None, (0, 0, -2), (1, 0, 0), (0, -1, 0), (0.3, -0.5, 0.8), (-1, 2, -2), (0, 0, -1)]


def random_robot(rng):
    origins = [(rng.normal(size=3), rng.uniform(-3, 3, 3)) for _ in TYPES]
    joints = [joint_xml(f"j{k}", TYPES[k], LINKS[k], LINKS[k + 1], *origins[k], AXES[k], LIMIT) for k in range(8)]
    return origins, [joints[k] for k in rng.permutation(8)]


def moved(kind, axis, value):
    T = np.eye(4)
    unit = np.array(axis, dtype=float) / np.linalg.norm(axis)
    if kind == "prismatic":
        T[:3, 3] = unit * value
    else:
        T[:3, :3] = Rotation.from_rotvec(unit * value).as_matrix()
    return T


def test_a_chain_of_all_types_and_axes_is_its_plain_product(tmp_path):
    rng = np.random.default_rng(1)
    for _ in range(5):
        origins, joints = random_robot(rng)
        arm = arm_from_urdf(saved(tmp_path, robot_xml(joints, LINKS)), "l0", "l8")
        assert arm.joints == ("j0", "j2", "j3", "j4", "j5", "j6", "j7")
        for q in rng.uniform(-1.5, 1.5, (4, 7)):
            value = dict(zip(arm.joints, q, strict=True))
            T = np.eye(4)
            for k, (xyz, rpy) in enumerate(origins):
                T = T @ placed(xyz, rpy)
                if TYPES[k] != "fixed":
                    T = T @ moved(TYPES[k], AXES[k], value[f"j{k}"])
            np.testing.assert_allclose(flange_poses(arm, q[None])[0], T, atol=1e-13)


def test_every_joint_moves_along_its_own_z(tmp_path):
    _, joints = random_robot(np.random.default_rng(2))
    arm = arm_from_urdf(saved(tmp_path, robot_xml(joints, LINKS)), "l0", "l8")
    driven = [kind for kind, row in zip(arm.kinds, arm.joint_map, strict=True) if row.any()]
    assert driven == ["rz", "tz", "rz", "rz", "rz", "tz", "rz"]
    q = np.zeros((2, 7))
    q[1, -1] = 1.0
    z = link5_poses(arm, q)[:, :3, 2]
    np.testing.assert_allclose(z[0], z[1], atol=1e-14)
    turning = joint_jacobian(arm, q)[1][0, 3:, -1]
    np.testing.assert_allclose(np.abs(turning @ z[0]), 1.0, atol=1e-14)


def test_a_part_of_the_tree_is_an_arm_too(tmp_path):
    _, joints = random_robot(np.random.default_rng(3))
    path = saved(tmp_path, robot_xml(joints, LINKS))
    whole, part = arm_from_urdf(path, "l0", "l8"), arm_from_urdf(path, "l3", "l5")
    assert part.joints == ("j3", "j4")
    assert set(part.parameters) < set(whole.parameters)


def test_a_mimic_joint_is_a_coupling(tmp_path):
    """A parallelogram: the third joint also turns back by what the second turns, and starts 0.1 rad on."""
    names = ["base", "a", "b", "c", "tool"]
    mimic = '<mimic joint="two" multiplier="-0.98" offset="0.1"/>'
    text = robot_xml(
        [
            joint_xml("one", "revolute", "base", "a", (0, 0, 1), axis=(0, 0, 1), inner=LIMIT),
            joint_xml("two", "revolute", "a", "b", (0, 0, 1), axis=(0, 1, 0), inner=LIMIT),
            joint_xml("three", "revolute", "b", "c", (0, 0, 1), axis=(0, 1, 0), inner=LIMIT + mimic),
            joint_xml("end", "fixed", "c", "tool", (1, 0, 0)),
        ],
        names,
    )
    arm = arm_from_urdf(saved(tmp_path, text), "base", "tool")
    assert arm.joints == ("one", "two")
    pitch = 0.7 - 0.98 * 0.7 + 0.1
    expected = [np.sin(0.7) + np.cos(pitch), 0, 2 + np.cos(0.7) - np.sin(pitch)]
    np.testing.assert_allclose(flange_poses(arm, [[0.0, 0.7]])[0, :3, 3], expected, atol=1e-14)


def test_kr6_description_and_table_are_the_same_robot(tmp_path):
    """Numbers of ROS-Industrial's kuka_kr6_support: joint origins and axes, not DH."""
    rows = [
        ("A1", (0, 0, 0.4), (0, 0, -1), -170, 170),
        ("A2", (0.025, 0, 0), (0, 1, 0), -190, 45),
        ("A3", (0.455, 0, 0), (0, 1, 0), -120, 156),
        ("A4", (0, 0, 0.035), (-1, 0, 0), -185, 185),
        ("A5", (0.42, 0, 0), (0, 1, 0), -120, 120),
        ("A6", (0.08, 0, 0), (-1, 0, 0), -350, 350),
    ]
    same_robot(tmp_path, "kuka_kr6_r900", rows, (0, np.pi / 2, 0))


def test_iiwa_description_and_table_are_the_same_robot(tmp_path):
    """Upright at zero, axes in turn along z, y, z, -y, z, y, z of the base; lengths of KUKA's drawing."""
    rows = [
        ("A1", (0, 0, 0.1575), (0, 0, 1), -170, 170),
        ("A2", (0, 0, 0.2025), (0, 1, 0), -120, 120),
        ("A3", (0, 0, 0.2045), (0, 0, 1), -170, 170),
        ("A4", (0, 0, 0.2155), (0, -1, 0), -120, 120),
        ("A5", (0, 0, 0.1845), (0, 0, 1), -170, 170),
        ("A6", (0, 0, 0.2155), (0, 1, 0), -120, 120),
        ("A7", (0, 0, 0.081), (0, 0, 1), -175, 175),
    ]
    same_robot(tmp_path, "kuka_lbr_iiwa14", rows, (0, 0, 0), (0, 0, 0.045))


def same_robot(tmp_path, known, rows, flange_rpy, flange_xyz=(0, 0, 0)):
    links = [f"l{k}" for k in range(len(rows) + 2)]
    joints = []
    for k, (name, xyz, axis, lower, upper) in enumerate(rows):
        limit = f'<limit lower="{np.radians(lower)!s}" upper="{np.radians(upper)!s}"/>'
        joints.append(joint_xml(name, "revolute", links[k], links[k + 1], xyz, axis=axis, inner=limit))
    joints.append(joint_xml("end", "fixed", links[-2], links[-1], flange_xyz, flange_rpy))
    described = arm_from_urdf(saved(tmp_path, robot_xml(joints, links)), "l0", links[-1])
    table = load_arm(known, folder=Path())
    assert described.joints == table.joints
    np.testing.assert_allclose(described.limits, table.limits, atol=1e-14)
    q = np.random.default_rng(4).uniform(*table.limits.T, size=(50, len(rows)))
    np.testing.assert_allclose(flange_poses(described, q), flange_poses(table, q), atol=1e-14)


def test_a_described_arm_survives_an_arm_file(tmp_path):
    _, joints = random_robot(np.random.default_rng(5))
    arm = arm_from_urdf(saved(tmp_path, robot_xml(joints, LINKS)), "l0", "l8")
    write_arm(tmp_path / "arm.yaml", arm)
    again = read_arm(tmp_path / "arm.yaml")
    assert again.parameters == arm.parameters
    for name in ("values", "joint_map", "limits"):
        assert getattr(again, name).tobytes() == getattr(arm, name).tobytes()


def one_joint(**changes):
    given = {"kind": "revolute", "axis": (0, 0, 1), "inner": LIMIT} | changes
    joint = joint_xml("j", given["kind"], "base", "tool", (0, 0, 1), (0, 0, 0), given["axis"], given["inner"])
    return robot_xml([joint], ["base", "tool"])


@pytest.mark.parametrize(
    ("text", "base", "tip", "words"),
    [
        (one_joint(), "bose", "tool", ["no link 'bose'", "did you mean base?"]),
        (one_joint(), "tool", "base", ["base does not hang on tool", "swap"]),
        (one_joint(kind="floating"), "base", "tool", ["joint j", "'floating'", "choose links"]),
        (one_joint(kind="planar"), "base", "tool", ["'planar'"]),
        (one_joint(kind="fixed"), "base", "tool", ["no moving joint"]),
        (one_joint(axis=(0, 0, 0)), "base", "tool", ["axis of length zero"]),
        (one_joint(inner=""), "base", "tool", ["has no limit", "continuous"]),
        (one_joint(inner='<limit lower="1" upper="-1"/>'), "base", "tool", ["limits 1.0 to -1.0"]),
        (one_joint(inner=LIMIT + '<mimic joint="other"/>'), "base", "tool", ["mimics 'other'"]),
        (
            one_joint().replace('rpy="0.0 0.0 0.0"', 'rpy="0 0"'),
            "base",
            "tool",
            ["origin rpy '0 0'", "3 finite"],
        ),
        (one_joint().replace('"0.0 0.0 1.0"', '"0 0 nan"', 1), "base", "tool", ["origin xyz '0 0 nan'"]),
        ("<robot", "base", "tool", ["not XML"]),
        ("<model/>", "base", "tool", ["<model>", "<robot>"]),
        ('<!DOCTYPE r [<!ENTITY a "b">]>' + one_joint(), "base", "tool", ["DOCTYPE", "remove it"]),
        (
            '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:m/></robot>',
            "b",
            "t",
            ["expand it first"],
        ),
        (one_joint().replace('"-1.5"', '"${-pi}"'), "base", "tool", ["expand it first"]),
        ("<robot>" + " " * (4 * 2**20) + "</robot>", "base", "tool", ["at most 4194304"]),
    ],
)
def test_each_mistake_is_named(tmp_path, text, base, tip, words):
    with pytest.raises(InputError) as caught:
        arm_from_urdf(saved(tmp_path, text), base, tip)
    for word in words:
        assert word in str(caught.value)


def test_all_mistakes_come_at_once_with_their_lines(tmp_path):
    text = robot_xml(
        [
            joint_xml("a", "revolute", "base", "l", axis=(0, 0, 0), inner=LIMIT),
            joint_xml("b", "planar", "l", "m"),
            joint_xml("c", "revolute", "m", "tool", axis=(0, 0, 1)),
        ],
        ["base", "l", "m", "tool"],
    )
    with pytest.raises(InputError) as caught:
        arm_from_urdf(saved(tmp_path, text), "base", "tool")
    assert {(f.field, f.line) for f in caught.value.findings} == {
        ("joint a", 7),
        ("joint b", 8),
        ("joint c", 9),
    }


def test_a_missing_file_and_a_wrong_encoding_are_findings(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        arm_from_urdf(tmp_path / "none.urdf", "a", "b")
    (tmp_path / "robot.urdf").write_bytes(one_joint().encode("utf-16"))
    with pytest.raises(InputError, match="UTF-8"):
        arm_from_urdf(tmp_path / "robot.urdf", "a", "b")
