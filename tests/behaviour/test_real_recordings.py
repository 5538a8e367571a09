"""Real robots: the scatter of the target is no worse than that of the best known closed form on the same data."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from data import DATA, real

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
import recordings
from sixthlink.cli.main import main

DEGREE = 0.017453292519943295

PARK = {
    "denso_tabb_ds1": (9.9e-3, 0.61 * DEGREE),
    "rosi_charuco_static_camera": (2.0e-3, 0.20 * DEGREE),
    "fr3_joint_camera": (8.0e-3, 0.59 * DEGREE),
    "moveit_eye_to_hand_poses": (4.6e-3, 0.09 * DEGREE),
}
"""RMS scatter of Park's closed form, from the READMEs of the data [m, rad]."""


@pytest.mark.parametrize("name", PARK)
def test_scatter_is_no_worse_than_parks(name, tmp_path):
    real(name)
    folder = getattr(recordings, name)(DATA, tmp_path)
    done = CliRunner().invoke(main, ["calibrate", str(folder), "--solve", "paper", "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    translation_m, rotation_rad = PARK[name]
    assert result["residuals"]["rms_translation_m"] <= translation_m
    assert result["residuals"]["rms_rotation_rad"] <= rotation_rad
    assert len(result["shots"]) >= 9
    assert result["rejected"] == []


def test_rendered_images_give_the_head_that_they_were_rendered_with(tmp_path):
    """OpenCV's closed forms on the same images are 0.03 to 0.14 mm from the truth."""
    truth = np.linalg.inv(np.loadtxt(real("rendered_flat_board") / "truth" / "flange2cam.txt"))
    done = CliRunner().invoke(main, ["calibrate", str(recordings.rendered_flat_board(DATA, tmp_path)), "--json"])
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    head = np.array(result["head"]["T_flange_camera"])
    print(f"head {1e3 * np.linalg.norm(head[:3, 3] - truth[:3, 3]):.3f} mm from the truth")
    assert np.linalg.norm(head[:3, 3] - truth[:3, 3]) < 0.05e-3
    assert len(result["shots"]) == 13


def test_arm_and_head_together_predict_the_poses_that_they_have_not_seen(tmp_path):
    """Franka FR3: the first 76 poses calibrate, the last 38 judge; the head alone leaves 8.0 mm and 0.62°."""
    real("fr3_joint_camera")
    folder = recordings.fr3_joint_camera(DATA, tmp_path)
    table = folder / "shots.csv"
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    rows = [row if k < 76 else row.replace(",calibrate,", ",judge,", 1) for k, row in enumerate(rows)]
    table.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    result = json.loads(CliRunner().invoke(main, ["calibrate", str(folder), "--json"]).stdout)
    assert result["solver"] == "joint"
    assert result["heldout"]["shots"] == 38
    assert result["heldout"]["rms_translation_m"] <= 1.22e-3
    assert result["heldout"]["rms_rotation_rad"] <= 0.27 * DEGREE


def test_the_robot_keeps_the_principal_point_of_a_weak_camera_near_the_middle(tmp_path):
    real("denso_tabb_ds1")
    folder = recordings.denso_tabb_ds1(DATA, tmp_path)
    result = json.loads(CliRunner().invoke(main, ["calibrate", str(folder), "--json"]).stdout)
    camera = result["cameras"][0]
    assert abs(camera["centre_px"][0] - 320) < 15
    assert abs(camera["centre_px"][1] - 240) < 15
    assert 1058 < camera["focal_px"][0] < 1120
