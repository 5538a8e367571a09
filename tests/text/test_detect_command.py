"""What `sixthlink detect` says, and that it does not look twice at the same image."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner, Result

from sixthlink.cli.main import main


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("seen") / "cell"
    assert run("simulate", folder, "--scenario", "small", "--seed", 4, "--json").exit_code == 0
    return folder


def told(*arguments: object) -> dict:
    return json.loads(run("detect", *arguments, "--json").stdout)


def test_every_image_is_counted_and_timed(cell):
    seen = told(cell, "--no-cache")
    assert seen["images"] == seen["found"] == 44
    assert seen["rejected"] == []
    assert seen["recalled"] == 0
    assert 0.0 < seen["decode_s"] <= seen["total_s"]
    assert [c["name"] for c in seen["cameras"]] == ["right", "left"]
    for camera in seen["cameras"]:
        assert camera["calibrated"]
        assert 0.0 < camera["std"]["fx"] < 1e-3 * camera["lens"]["fx"]
        assert 0.5 < camera["rms_px"] / camera["sigma_px"] < 2.0


def test_a_second_look_is_not_needed(cell):
    first, second = told(cell), told(cell)
    assert second["recalled"] == second["images"]
    assert second["decode_s"] == 0.0
    assert second["points"] == first["points"]
    for before, after in zip(first["cameras"], second["cameras"], strict=True):
        assert after["lens"] == pytest.approx(before["lens"], rel=1e-5)


def test_a_changed_image_is_looked_at_again(cell, tmp_path):
    copy = Path(shutil.copytree(cell, tmp_path / "cell"))
    told(copy)
    image = copy / "images" / "p1_01_left.png"
    cv2.imwrite(str(image), np.full_like(cv2.imread(str(image), cv2.IMREAD_UNCHANGED), 90))
    answer = run("detect", copy, "--json")
    seen = json.loads(answer.stdout)
    assert answer.exit_code == 1
    assert seen["recalled"] == seen["images"] - 1
    (refused,) = seen["rejected"]
    assert refused["image"] == "images/p1_01_left.png"
    assert "no chessboard of 12 x 9 inner corners found" in refused["reason"]
    assert "rejected  images/p1_01_left.png: no chessboard" in run("detect", copy).output


def test_a_changed_target_is_looked_for_again(cell, tmp_path):
    copy = Path(shutil.copytree(cell, tmp_path / "cell"))
    told(copy)
    text = (copy / "recording.yaml").read_text(encoding="utf-8").replace("columns: 12", "columns: 11")
    (copy / "recording.yaml").write_text(text, encoding="utf-8")
    seen = told(copy)
    assert len(seen["rejected"]) == 36
    assert seen["recalled"] == 8
    assert seen["cameras_reason"]


def test_pixels_are_written_where_asked(cell, tmp_path):
    answer = run("detect", cell, "--out", tmp_path / "out")
    assert answer.exit_code == 0
    assert (tmp_path / "out" / "detections.csv").is_file()
    assert "44 of 44 images show what they should" in answer.output
    assert "focal length" in answer.output
