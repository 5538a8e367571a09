"""A simulated cell obeys the same laws as the calibrator's models, and is what its scenario says."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sixthlink.camera import pixels_from_points
from sixthlink.files.arm_file import load_arm
from sixthlink.geometry import inverse, motion_between, transform_points
from sixthlink.recording import shots_of_kind
from sixthlink.robot import flange_poses, last_link, transform_from_paper_numbers
from sixthlink.simulate import SCENARIOS, simulate_cell
from sixthlink.simulate import placements as placement_module
from sixthlink.simulate.kinematics import chain_of_arm, chain_poses
from sixthlink.simulate.manufacture import built_arm
from sixthlink.simulate.scenario import stream
from sixthlink.target import Chessboard

PAPER = SCENARIOS["paper"]
IRB_1400 = load_arm("abb_irb1400", folder=Path())
BOARD = Chessboard(12, 9, 0.02)


@pytest.fixture(scope="module")
def cells():
    return [simulate_cell(PAPER, IRB_1400, BOARD, seed=seed, images=False) for seed in range(20)]


def marks(cell):
    return np.array([[0.0, 0.0, 0.0], [cell.truth.standard_length_m, 0.0, 0.0]])


def test_pixels_agree_with_the_calibrators_own_models(cells):
    cell = cells[0]
    truth, table = cell.truth, cell.truth.pixels
    Ts_base_head = flange_poses(truth.arm, truth.joints) @ truth.T_flange_head
    for row in range(0, len(table), 7):
        shot, camera, point = table.shots[row], table.cameras[row], table.points[row]
        points_target = marks(cell) if cell.recording.marks[shot] else truth.points_m
        T_base_target = truth.Ts_base_placement[cell.recording.placements[shot]]
        T_camera_target = truth.rig.Ts_camera_head[camera] @ inverse(Ts_base_head[shot]) @ T_base_target
        point_camera = transform_points(T_camera_target, points_target[point])
        pixel = pixels_from_points(truth.rig.cameras[camera], point_camera)
        assert np.abs(pixel - table.pixels[row]).max() < 1e-6


def test_flange_agrees_with_the_calibrators_forward_kinematics(cells):
    for cell in cells[:3]:
        by_products = chain_poses(chain_of_arm(cell.truth.arm), cell.truth.joints)
        assert np.abs(by_products - flange_poses(cell.truth.arm, cell.truth.joints)).max() < 1e-12


def test_the_recording_is_the_papers(cells):
    recording = cells[0].recording
    assert [len(shots_of_kind(recording, kind)) for kind in ("calibrate", "verify", "scale")] == [50, 30, 0]
    assert recording.ids[:2] == ("p1_01", "p1_02")
    assert recording.ids[50:53] == ("r1_A", "r1_B", "r2_A")
    assert [recording.marks[i] for i in (0, 50, 51)] == ["", "A", "B"]
    assert recording.inputs == {}
    assert all(c.camera is None and c.T_camera_head is None for c in recording.head.cameras)
    drawing = last_link(IRB_1400) @ recording.head.nominal
    assert np.abs(drawing - transform_from_paper_numbers(PAPER.head)).max() < 1e-15
    board_rows = np.count_nonzero(recording.pixels.shots < 50)
    assert (board_rows, len(recording.pixels)) == (50 * 2 * 108, 50 * 2 * 108 + 30 * 2)


def test_everything_is_reached_and_seen_for_any_seed(cells):
    for cell in cells:
        joints = cell.recording.joints
        assert (joints > IRB_1400.limits[:, 0]).all()
        assert (joints < IRB_1400.limits[:, 1]).all()
        pixels = cell.truth.pixels.pixels
        assert pixels.min() > PAPER.margin_px
        assert (pixels < np.array([PAPER.width_px, PAPER.height_px]) - 1 - PAPER.margin_px).all()


def test_marks_are_seen_from_in_front_near_the_middle(cells):
    for cell in cells:
        truth, recording = cell.truth, cell.recording
        Ts_base_head = flange_poses(truth.arm, truth.joints) @ truth.T_flange_head
        for shot in shots_of_kind(recording, "verify"):
            T_head_ruler = inverse(Ts_base_head[shot]) @ truth.Ts_base_placement[recording.placements[shot]]
            for camera, T_camera_head in enumerate(truth.rig.Ts_camera_head):
                assert (T_camera_head @ T_head_ruler)[2, 2] > np.cos(np.deg2rad(26.0))
                seen = (truth.pixels.shots == shot) & (truth.pixels.cameras == camera)
                off = truth.pixels.pixels[seen] - [PAPER.width_px / 2, PAPER.height_px / 2]
                assert np.abs(off).max() < 0.25 * PAPER.height_px


def test_views_and_placements_are_diverse(cells):
    for cell in cells:
        truth, recording = cell.truth, cell.recording
        boards = shots_of_kind(recording, "calibrate")
        Ts_base_head = flange_poses(truth.arm, truth.joints) @ truth.T_flange_head
        Ts_base_board = np.stack([truth.Ts_base_placement[recording.placements[i]] for i in boards])
        Ts_head_board = inverse(Ts_base_head[boards]) @ Ts_base_board
        tilts = np.rad2deg(np.arccos(Ts_head_board[:, 2, 2]))
        rolls = np.angle(Ts_head_board[:, 0, 0] + 1j * Ts_head_board[:, 1, 0])
        assert tilts.max() > 25.0
        assert tilts.max() < 37.0
        assert abs(np.exp(1j * rolls).mean()) < 0.5  # rolls go all around, not just to and fro
        azimuths = np.rad2deg(np.arctan2(Ts_base_board[:, 1, 3], Ts_base_board[:, 0, 3]))
        assert np.ptp(azimuths) > 45.0
        lying = np.rad2deg(np.arccos(-Ts_base_board[:, 2, 2]))
        assert lying.min() < 20.0
        assert lying.max() > 30.0
        rulers = [T for name, T in truth.Ts_base_placement.items() if name.startswith("r")]
        elevations = np.rad2deg(np.arcsin(np.abs([T[2, 0] for T in rulers])))
        assert elevations.min() < 20.0
        assert elevations.max() > 55.0


def test_errors_are_as_large_as_the_scenario_says(cells):
    joint_errors = np.concatenate([c.truth.joints - c.recording.joints for c in cells])
    pixel_errors = np.concatenate([c.recording.pixels.pixels - c.truth.pixels.pixels for c in cells])
    print_errors = np.concatenate([(c.truth.points_m - BOARD.points_m)[:, :2] for c in cells])
    for errors, sigma in ((joint_errors, 50e-6), (pixel_errors, 0.05), (print_errors, 5e-6)):
        assert errors.std() == pytest.approx(sigma, rel=0.05)
        assert abs(errors.mean()) < 4.0 * sigma / np.sqrt(errors.size)
    heads = np.stack([motion_between(c.recording.head.nominal, c.truth.T_flange_head) for c in cells])
    assert (np.linalg.norm(heads[:, 3:], axis=1) <= np.deg2rad(0.3) + 1e-12).all()
    assert np.linalg.norm(heads[:, 3:], axis=1).max() > np.deg2rad(0.1)


def test_every_link_parameter_is_disturbed_but_one_that_has_no_meaning():
    errors = np.array([built_arm(PAPER, IRB_1400, stream(s, "arm")).values - IRB_1400.values for s in range(400)])
    for name, turn, sigma in zip(IRB_1400.parameters, IRB_1400.turns, errors.std(axis=0), strict=True):
        expected = 0.0 if name == "d2" else np.deg2rad(0.03) if turn else 0.5e-3
        assert sigma == pytest.approx(expected, rel=0.15), name


def test_the_same_seed_gives_the_same_cell_and_scale_bars_disturb_nothing(cells):
    again = simulate_cell(PAPER, IRB_1400, BOARD, seed=3, scale_placements=4)
    recording, truth = again.recording, again.truth
    N = len(cells[3].recording.ids)
    assert recording.kinds[N:] == ("scale",) * 40
    assert recording.ids[N : N + 2] == ("s1_A1", "s1_A2")
    assert recording.images["left"][3] == "images/p1_04_left.png"
    assert np.array_equal(recording.joints[:N], cells[3].recording.joints)
    assert np.array_equal(truth.joints[:N], cells[3].truth.joints)
    old = truth.pixels.shots < N
    assert np.array_equal(truth.pixels.pixels[old], cells[3].truth.pixels.pixels)
    rulers = [T for name, T in truth.Ts_base_placement.items() if name[0] in "rs"]
    distances = [np.linalg.norm(a[:3, 3] - b[:3, 3]) for i, a in enumerate(rulers) for b in rulers[:i]]
    assert min(distances) > 1e-3
    assert not np.array_equal(truth.arm.values, cells[4].truth.arm.values)


def test_a_cell_survives_pickling(cells):
    copy = pickle.loads(pickle.dumps(cells[1]))
    assert np.array_equal(copy.truth.pixels.pixels, cells[1].truth.pixels.pixels)
    assert copy.recording.ids == cells[1].recording.ids


def test_an_arm_without_dh_parameters_is_refused():
    steps = replace(IRB_1400, dialect="steps", parameters=tuple(f"step_{k}" for k in range(len(IRB_1400.kinds))))
    with pytest.raises(ValueError, match="without any DH parameter to disturb; simulate an arm whose"):
        simulate_cell(PAPER, steps, BOARD, seed=0)


def test_another_target_than_the_scenarios_is_refused():
    with pytest.raises(ValueError, match=r"target has 8 x 5 corners .* 12 x 9 of 0.02 m; change one"):
        simulate_cell(PAPER, IRB_1400, Chessboard(8, 5, 0.02), seed=0)


def test_an_arm_that_is_too_small_is_told_so(monkeypatch):
    monkeypatch.setattr(placement_module, "ATTEMPTS", 3)
    tiny = replace(IRB_1400, values=np.where(IRB_1400.turns, 1.0, 0.2) * IRB_1400.values)
    with pytest.raises(ValueError, match="reaches no placement of the chessboard in scenario 'paper'"):
        simulate_cell(PAPER, tiny, BOARD, seed=0)
