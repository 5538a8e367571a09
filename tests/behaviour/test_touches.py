"""A ball in sockets: the arm comes back, wrong touches are named, and a gauge is read with an honest interval."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from data import DATA, real
from sixthlink.calibrate.touches import Touches, calibrate_arm, read_gauge, touches_of
from sixthlink.cli.main import main
from sixthlink.errors import TooFewShotsError
from sixthlink.files import arm_result_as_dict, arm_result_from_dict, write_recording
from sixthlink.progress import Silent
from sixthlink.recording import EYE_IN_HAND, Head, Recording
from sixthlink.robot import arm_with_values, flange_poses
from sixthlink.target import SOCKET, LengthStandard
from touching import LENGTH_M, TOOL_M, Touched, touched

sys.path.insert(0, str(Path(__file__).parents[2] / "examples"))
import recordings

COVERAGE = 1.959963984540054
NAMES = "ABCD"
GAUGE = LengthStandard(LENGTH_M, 1e-5, SOCKET, marks=("A", "B"))


def recorded(truth: Touched, *, standard: LengthStandard | None = GAUGE, verify_from: int = 1) -> Recording:
    """The touches as a recording: places from ``verify_from`` on are of kind verify."""
    n = len(truth.joints)
    return Recording(
        name="touched",
        mount=EYE_IN_HAND,
        robot="Panda",
        arm=truth.nominal,
        head=Head(()),
        target=None,
        standard=standard,
        ids=tuple(f"t{k}" for k in range(n)),
        placements=tuple(f"place {p}" for p in truth.places),
        kinds=tuple("calibrate" if p < verify_from else "verify" for p in truth.places),
        marks=tuple(NAMES[k] for k in truth.points),
        joints=truth.joints,
    )


def noisy(rng):
    """Joint errors that are new with every touch, as the Panda's file states them."""
    return lambda q, sockets: 1.2e-4 * rng.standard_normal(q.shape)


def smooth(rng):
    """Joint errors that follow the pose, five times as large as what is new with every touch."""

    def errors(q, sockets):
        alike = np.exp(-0.5 * np.sum((q[:, None] - q[None]) ** 2, axis=2) / 2.0**2) + 1e-9 * np.eye(len(q))
        root = np.linalg.cholesky(alike)
        return 6e-4 * root @ rng.standard_normal(q.shape) + 1.2e-4 * rng.standard_normal(q.shape)

    return errors


def ball_error_m(calibration, truth: Touched) -> float:
    """RMS error of distances between where the ball is at the touches' joints: free of the base's gauge."""
    q = truth.joints
    balls = []
    for arm, tool in ((calibration.arm, calibration.tool_m), (truth.true, TOOL_M)):
        Ts = flange_poses(arm, q)
        balls.append(Ts[:, :3, :3] @ tool + Ts[:, :3, 3])
    spans = [np.linalg.norm(b[:, None] - b[None], axis=2) for b in balls]
    return float(np.sqrt(np.mean((spans[0] - spans[1]) ** 2)))


def test_touches_bring_the_arm_back():
    truth = touched(np.random.default_rng(0), places=3, each=25, contact_m=1e-6)
    found = calibrate_arm(recorded(truth, verify_from=3), Silent())
    assert found.accepted
    assert found.rms_before_m > 1e-3
    assert found.rms_after_m < 5e-6
    assert ball_error_m(found, truth) < 1e-4


def test_the_gauge_is_read_where_it_was_never_told():
    rng = np.random.default_rng(1)
    recording = recorded(touched(rng, contact_m=3e-5, errors=noisy(rng)))
    found = calibrate_arm(recording, Silent())
    reading = read_gauge(found, touches_of(recording, "verify"), GAUGE, coverage=COVERAGE)
    assert abs(reading.after_m - LENGTH_M) < COVERAGE * reading.std_m < 4e-4
    assert abs(reading.before_m - LENGTH_M) > abs(reading.after_m - LENGTH_M)


