"""A robot whose axes are all vertical, from folder to page: refused, or solved as far as it can be seen, on request."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from scipy.spatial.transform import Rotation

from sixthlink.camera import Camera
from sixthlink.cli.main import main
from sixthlink.files import write_arm, write_recording
from sixthlink.recording import CameraDescription, Detections, Head, Recording
from sixthlink.robot import Joint, Link, arm_from_links, flange_poses
from sixthlink.target import Chessboard, LengthStandard

BOARD = Chessboard(7, 6, 0.03)
RULER_M, FOCAL_PX, CENTRE_PX, NOISE_PX = 0.4, 1500.0, 699.5, 0.05
LINKS = [Link(0, 0.5, 0.35, 0), Link(0, 0, 0.3, np.pi), Link(0, 0, 0, 0), Link(0, 0.05, 0, 0)]
JOINTS = [Joint("q1", -2.5, 2.5), Joint("q2", -2.5, 2.5), Joint("q3", 0, 0.3, sliding=True), Joint("q4", -6, 6)]
SCARA = arm_from_links("four axes", "a drawing", "dh", LINKS, JOINTS)
FIRST = np.array([0.3, 0.6, 0.1, 0.2])

T_flange_head = np.eye(4)
T_flange_head[:3, :3] = Rotation.from_euler("xyz", [0.2, -0.15, 0.5]).as_matrix()
T_flange_head[:3, 3] = [0.04, -0.06, 0.11]
T_left_head = np.eye(4)
T_left_head[:3, 3] = [0.12, 0.0, 0.0]


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def record(folder: Path, *, moved: tuple[float, ...] = (0.2, 0.3, 0.05, 0.6), tilt_rad: float = 0.0) -> Path:
    """A SCARA's stereo recording of a board and of a ruler; a tilt makes flange poses of its ruler shots."""
    rng = np.random.default_rng(0)
    ids, kinds, places, marks, rows, columns = [], [], [], [], [], []
    starts = FIRST + np.outer(np.arange(4) - 1.5, [0.15, -0.1, 0.0, 0.0])
    joints = np.concatenate([starts[k] + rng.uniform(-1.0, 1.0, (7 if k < 2 else 2, 4)) * moved for k in range(4)])
    flanges = flange_poses(SCARA, joints)
    if tilt_rad:
        flanges[15::2, :3, :3] = flanges[15::2, :3, :3] @ Rotation.from_rotvec([tilt_rad, 0, 0]).as_matrix()
    ruler = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]]) * RULER_M
    for shot, T_base_flange in enumerate(flanges):
        place = min(shot // 7, 2) if shot < 14 else 2 + (shot - 14) // 2
        verify, mark = place >= 2, (shot - 14) % 2
        T_base_head = T_base_flange @ T_flange_head
        T_base_target = flange_poses(SCARA, starts[place][None])[0] @ T_flange_head
        T_base_target[:3, 3] += 0.55 * T_base_target[:3, 2]
        points = ruler[[mark]] if verify else BOARD.points_m - BOARD.points_m.mean(axis=0)
        in_base = points @ T_base_target[:3, :3].T + T_base_target[:3, 3]
        for camera, T in enumerate((np.eye(4), T_left_head)):
            P = (T @ np.linalg.inv(T_base_head))[:3] @ np.c_[in_base, np.ones(len(in_base))].T
            pixels = FOCAL_PX * P[:2].T / P[2][:, None] + CENTRE_PX + rng.normal(0.0, NOISE_PX, (len(in_base), 2))
            names = [mark] if verify else range(len(in_base))
            columns += [(shot, camera, name, *pixel) for name, pixel in zip(names, pixels, strict=True)]
        ids.append(f"s{shot:02d}")
        kinds.append("verify" if verify else "calibrate")
        places.append(f"p{place + 1}")
        marks.append("AB"[mark] if verify else "")
        rows.append(T_base_flange)
    table = np.array(columns)
    whole = [table[:, k].astype(int) for k in range(3)]
    lens = Camera(1400, 1400, np.full(2, FOCAL_PX), np.full(2, CENTRE_PX), np.zeros(5))
    cameras = (CameraDescription("right", 1400, 1400, lens), CameraDescription("left", 1400, 1400, lens, T_left_head))
    recording = Recording(
        name=folder.name,
        mount="eye-in-hand",
        robot="four axes",
        arm=None if tilt_rad else SCARA,
        head=Head(cameras),
        target=BOARD,
        standard=LengthStandard(RULER_M, 3e-6, "quadrant", 0.02),
        ids=tuple(ids),
        placements=tuple(places),
        kinds=tuple(kinds),
        marks=tuple(marks),
        joints=None if tilt_rad else joints,
        Ts_base_flange=np.array(rows) if tilt_rad else None,
        pixels=Detections(*whole, table[:, 3:], np.full(len(table), NOISE_PX)),
    )
    folder.mkdir(parents=True, exist_ok=True)
    write_arm(folder / "scara.yaml", SCARA)
    robot = {"kinematics": "none", "label": "four axes"} if tilt_rad else {"arm": "scara.yaml"}
    write_recording(folder, recording, robot=robot)
    return folder


QUICK = ("--swarms", 2, "--iterations", 200)


@pytest.fixture(scope="module")
def scara(tmp_path_factory) -> Path:
    folder = record(tmp_path_factory.mktemp("cell") / "scara")
    done = run("calibrate", folder, "--observable-rest", *QUICK)
    assert done.exit_code == 0, done.output
    (folder / "said.txt").write_text(done.stdout, encoding="utf-8")
    return folder


def result_of(folder: Path) -> dict:
    return json.loads((folder / "result" / "result.json").read_text(encoding="utf-8"))


def test_it_is_refused_by_name_and_told_what_to_do(scara, tmp_path):
    done = run("calibrate", scara, "--out", tmp_path / "none", *QUICK)
    assert done.exit_code == 2
    assert "the head's position along the common axis (0.00, 0.00, 1.00) of the flange" in done.stderr
    assert "--observable-rest" in done.stderr
    assert not (tmp_path / "none").exists()


def test_the_rest_is_right_and_the_unseen_is_null(scara):
    result = result_of(scara)
    head = result["head"]
    rows = head["T_flange_camera"]
    assert rows[2][3] is None and head["T_link5_camera"][2][3] is None
    found = np.array([[v if v is not None else np.nan for v in row] for row in rows])
    np.testing.assert_allclose(found[:3, :3], T_flange_head[:3, :3], atol=5e-4)
    np.testing.assert_allclose(found[:2, 3], T_flange_head[:2, 3], atol=2e-4)
    assert [name for name, value in head["paper"].items() if value is None] == ["z_m"]
    assert [name for name, value in head["dh"].items() if value is None] == ["d6_m"]
    assert [p["T_base_target"][2][3] for p in result["placements"]] == [None, None]
    assert result["unobserved"] == ["the head's position along the common axis (0.00, 0.00, 1.00) of the flange"]
    assert result["certificate"]["certified"]
    axes = np.array([p["axis"] for p in result["unobserved_motions"]["observed_position"]])
    np.testing.assert_allclose(np.abs(axes[:, 2]), 0.0, atol=1e-3)


def test_terminal_and_page_say_what_was_not_observed(scara):
    said = (scara / "said.txt").read_text(encoding="utf-8")
    assert "NOT OBSERVED  the head's position along the common axis (0.00, 0.00, 1.00) of the flange" in said
    assert "z not observed" in said and "d6 not observed" in said
    page = (scara / "result" / "report.html").read_text(encoding="utf-8")
    assert "<h2>Not observed</h2>" in page
    assert page.count("not observed") >= 6  # z, d6, both matrices, both placements
    assert "<h2>The cell</h2>" not in page


def test_a_length_that_does_not_depend_on_the_unseen_is_measured(scara):
    done = run("verify", scara, "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["after"]["max_abs_m"] < 1e-3


def test_a_length_that_depends_on_the_unseen_is_refused(scara, tmp_path):
    tilted = record(tmp_path / "tilted", tilt_rad=0.3)
    done = run("verify", tilted, "--result", scara / "result", "--arm", tilted / "scara.yaml")
    assert done.exit_code == 2
    assert "depend on what the calibration has not observed" in done.stderr


def test_one_joint_alone_leaves_the_orientation_unseen_and_nothing_to_measure_with(tmp_path):
    folder = record(tmp_path / "joint", moved=(0.0, 0.0, 0.0, 0.6))
    done = run("calibrate", folder, "--observable-rest", *QUICK)
    assert done.exit_code == 0, done.output
    result = result_of(folder)
    assert len(result["unobserved"]) == 2 and "orientation about (0.00, 0.00, 1.00)" in result["unobserved"][1]
    rows = result["head"]["T_flange_camera"]
    assert all(v is None for row in rows[:2] for v in row)
    np.testing.assert_allclose(np.array(rows[2][:3]), T_flange_head[2, :3], atol=1e-3)
    assert result["head"]["dh"]["alpha6_rad"] is not None and result["head"]["paper"]["gamma_rad"] is None
    refused = run("verify", folder)
    assert refused.exit_code == 2 and "has not observed" in refused.stderr
