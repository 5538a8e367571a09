"""An arm file says what the arm is: exactly when it is written, completely when it is wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sixthlink.errors import InputError
from sixthlink.files import load_arm, maker_names, read_arm, write_arm
from sixthlink.robot import (
    Arm,
    Coupling,
    Joint,
    Link,
    Tolerances,
    arm_from_links,
    arm_with_values,
    flange_poses,
    link_table_from_arm,
)

GOOD = """\
schema: sixthlink-arm/1
name: two joints
source: a drawing
units: {length: mm, angle: deg}
convention: dh
joints:
  - {name: q1, lower: -170, upper: 170}
  - {name: q2, lower: 10, upper: 500, sliding: true}
links:
  - {theta: 90, d: 475, a: 150, alpha: -90}
  - {theta: 0, d: 20, a: 0, alpha: 0, beta: 0}
flange: {z: 107, yaw: 45}
tolerances: {length: 0.5, angle: 0.03, joint_repeatability: 0.003}
"""

STEPS = """\
schema: sixthlink-arm/1
name: wedge
source: a drawing
units: {length: mm, angle: deg}
convention: steps
joints:
  - {name: slide, lower: 0, upper: 100, sliding: true}
  - {name: wrist, lower: -90, upper: 90, direction: -1, scale: 1.01}
steps:
  - {kind: tx, parameter: rail, value: 250, joints: {slide: 1}}
  - {kind: ry, parameter: tilt, value: 30, joints: {slide: 0.2}}
  - {kind: rz, parameter: wrist, value: 0, joints: {wrist: 1}}
