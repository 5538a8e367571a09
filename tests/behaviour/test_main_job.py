"""The main job on a simulated cell: from a folder to a proven head, and what happens when the folder is wrong."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from sixthlink.cli.main import main


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """The paper's cell as noisy pixels, calibrated with the true arm."""
    folder = tmp_path_factory.mktemp("paper") / "cell"
    assert run("simulate", folder, "--no-images", "--seed", 3, "--json").exit_code == 0
    assert run("calibrate", folder, "--arm", folder / "truth" / "arm.yaml", "--json").exit_code == 0
    return folder


@pytest.fixture(scope="module")
def images(tmp_path_factory) -> Path:
    """A small rendered cell."""
    folder = tmp_path_factory.mktemp("small") / "cell"
    assert run("simulate", folder, "--scenario", "small", "--seed", 1, "--json").exit_code == 0
    return folder


@pytest.fixture
def broken(images, tmp_path) -> Path:
    """A copy of the small rendered cell to break."""
    return Path(shutil.copytree(images, tmp_path / "cell", ignore=shutil.ignore_patterns("result")))


def result_of(folder: Path) -> dict:
    return json.loads((folder / "result" / "result.json").read_text(encoding="utf-8"))


def test_the_true_arm_reaches_the_repeatability_floor(cell):
    check = json.loads(run("verify", cell, "--json").stdout)
    assert check["after"]["rms_m"] < 0.15e-3
    assert check["before"]["rms_m"] > 5 * check["after"]["rms_m"]
    assert len(check["placements"]) == check["after"]["count"] == 15
    errors = np.array([p["after_m"] for p in check["placements"]]) - check["standard"]["length_m"]
    assert check["after"]["mean_m"] == pytest.approx(errors.mean())
    assert check["after"]["mean_abs_m"] == pytest.approx(np.abs(errors).mean())
    assert check["after"]["rms_m"] == pytest.approx(np.sqrt(np.mean(errors**2)))
    assert check["after"]["std_m"] == pytest.approx(np.std(errors, ddof=1))
    assert check["after"]["max_abs_m"] == pytest.approx(np.abs(errors).max())


def test_the_head_is_where_the_simulator_put_it(cell):
    truth = json.loads((cell / "truth" / "truth.json").read_text(encoding="utf-8"))
    result = result_of(cell)
    found, true = np.array(result["head"]["T_flange_camera"]), np.array(truth["T_flange_head"])
    assert np.linalg.norm(found[:3, 3] - true[:3, 3]) < 0.3e-3
    assert set(result["head"]["dh"]) >= {"theta6_rad", "d6_m", "a6_m", "alpha6_rad", "phi_gamma_rad", "L_m"}


def test_a_result_reads_back_bit_for_bit(cell, tmp_path):
    from sixthlink.files import read_result, write_result

    path = cell / "result" / "result.json"
    write_result(tmp_path / "again.json", read_result(path))
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_the_same_seed_gives_the_same_result(cell, tmp_path):
    arm = cell / "truth" / "arm.yaml"
    for name in ("one", "two"):
        assert run("calibrate", cell, "--arm", arm, "--out", tmp_path / name, "--json").exit_code == 0
    heads = [
        json.loads((tmp_path / name / "result.json").read_text(encoding="utf-8"))["head"]["T_flange_camera"]
        for name in ("one", "two")
    ]
    # BLAS rounds by where arrays lie in memory, and iterations stop a little apart; the search itself is repeatable.
    np.testing.assert_allclose(heads[0], heads[1], rtol=0.0, atol=1e-9)


def test_json_is_one_object_and_nothing_else(cell):
    done = run("calibrate", cell, "--out", cell / "json", "--json")
    assert set(json.loads(done.stdout)) >= {"head", "objective", "residuals", "shots", "files"}
    assert done.stderr == ""


def test_images_become_a_head_and_a_page_without_outside_requests(images):
    assert run("calibrate", images, "--arm", images / "truth" / "arm.yaml", "--json").exit_code == 0
    check = json.loads(run("verify", images, "--json").stdout)
    assert check["after"]["rms_m"] < 0.4e-3
    page = (images / "result" / "report.html").read_text(encoding="utf-8")
    assert "data:image/" in page
    assert 'src="http' not in page