def test_errors_that_follow_the_pose_widen_the_interval():
    """Averaging does not remove them, and the interval knows it."""
    stds, hits = {}, 0
    for kind in (noisy, smooth):
        stds[kind] = []
        for seed in range(4):
            rng = np.random.default_rng(seed)
            recording = recorded(touched(rng, contact_m=3e-5, errors=kind(rng)))
            found = calibrate_arm(recording, Silent())
            reading = read_gauge(found, touches_of(recording, "verify"), GAUGE, coverage=COVERAGE)
            stds[kind].append(reading.std_m)
            hits += abs(reading.after_m - LENGTH_M) < COVERAGE * reading.std_m
    assert np.median(stds[smooth]) > 1.2 * np.median(stds[noisy])
    assert hits >= 7  # of 8: fewer has a chance below 6 % at 95 % each


def test_wrong_touches_are_named_with_what_is_wrong():
    rng = np.random.default_rng(2)
    truth = touched(rng, each=25, contact_m=3e-5, errors=noisy(rng))
    points, joints = truth.points.copy(), truth.joints.copy()
    points[4] = 1 - points[4]
    joints[70, 3] += 0.01
    found = calibrate_arm(recorded(replace(truth, points=points, joints=joints), verify_from=2), Silent())
    reasons = {r.shot: r.reason for r in found.rejections}
    assert set(reasons) == {"t4", "t70"}
    assert "it fits socket 'A' of the same place; correct its mark" in reasons["t4"]
    assert "was the ball seated" in reasons["t70"]


def test_three_sockets_here_and_one_there_without_any_known_length():
    rng = np.random.default_rng(3)
    truth = touched(rng, points=3, contact_m=3e-5, errors=noisy(rng))
    keep = (truth.places == 0) | (truth.points == 2)
    part = replace(truth, joints=truth.joints[keep], places=truth.places[keep], points=truth.points[keep])
    found = calibrate_arm(recorded(part, standard=None, verify_from=2), Silent())
    assert found.standard is None
    assert [(p.placement, p.mark) for p in found.points] == [
        ("place 0", "A"),
        ("place 0", "B"),
        ("place 0", "C"),
        ("place 1", "C"),
    ]
    assert found.rms_after_m < 0.2 * found.rms_before_m


def test_a_single_socket_calibrates_without_scale():
    rng = np.random.default_rng(4)
    truth = touched(rng, places=1, points=1, each=40, contact_m=3e-5, errors=noisy(rng))
    found = calibrate_arm(recorded(truth, standard=None), Silent())
    assert found.rms_after_m < 0.2 * found.rms_before_m


def wrong_sign(truth: Touched) -> Touched:
    return replace(truth, joints=truth.joints * [1, 1, 1, 1, 1, 1, -1])


def wrong_link(truth: Touched) -> Touched:
    values = truth.nominal.values.copy()
    values[truth.nominal.parameters.index("d5")] += 0.03
    return replace(truth, nominal=arm_with_values(truth.nominal, values))


@pytest.mark.parametrize("wrong", [wrong_sign, wrong_link])
def test_a_wrong_robot_is_refused(wrong):
    """What the links cannot explain is not passed off as errors that follow the pose."""
    rng = np.random.default_rng(11)
    found = calibrate_arm(recorded(wrong(touched(rng, contact_m=3e-5, errors=noisy(rng)))), Silent())
    assert not found.accepted
    assert any("the joints scatter" in g.message and not g.passed for g in found.gates)


def test_too_few_touches_are_refused_in_words():
    truth = touched(np.random.default_rng(5), places=1, each=3)
    with pytest.raises(TooFewShotsError, match=r"6 calibrate touches of 2 sockets .* at least 7 are needed"):
        calibrate_arm(recorded(truth), Silent())


def test_a_result_reads_back_bit_for_bit():
    rng = np.random.default_rng(6)
    found = calibrate_arm(recorded(touched(rng, contact_m=3e-5, errors=noisy(rng))), Silent())
    data = json.loads(json.dumps(arm_result_as_dict(found)))
    assert json.loads(json.dumps(arm_result_as_dict(arm_result_from_dict(data)))) == data


