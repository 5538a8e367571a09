"""What `sixthlink arm`, `compensate` and `calibrate --tracker` say, to people and to programs."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from sixthlink.cli.main import main
from sixthlink.files import load_arm, read_arm, write_tracker_record
from sixthlink.geometry import ORIENTATIONS, values_from_rotations
from sixthlink.robot import flange_poses
from tracking import rows_of, session


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """The paper's cell as noisy pixels, with a tracker's record whose arm is calibrated."""
    folder = tmp_path_factory.mktemp("tracked") / "cell"
    assert run("simulate", folder, "--no-images", "--tracker", "--seed", 2, "--json").exit_code == 0
    return folder


@pytest.fixture(scope="module")
def told(cell) -> dict:
    answer = run("arm", cell / "tracker", "--json")
    assert answer.exit_code == 0, answer.output
    return json.loads(answer.stdout)


def test_the_result_has_what_other_programs_look_for(told):
    assert told["accepted"]
    assert [a["joint"] for a in told["axes"]] == [f"q{j}" for j in range(1, 7)]
    assert all(np.linalg.norm(a["direction"]) == pytest.approx(1.0) for a in told["axes"])
    assert {(c["joint"], c["reflector"]) for c in told["circles"]} == {
        (j, "L2" if j == 2 else "R1") for j in range(1, 7)
    }
    assert all(0.0 < c["radial_rms_m"] < 1e-4 and 0.0 < c["plane_rms_m"] < 1e-4 for c in told["circles"])
    assert told["coupling"]["joint"] == 3
    assert told["coupling"]["driver"] == 2
    assert abs(told["coupling"]["factor"] + 1.0) < 1e-4
    assert told["train"]["rms_m"] < told["heldout"]["rms_m"] < told["heldout"]["max_m"] < 0.4e-3
    assert told["heldout"]["before_rms_m"] > 4 * told["heldout"]["rms_m"]
    assert {"name", "unit", "nominal", "value", "std", "free", "reason"} <= set(told["parameters"][0])
    assert told["findings"] == []
    assert Path(told["files"]["arm"]).is_file()


def test_the_terminal_names_every_number_with_its_unit(cell):
    answer = run("arm", cell / "tracker", "--out", cell / "again")
    assert answer.exit_code == 0
    for words in ("held-out error", "mm RMS nominal", "± mrad", "coupling q3_q2", "on link 6", "theta2", "wrote"):
        assert words in answer.output


def test_the_arm_file_is_taken_by_the_other_commands(cell, told):
    """The paper's chain: tracker, arm, head by eq. (11), ruler."""
    out = cell / "chain"
    answer = run("calibrate", cell, "--arm", told["files"]["arm"], "--solve", "paper", "--out", out, "--json")
    assert answer.exit_code == 0, answer.output
    check = json.loads(run("verify", cell, "--result", out, "--json").stdout)
    assert check["after"]["rms_m"] < 0.15e-3
    assert check["before"]["rms_m"] > 1e-3


def test_images_and_tracker_are_one_problem(cell, told):
    answer = run("calibrate", cell, "--tracker", cell / "tracker", "--json")
    assert answer.exit_code == 0, answer.output
    both = json.loads(answer.stdout)
    assert both["tracker_points"] == 270
    alone = json.loads(run("calibrate", cell, "--out", cell / "alone", "--json").stdout)
    stds = [{p["name"]: p["std"] for p in result["arm"]["parameters"]} for result in (both, alone)]
    assert all(stds[0][name] < 0.5 * stds[1][name] for name in ("a1", "a2", "d4", "alpha3"))
    check = json.loads(run("verify", cell, "--json").stdout)
    assert check["after"]["rms_m"] < 0.15e-3


def test_a_tracker_and_eq_11_exclude_each_other(cell):
    answer = run("calibrate", cell, "--tracker", cell / "tracker", "--solve", "paper")
    assert answer.exit_code == 2
    assert "leave out --solve paper" in answer.output


def test_a_record_of_another_robot_is_refused(cell):
    answer = run("arm", cell / "tracker", "--arm", "franka_fr3")
    assert answer.exit_code == 2
    assert "Franka" in answer.output
    assert "7 joints, expected 6" in answer.output