"""


def written(tmp_path, text):
    path = tmp_path / "arm.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def findings(tmp_path, text):
    with pytest.raises(InputError) as caught:
        read_arm(written(tmp_path, text))
    return {f.field: f for f in caught.value.findings}


def assert_same_bits(a, b):
    for name in ("name", "source", "dialect", "kinds", "parameters", "joints"):
        assert getattr(a, name) == getattr(b, name)
    for name in ("values", "joint_map", "limits"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    for name in ("length_tolerance_m", "angle_tolerance_rad", "joint_repeatability_rad"):
        assert getattr(a, name) == getattr(b, name)


def calibrated(arm, rng):
    """The arm as a calibration leaves it: constants, couplings and joint scales moved a little."""
    joint_map = arm.joint_map * (1 + 1e-3 * rng.normal(size=arm.joint_map.shape))
    return replace(arm_with_values(arm, arm.values + 1e-4 * rng.normal(size=arm.values.shape)), joint_map=joint_map)


@pytest.mark.parametrize("name", maker_names())
def test_every_known_robot_survives_a_calibration_and_a_file(tmp_path, name):
    arm = load_arm(name, folder=Path())
    for variant in (arm, calibrated(arm, np.random.default_rng(1))):
        write_arm(tmp_path / "arm.yaml", variant)
        assert_same_bits(read_arm(tmp_path / "arm.yaml"), variant)


@pytest.mark.parametrize("dialect", ["dh", "mdh"])
def test_random_tables_come_back_bit_for_bit(tmp_path, dialect):
    rng = np.random.default_rng(2)
    for _ in range(20):
        links = [Link(*rng.normal(size=4), beta_rad=[None, rng.normal()][rng.integers(2)]) for _ in range(5)]
        joints = [
            Joint(f"näme {i}: #1", -rng.random(), 1e-7 + rng.random(), [1, -1][i % 2], i == 2, 1 + 1e-5 * i)
            for i in range(5)
        ]
        arm = arm_from_links(
            "Roboter 'A' \"B\"\n2",
            "yes",
            dialect,
            links,
            joints,
            couplings=[Coupling(3, 2, 1e-7), Coupling(5, 4, -1 / 3)],
            flange=rng.normal(size=6) if rng.random() < 0.5 else (),
            tolerances=Tolerances(1e-9, 1 / 3, 1e22),
        )
        write_arm(tmp_path / "arm.yaml", arm)
        assert_same_bits(read_arm(tmp_path / "arm.yaml"), arm)


def test_steps_come_back_bit_for_bit(tmp_path):
    rng = np.random.default_rng(3)
    joint_map = np.zeros((7, 3))
    joint_map[[1, 4, 6], [0, 1, 2]] = -1.0, 1 / 3, 1e-7
    joint_map[3] = 0.1, 0.2, 0.3
    arm = Arm(
        name="s",
        source="s",
        dialect="steps",
        kinds=("rx", "tz", "ry", "rz", "rz", "tx", "tz"),
        parameters=tuple(f"null {k}" for k in range(7)),
        values=rng.normal(size=7) * 10.0 ** rng.integers(-9, 9, 7),
        joint_map=joint_map,
        joints=("1", "true", "c"),
        limits=[[-1, 1], [-1e-3, 1 / 3], [0, 1]],
    )
    write_arm(tmp_path / "arm.yaml", arm)
    assert_same_bits(read_arm(tmp_path / "arm.yaml"), arm)


def test_units_of_a_table_are_the_files(tmp_path):
    arm = read_arm(written(tmp_path, GOOD))
    deg = np.pi / 180
    expected = {"theta1": 90 * deg, "d1": 0.475, "a1": 0.15, "alpha1": -90 * deg, "d2": 0.02, "beta2": 0.0}
    expected |= {"flange_z": 0.107, "flange_yaw": 45 * deg, "flange_x": 0.0}
    values = dict(zip(arm.parameters, arm.values, strict=True))
    assert {key: values[key] for key in expected} == pytest.approx(expected, abs=1e-15)
    np.testing.assert_allclose(arm.limits, [[-170 * deg, 170 * deg], [0.01, 0.5]], atol=1e-15)
    tolerances = arm.length_tolerance_m, arm.angle_tolerance_rad, arm.joint_repeatability_rad
    assert tolerances == pytest.approx((0.5e-3, 0.03 * deg, 0.003 * deg))
    assert [arm.joint_map[arm.parameters.index(p), j] for p, j in (("theta1", 0), ("d2", 1))] == [1.0, 1.0]


def test_units_of_steps_are_the_files(tmp_path):
    """A slide of 50 mm that also tilts by 0.2 degrees per millimetre."""
    arm = read_arm(written(tmp_path, STEPS))
    pose = flange_poses(arm, [[0.05, 0.1]])[0]
    tilt, turn = np.radians(30 + 0.2 * 50), -1.01 * 0.1
    np.testing.assert_allclose(pose[:3, 3], [0.3, 0, 0], atol=1e-15)
    np.testing.assert_allclose(pose[:3, 2], [np.sin(tilt), 0, np.cos(tilt)], atol=1e-15)
    x = [np.cos(tilt) * np.cos(turn), np.sin(turn), -np.sin(tilt) * np.cos(turn)]
    np.testing.assert_allclose(pose[:3, 0], x, atol=1e-15)


def test_coupling_of_a_turn_to_a_slide_counts_in_the_files_units(tmp_path):
    text = GOOD + "couplings: [{joint: 1, driver: 2, factor: 0.2}]\n"
    arm = read_arm(written(tmp_path, text))
    assert arm.joint_map[0, 1] == pytest.approx(np.radians(0.2) / 1e-3)


def test_a_table_that_is_none_is_not_written(tmp_path):
    arm = load_arm("ur5e", folder=Path())
    joint_map = arm.joint_map.copy()
    joint_map[arm.parameters.index("alpha1"), 0] = 0.1
    with pytest.raises(ValueError, match="not a table of links"):
        write_arm(tmp_path / "arm.yaml", replace(arm, joint_map=joint_map))
    with pytest.raises(ValueError, match="not a table of links"):
        link_table_from_arm(read_arm(written(tmp_path, STEPS)))


def test_known_robots_name_their_source_and_doubt_their_numbers():
    assert {"abb_irb1400", "franka_fr3", "franka_panda", "kuka_lbr_iiwa14", "ur5e", "ur10e"} <= {*maker_names()}
    for name in maker_names():
        arm = load_arm(name, folder=Path())
        assert len(arm.source) > 80
        assert min(arm.length_tolerance_m, arm.angle_tolerance_rad, arm.joint_repeatability_rad) > 0
        assert 0.03e-3 / 2 < arm.joint_repeatability_rad < 0.3e-3, name


def test_a_path_counts_from_the_recordings_folder(tmp_path):
    written(tmp_path, GOOD)
    assert load_arm("arm.yaml", folder=tmp_path).name == "two joints"


def test_an_unknown_robot_is_told_which_are_known(tmp_path):
    with pytest.raises(InputError) as caught:
        load_arm("UR10", folder=tmp_path)
    (finding,) = caught.value.findings
    assert "did you mean ur10e" in finding.cure
    assert "abb_irb1400" in finding.expected
    assert "docs/robots.md" in finding.cure


def test_everything_wrong_with_a_file_is_found_at_once(tmp_path):
    text = """\
schema: sixthlink-arm/2
nam: x
source: 3
units: {length: feet}
convention: dh
joints:
  - {name: q1, lower: 5, upper: 4}
  - {name: q1, lower: .inf, upper: 4m, directon: 1}
links:
  - {theta: 0, d: 0, a: 0}
couplings:
  - {joint: 9, driver: 2, factor: -1}
  - {joint: 2, driver: 2, factor: -1}
  - {joint: 2, driver: 2, factor: -1}