def test_a_reading_needs_both_sockets_but_not_the_calibrations_gauge():
    """A calibration without scale reads any gauge, whatever its sockets are called."""
    rng = np.random.default_rng(7)
    truth = touched(rng, contact_m=3e-5, errors=noisy(rng))
    recording = recorded(truth, standard=None)
    found = calibrate_arm(recording, Silent())
    verify = touches_of(recording, "verify")
    other = Touches(verify.shots, verify.placements, tuple(f"new {m}" for m in verify.marks), verify.joints, None)
    gauge = replace(GAUGE, marks=("new A", "new B"))
    reading = read_gauge(found, other, gauge, coverage=COVERAGE)
    assert abs(reading.after_m - LENGTH_M) < COVERAGE * reading.std_m


def run(*arguments: str):
    return CliRunner().invoke(main, [*arguments])


def test_the_folder_speaks_the_same_from_end_to_end(tmp_path):
    rng = np.random.default_rng(8)
    truth = touched(rng, contact_m=3e-5, errors=noisy(rng))
    folder = tmp_path / "sockets"
    write_recording(folder, recorded(truth), robot={"name": "franka_panda"})
    done = run("calibrate", str(folder), "--holdout", "6", "--json")
    assert done.exit_code == 0, done.output
    result = json.loads(done.stdout)
    assert result["accepted"]
    assert result["heldout"]["shots"] == 6
    assert result["heldout"]["rms_translation_m"] < 1e-3
    assert {p["name"] for p in result["arm"]["parameters"]} >= {"alpha2", "d3"}
    assert {n["origin"] for n in result["joint"]["noise"]} >= {"joints", "contact", "socket", "pose"}
    page = Path(result["files"]["report"]).read_text(encoding="utf-8")
    assert "The arm, before and after" in page
    done = run("verify", str(folder), "--json")
    assert done.exit_code == 0, done.output
    check = json.loads(done.stdout)
    assert [p["name"] for p in check["placements"]] == ["place 1"]
    assert check["placements"][0]["inside_95"]
    assert "Verified on a gauge" in Path(check["files"]["report"]).read_text(encoding="utf-8")
    again = run("calibrate", str(folder), "--arm", result["files"]["arm"], "--out", str(tmp_path / "again"), "--json")
    assert again.exit_code == 0, again.output
    assert json.loads(again.stdout)["residuals"]["rms_before_m"] < 1e-3
    exact = run("verify", str(folder), "--arm", result["files"]["arm"], "--json")
    assert json.loads(exact.stdout)["placements"][0]["std_m"] is None


@pytest.mark.parametrize("command", [["compare"], ["calibrate", "--solve", "paper"]])
def test_what_is_for_heads_is_refused_in_words(command, tmp_path):
    write_recording(tmp_path, recorded(touched(np.random.default_rng(10))), robot={"name": "franka_panda"})
    done = run(command[0], str(tmp_path), *command[1:])
    assert done.exit_code == 2
    assert "touches have none" in done.output


def test_touches_that_calibrated_cannot_verify(tmp_path):
    rng = np.random.default_rng(9)
    recording = recorded(touched(rng, contact_m=3e-5, errors=noisy(rng)))
    write_recording(tmp_path, recording, robot={"name": "franka_panda"})
    assert run("calibrate", str(tmp_path), "--json").exit_code == 0
    table = tmp_path / "shots.csv"
    table.write_text(table.read_text(encoding="utf-8").replace(",calibrate,", ",verify,"), encoding="utf-8")
    done = run("verify", str(tmp_path), "--json")
    assert done.exit_code == 2
    assert "was used for the calibration" in done.stdout


@pytest.mark.parametrize(("robot", "place", "limit_m"), [("kuka_14", "front", 0.3e-3), ("panda_1", "front", 1.0e-3)])
def test_the_gauge_of_a_real_robot(robot, place, limit_m, tmp_path):
    """The two sockets are 50 mm apart: read at two places where the calibration has not been told so."""
    real("mukca_two_socket_50mm")
    folder = recordings.mukca(DATA, tmp_path, robot, place)
    done = run("calibrate", str(folder), "--json")
    assert done.exit_code == 0, done.output
    check = json.loads(run("verify", str(folder), "--json").stdout)
    assert len(check["placements"]) == 2
    for read in check["placements"]:
        assert abs(read["after_error_m"]) <= limit_m
        assert read["inside_95"]
