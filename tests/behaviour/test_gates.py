"""Recordings that are wrong in a way that no single shot shows: refused with the reason, never accepted."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from data import DATA, real

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
import recordings
from sixthlink.cli.main import main
from sixthlink.progress import Silent
from sixthlink.workflow import simulate_folder

Rows = list[list[str]]


def changed(folder: Path, change: Callable[[list[str], Rows], Rows]) -> Path:
    table = folder / "shots.csv"
    head, *rows = (line.split(",") for line in table.read_text(encoding="utf-8").splitlines())
    table.write_text("\n".join(",".join(row) for row in [head, *change(head, rows)]) + "\n", encoding="utf-8")
    return folder


def refusals(folder: Path, *options: str) -> dict[str, str]:
    done = CliRunner().invoke(main, ["calibrate", str(folder), "--json", *options])
    assert done.exit_code in {0, 1}, done.output
    result = json.loads(done.stdout)
    assert (done.exit_code == 0) == result["accepted"]
    return {g["name"]: g["message"] for g in result["gates"] if not g["passed"]}


def columns_from_the_row_before(names: str):
    def change(head: list[str], rows: Rows) -> Rows:
        places = [k for k, name in enumerate(head) if name in names.split()]
        return [[rows[i - 1][k] if k in places else cell for k, cell in enumerate(row)] for i, row in enumerate(rows)]

    return change


@pytest.mark.parametrize("joints", ["q1 q2 q3 q4 q5 q6 q7", "q6"])
def test_joints_shifted_by_a_row(tmp_path, joints):
    real("fr3_joint_camera")
    folder = changed(recordings.fr3_joint_camera(DATA, tmp_path), columns_from_the_row_before(joints))
    assert "look for rows shifted against each other" in refusals(folder)["the shots agree"]


def test_a_wrong_unit_of_length(tmp_path):
    real("fr3_joint_camera")
    folder = recordings.fr3_joint_camera(DATA, tmp_path)
    description = folder / "recording.yaml"
    text = description.read_text(encoding="utf-8")
    description.write_text(text.replace("units: {length: mm", "units: {length: m"), encoding="utf-8")
    assert "a wrong unit of length" in refusals(folder)["the shots agree"]


def test_one_flange_pose_of_another_shot_is_named_where_nothing_is_rejected(tmp_path):
    real("moveit_eye_to_hand_poses")

    def change(head: list[str], rows: Rows) -> Rows:
        places = [head.index(name) for name in "xyz"]
        rows[3] = [rows[20][k] if k in places else cell for k, cell in enumerate(rows[3])]
        return rows

    folder = changed(recordings.moveit_eye_to_hand_poses(DATA, tmp_path), change)
    name = folder.joinpath("shots.csv").read_text(encoding="utf-8").splitlines()[4].split(",")[0]
    assert f": {name} (" in refusals(folder)["no shot contradicts the others"]


def test_shots_that_were_learnt_by_heart(tmp_path):
    real("fr3_joint_camera")

    def change(head: list[str], rows: Rows) -> Rows:
        kind = head.index("kind")
        return [[*row[:kind], "calibrate" if i < 6 else "judge", *row[kind + 1 :]] for i, row in enumerate(rows)]

    folder = changed(recordings.fr3_joint_camera(DATA, tmp_path), change)
    assert "times as much as the fitted ones" in refusals(folder)["unseen shots agree"]


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gates") / "cell"
    simulate_folder(folder, scenario="paper", seed=4, images=False, scale_placements=6, progress=Silent())
    return folder


def test_a_certificate_with_a_typing_error(cell):
    assert refusals(cell) == {}
    description = cell / "recording.yaml"
    right = description.read_text(encoding="utf-8")
    assert "1234.15" in right
    description.write_text(right.replace("1234.15", "1230.15"), encoding="utf-8")
    wrong = refusals(cell)
    description.write_text(right, encoding="utf-8")
    assert (
        "the standard's certified length, the target's size or a unit is wrong" in wrong["scale bars and target agree"]
    )


def test_scale_bars_that_were_used_cannot_verify(cell):
    refusals(cell)
    table = cell / "shots.csv"
    right = table.read_text(encoding="utf-8")
    table.write_text(right.replace(",scale,", ",verify,"), encoding="utf-8")
    done = CliRunner().invoke(main, ["verify", str(cell)])
    table.write_text(right, encoding="utf-8")
    assert done.exit_code == 2
    assert "shot s1_A1: was used for the calibration" in done.output


def test_an_arm_of_an_earlier_estimate_does_not_stay_beside_another_result(cell):
    refusals(cell)
    assert (cell / "result" / "arm.yaml").is_file()
    refusals(cell, "--solve", "paper", "--iterations", "50")
    assert not (cell / "result" / "arm.yaml").exists()
