"""Arm and head together from a recording on disk: what the commands say, write and refuse."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from sixthlink.cli.main import main
from sixthlink.files import read_arm, read_result
from sixthlink.progress import Silent
from sixthlink.workflow import simulate_folder

COUNTS = {"calibrate": 50, "verify": 30, "scale": 60}


def run(*words: str) -> dict:
    done = CliRunner().invoke(main, [*words, "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("joint") / "cell"
    simulate_folder(folder, scenario="paper", seed=3, images=False, scale_placements=6, progress=Silent())
    return folder


@pytest.fixture(scope="module")
def result(cell) -> dict:
    return run("calibrate", str(cell))


def test_joint_is_the_default_and_brings_its_evidence(cell, result):
    assert result["solver"] == "joint"
    assert 0.7 < result["chi2_per_dof"] < 1.3
    assert set(result["head"]["std"]) == {
        f"{a}_{u}"
        for a, u in zip(
            ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z"), ("m",) * 3 + ("rad",) * 3, strict=True
        )
    }
    parameters = {p["name"]: p for p in result["arm"]["parameters"]}
    assert all(p["free"] or p["reason"] for p in parameters.values())
    assert not parameters["d6"]["free"]
    assert parameters["d6"]["value"] == parameters["d6"]["nominal"]
    assert result["budget"]["advice"]
    assert result["certificate"]["certified"]


def test_free_parameters_are_near_the_truth_they_stand_for(cell, result):
    """α of links 2 to 5 repeat nothing else, so that the truth is theirs."""
    truth = read_arm(cell / "truth" / "arm.yaml")
    value_of = dict(zip(truth.parameters, truth.values.tolist(), strict=True))
    for p in result["arm"]["parameters"]:
        if p["name"] in {"alpha3", "alpha4", "alpha5", "a3", "a4"}:
            assert abs(p["value"] - value_of[p["name"]]) < 5.0 * p["std"]


def test_lengths_come_with_an_uncertainty_that_holds_them(cell, result):
    check = run("verify", str(cell))
    stds = [p["std_m"] for p in check["placements"]]
    assert all(4e-5 < std < 2e-4 for std in stds)
    # Fifteen lengths at 95 %: fewer than eleven inside happen once in ten thousand recordings.
    assert sum(p["inside_95"] for p in check["placements"]) >= 11
    assert check["after"]["rms_m"] < 0.25 * check["before"]["rms_m"]


def test_the_calibrated_arm_is_an_arm_file_like_any_other(cell, result, tmp_path):
    arm = Path(result["files"]["arm"])
    again = run("calibrate", str(cell), "--solve", "paper", "--arm", str(arm), "--out", str(tmp_path / "again"))
    nominal = run("calibrate", str(cell), "--solve", "paper", "--out", str(tmp_path / "nominal"))
    assert again["residuals"]["rms_translation_m"] < 0.3 * nominal["residuals"]["rms_translation_m"]


def test_a_result_reads_back_bit_for_bit(result):
    once = read_result(Path(result["files"]["result"]))
    assert once.joint is not None
    assert once.joint.covariance.tolist() == result["joint"]["covariance"]
    assert once.arm is not None
    assert once.arm.values.tolist() == [s["value"] for s in result["arm"]["steps"]]


def test_held_out_shots_judge_and_are_not_used(cell, tmp_path):
    found = run("calibrate", str(cell), "--holdout", "10", "--out", str(tmp_path / "out"))
    assert found["heldout"]["shots"] == 10
    assert len(found["shots"]) == 40
    assert found["heldout"]["rms_translation_m"] < 3e-4
    refused = CliRunner().invoke(main, ["calibrate", str(cell), "--holdout", "48", "--out", str(tmp_path / "o")])
    assert refused.exit_code == 2
    assert "would leave a placement with fewer than 3" in refused.output


def rewritten(cell: Path, folder: Path, change) -> Path:
    shutil.copytree(cell, folder, ignore=shutil.ignore_patterns("result"))
    table = folder / "pixels.csv"
    lines = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join([lines[0], *(change(line) for line in lines[1:])]) + "\n", encoding="utf-8")
    return folder


def test_exchanged_shots_are_named_as_exchanged(cell, result, tmp_path):
    names = {"p2_03": "p2_07", "p2_07": "p2_03"}

    def exchange(line: str) -> str:
        shot, rest = line.split(",", 1)
        return f"{names.get(shot, shot)},{rest}"

    found = run("calibrate", str(rewritten(cell, tmp_path / "exchanged", exchange)))
    reasons = {r["shot"]: r["reason"] for r in found["rejected"]}
    assert set(reasons) == set(names)
    assert "exchanged with shot p2_07" in reasons["p2_03"]
    worth = np.linalg.norm(np.array(found["head"]["T_flange_camera"]) - np.array(result["head"]["T_flange_camera"]))
    assert worth < 5e-4


def test_a_late_robot_pose_is_named_as_late(cell, tmp_path):
    folder = tmp_path / "late"
    shutil.copytree(cell, folder, ignore=shutil.ignore_patterns("result"))
    table = folder / "shots.csv"
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    joints = [k for k, name in enumerate(head.split(",")) if name.startswith("q")]
    before, late = (next(k for k, r in enumerate(rows) if r.startswith(name)) for name in ("p3_04", "p3_05"))
    cells = rows[late].split(",")
    for k in joints:
        # The image was taken when the robot had reached its pose; the pose was read one shot too early.
        cells[k] = rows[before].split(",")[k]
    rows[late] = ",".join(cells)
    table.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    found = run("calibrate", str(folder))
    assert [r["shot"] for r in found["rejected"]] == ["p3_05"]
    reason = found["rejected"][0]["reason"]
    assert "its robot pose is that of shot p3_04; it was read before the robot had moved" in reason


def test_flange_poses_alone_cannot_show_the_arm(tmp_path):
    import sys

    sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
    import recordings
    from data import DATA, real

    real("moveit_eye_to_hand_poses")
    folder = recordings.moveit_eye_to_hand_poses(DATA, tmp_path)
    done = CliRunner().invoke(main, ["calibrate", str(folder), "--solve", "joint"])
    assert done.exit_code == 2
    assert "flange poses only" in done.output
    assert run("calibrate", str(folder))["solver"] == "paper"