def test_shots_of_the_calibration_cannot_judge_it(images, broken):
    run("calibrate", broken, "--json")
    table = (broken / "shots.csv").read_text(encoding="utf-8")
    lines = table.splitlines()
    header = lines[0].split(",")
    kind, mark = header.index("kind"), header.index("mark")
    first = lines[1].split(",")
    first[kind], first[mark] = "verify", "A"
    (broken / "shots.csv").write_text("\n".join([lines[0], ",".join(first), *lines[2:]]) + "\n", encoding="utf-8")
    done = run("verify", broken)
    assert done.exit_code == 2
    assert "was used for the calibration" in done.stderr


def test_a_recording_that_only_verifies_needs_no_calibrate_shots(cell, tmp_path):
    folder = Path(shutil.copytree(cell, tmp_path / "cell", ignore=shutil.ignore_patterns("result", "json")))
    for name in ("shots.csv", "pixels.csv"):
        lines = (folder / name).read_text(encoding="utf-8").splitlines()
        kept = [lines[0], *(line for line in lines[1:] if not line.startswith("p"))]
        (folder / name).write_text("\n".join(kept) + "\n", encoding="utf-8")
    done = run("verify", folder, "--result", cell / "result", "--json")
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["after"]["rms_m"] < 0.15e-3


def test_an_image_that_cannot_be_read_or_shows_no_target_is_a_named_rejection(broken):
    names = sorted((broken / "images").glob("p1_*_right.png"))
    names[0].write_bytes(b"no picture")
    shutil.copy(next((broken / "images").glob("r1_A_right.png")), names[1])
    done = run("calibrate", broken, "--json")
    assert done.exit_code == 0
    rejected = {(r["shot"], r["camera"]): r["reason"] for r in json.loads(done.stdout)["rejected"]}
    assert (names[0].name.removesuffix("_right.png"), "right") in rejected
    assert (names[1].name.removesuffix("_right.png"), "right") in rejected
    assert all(rejected.values())


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("units: {length: mm, angle: deg}", "units: {length: mm}", "angle"),
        ("name: abb_irb1400", "name: abb_irb14000", "abb_irb1400"),
        ("kind: chessboard", "kind: chesboard", "chessboard"),
        ("mount: eye-in-hand", "mount: hand", "eye-in-hand"),
    ],
)
def test_a_wrong_description_is_a_finding_and_nothing_is_written(broken, old, new, words):
    path = broken / "recording.yaml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    done = run("calibrate", broken)
    assert done.exit_code == 2
    assert "recording.yaml:" in done.stderr
    assert words in done.stderr
    assert not (broken / "result").exists()


def test_a_missing_joint_column_and_a_missing_image_are_found_together(broken):
    table = (broken / "shots.csv").read_text(encoding="utf-8").replace(",q6,", ",q7,")
    (broken / "shots.csv").write_text(table, encoding="utf-8")
    next((broken / "images").glob("p2_*_left.png")).unlink()
    done = run("calibrate", broken, "--json")
    assert done.exit_code == 2
    findings = json.loads(done.stdout)["findings"]
    assert any("q6" in f["field"] + f["what"] + f["expected"] for f in findings)
    assert any("_left.png" in f["what"] + f["field"] for f in findings)


def test_fewer_than_three_usable_shots_are_refused_with_the_reasons(broken):
    for image in (broken / "images").glob("p*_right.png"):
        if image.name not in {"p1_01_right.png", "p1_02_right.png"}:
            image.write_bytes(b"")
    done = run("calibrate", broken)
    assert done.exit_code == 2
    assert "three" in done.stderr or "3" in done.stderr
    assert not (broken / "result").exists()


def test_a_failed_calibration_leaves_the_old_result_alone(broken):
    assert run("calibrate", broken, "--json").exit_code == 0
    before = (broken / "result" / "result.json").read_bytes()
    (broken / "recording.yaml").write_text("units: {length: mm", encoding="utf-8")
    assert run("calibrate", broken).exit_code == 2
    assert (broken / "result" / "result.json").read_bytes() == before


def test_a_limit_on_the_ruler_decides_the_exit_code(cell):
    assert run("verify", cell, "--limit-mm", 1.0, "--json").exit_code == 0
    assert run("verify", cell, "--limit-mm", 0.001, "--json").exit_code == 1


def test_simulating_into_a_recording_is_refused(images):
    assert run("simulate", images, "--no-images").exit_code == 2


def test_an_unknown_scenario_names_the_known_ones(tmp_path):
    done = run("simulate", tmp_path / "x", "--scenario", "moon")
    assert done.exit_code == 2
    assert "paper" in done.stderr