steps: []
"""
    found = findings(tmp_path, text)
    places = {field: (f.line, f.column) for field, f in found.items()}
    assert places == {
        "name": (1, 1),
        "schema": (1, 9),
        "nam": (2, 1),
        "source": (3, 9),
        "units.angle": (4, 1),
        "units.length": (4, 17),
        "joints[0]": (7, 5),
        "joints[0].name": (7, 12),
        "joints[1].name": (8, 12),
        "joints[1].lower": (8, 23),
        "joints[1].upper": (8, 36),
        "joints[1].directon": (8, 40),
        "links": (10, 3),
        "links[0].alpha": (10, 5),
        "couplings[0].joint": (12, 13),
        "couplings[1]": (13, 5),
        "couplings[2]": (14, 5),
        "steps": (15, 1),
    }
    assert all(f.cure for f in found.values())
    assert str(found["joints[1].directon"]).endswith("did you mean direction?")


@pytest.mark.parametrize(
    ("text", "field", "word"),
    [
        ("", "file", "is empty"),
        ("- 1", "file", "list"),
        ("joints: 3", "joints", "a list"),
        (GOOD.replace("convention: dh", "convention: DH"), "convention", "did you mean dh or mdh?"),
        (GOOD.replace("units: {length: mm, angle: deg}\n", ""), "units", "is missing"),
        (GOOD.replace("d: 475", "d: 1e999"), "links[0].d", "finite"),
        (GOOD.replace("d: 475", "d: '475'"), "links[0].d", "a number"),
        (GOOD.replace("d: 475", "d: yes"), "links[0].d", "a number"),
        (GOOD.replace("d: 475", "d:"), "links[0].d", "is empty"),
        (GOOD.replace("upper: 170", "upper: 170, direction: 0"), "joints[0].direction", "1 or -1"),
        (GOOD.replace("upper: 170", "upper: 170, scale: 0"), "joints[0].scale", "more than 0"),
        (GOOD.replace("length: 0.5", "length: -0.5"), "tolerances.length", "at least 0"),
        (GOOD.replace("convention: dh", "convention: steps"), "steps", "missing or empty"),
        (GOOD.replace("convention: dh", "convention: steps"), "links", "does not belong"),
        (GOOD.replace("alpha: -90}", "alpha: -90, beta: b}"), "links[0].beta", "a number"),
        (STEPS.replace("parameter: tilt", "parameter: rail"), "steps[1].parameter", "names 2 steps"),
        (STEPS.replace("kind: ry", "kind: yaw"), "steps[1].kind", "rx, ry, rz"),
        (STEPS.replace("{slide: 0.2}", "{sled: 0.2}"), "steps[1].joints.sled", "slide, wrist"),
        (STEPS.replace("{wrist: 1}", "{wrist: 0}"), "joints", "moves no step"),
        (STEPS.replace("kind: rz", "kind: rx"), "steps[2].kind", "rz or tz"),
    ],
)
def test_each_mistake_is_named(tmp_path, text, field, word):
    found = findings(tmp_path, text)
    assert word in str(found[field])


@pytest.mark.parametrize("count", [0, 13])
def test_arms_have_one_to_twelve_joints(tmp_path, count):
    joints = "".join(f"  - {{name: q{k}, lower: -1, upper: 1}}\n" for k in range(count)) or "  []\n"
    links = "  - {theta: 0, d: 1, a: 0, alpha: 90}\n" * count or "  []\n"
    text = GOOD[: GOOD.index("joints:")] + f"joints:\n{joints}links:\n{links}"
    assert "expected 1 to 12" in str(findings(tmp_path, text)["joints"])


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = written(tmp_path, GOOD)
    arm = replace(read_arm(path), dialect="mdh")
    with pytest.raises(ValueError, match="not a table of links"):
        write_arm(path, arm)
    assert path.read_text(encoding="utf-8") == GOOD
    assert [p.name for p in tmp_path.iterdir()] == ["arm.yaml"]


def test_joints_are_checked_where_they_are_made():
    with pytest.raises(ValueError, match="direction is 0"):
        Joint("q", -1, 1, direction=0)
    with pytest.raises(ValueError, match="scale is -1"):
        Joint("q", -1, 1, scale=-1)
    with pytest.raises(ValueError, match="flange has 3 numbers"):
        arm_from_links("a", "b", "dh", [Link(0, 0, 0, 0)], [Joint("q", -1, 1)], flange=(1, 2, 3))


def test_the_examples_of_the_documentation_are_arm_files(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "robots.md").read_text(encoding="utf-8")
    table, steps = (part.split("```")[0] for part in page.split("```yaml\n")[1:])
    assert read_arm(written(tmp_path, table)).dialect == "dh"
    assert read_arm(written(tmp_path, GOOD[: GOOD.index("convention")] + steps)).dialect == "steps"