def test_what_a_gate_refuses_leaves_with_1_and_is_said(tmp_path):
    record = rows_of(session(stops=15, free_points=0).record, np.arange(15))
    write_tracker_record(tmp_path / "one", record, robot={"name": "abb_irb1400"})
    answer = run("arm", tmp_path / "one")
    assert answer.exit_code == 1
    assert "REFUSED  reflectors are seen: R1: where it sits on link 6 is not seen along" in answer.output
    assert (tmp_path / "one" / "result" / "report.html").is_file()


def test_init_writes_a_record_that_reads(tmp_path):
    answer = run("init", tmp_path / "mine", "--tracker")
    assert answer.exit_code == 0
    assert "then: sixthlink arm" in answer.output
    refused = run("arm", tmp_path / "mine")
    assert refused.exit_code == 2
    assert "6 points with all their joint values recorded say hardly more" in refused.output


def table(path: Path, rows: list[list[object]]) -> Path:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)
    return path


HEADER = ["name", *(f"q{j}_deg" for j in range(1, 7))]


def test_corrected_targets_bring_the_calibrated_arm_there(told, tmp_path):
    targets = table(tmp_path / "program.csv", [HEADER, ["p1", 10, 20, -30, 40, 50, 60], ["p2", 0, 0, 0, 0, 30, 0]])
    out = tmp_path / "corrected.csv"
    options = ("--arm", told["files"]["arm"], "--nominal", "abb_irb1400", "--out", out)
    answer = run("compensate", targets, *options, "--json")
    assert answer.exit_code == 0, answer.output
    said = json.loads(answer.stdout)
    assert said["before_max_m"] > 1e-4
    assert said["after_max_m"] < 1e-9
    with out.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    q = np.deg2rad([[float(r[f"q{j}_deg"]) for j in range(1, 7)] for r in rows])
    programmed = np.deg2rad([[10, 20, -30, 40, 50, 60], [0, 0, 0, 0, 30, 0]])
    wanted = flange_poses(load_arm("abb_irb1400", folder=tmp_path), programmed)
    assert flange_poses(read_arm(Path(told["files"]["arm"])), q) == pytest.approx(wanted, abs=1e-9)
    assert "2 targets corrected" in run("compensate", targets, *options).output


def test_poses_may_stand_beside_the_joints(told, tmp_path):
    arm = load_arm("abb_irb1400", folder=tmp_path)
    q = np.deg2rad([10.0, 20.0, -30.0, 40.0, 50.0, 60.0])
    T = flange_poses(arm, q[None])[0]
    fields = ORIENTATIONS["quaternion-wxyz"].fields
    turn = values_from_rotations(ORIENTATIONS["quaternion-wxyz"], T[None, :3, :3])[0].tolist()
    rows = [
        [*HEADER, "x_mm", "y_mm", "z_mm", *fields],
        ["p", 10, 20, -30, 40, 50, 60, *(T[:3, 3] * 1e3).tolist(), *turn],
    ]
    targets = table(tmp_path / "poses.csv", rows)
    out = tmp_path / "out.csv"
    answer = run("compensate", targets, "--arm", told["files"]["arm"], "--orientation", "quaternion-wxyz", "--out", out)
    assert answer.exit_code == 0, answer.output


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([["name", "q1_deg"], ["p", 1]], "q2_deg: the column is missing"),
        ([HEADER, ["p", 1, 2, "x", 4, 5, 6]], "is 'x', expected a finite number"),
        ([HEADER], "there are none, expected one row per target"),
        ([HEADER, ["far", 0, 69.99, 69.99, 0, 30, 299.99]], "far: needs a joint beyond its limit"),
    ],
)
def test_bad_targets_are_named_and_nothing_is_written(told, tmp_path, rows, words):
    targets, out = table(tmp_path / "bad.csv", rows), tmp_path / "out.csv"
    options = ("--arm", told["files"]["arm"], "--nominal", "abb_irb1400", "--out", out)
    answer = run("compensate", targets, *options)
    assert answer.exit_code == 2
    assert words in answer.output
    assert not out.exists()


def test_the_nominal_arm_must_be_said(told, tmp_path):
    targets = table(tmp_path / "program.csv", [HEADER, ["p1", 10, 20, -30, 40, 50, 60]])
    answer = run("compensate", targets, "--arm", told["files"]["arm"], "--out", tmp_path / "out.csv")
    assert answer.exit_code == 2
    assert "--nominal: nominal: is missing" in answer.output
