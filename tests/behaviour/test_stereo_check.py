"""A stereo head whose cameras have moved since they were calibrated is told from its images alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sixthlink.calibrate import calibrate_rig, stereo_checks
from sixthlink.calibrate.stereo_check import stereo_gates
from sixthlink.files import load_arm
from sixthlink.geometry import exp_rotation, transform
from sixthlink.recording import Recording, selected
from sixthlink.simulate import SCENARIOS, simulate_cell
from sixthlink.target import Chessboard


@pytest.fixture(scope="module")
def cell():
    board = Chessboard(12, 9, 0.02)
    return simulate_cell(SCENARIOS["paper"], load_arm("abb_irb1400", folder=Path()), board, seed=1, images=False)


def given(cell, turn_rad=(0.0, 0.0, 0.0), shift_m=(0.0, 0.0, 0.0)) -> Recording:
    """The recording with its cameras given as they truly are, but for a motion of the second."""
    rig, head = cell.truth.rig, cell.recording.head
    moved = transform(exp_rotation(np.array(turn_rad)), np.array(shift_m)) @ rig.Ts_camera_head[1]
    cameras = (
        replace(head.cameras[0], camera=rig.cameras[0]),
        replace(head.cameras[1], camera=rig.cameras[1], T_camera_head=moved),
    )
    return replace(cell.recording, head=replace(head, cameras=cameras))


def checked(recording: Recording, shots: int = 50):
    seen = recording.pixels
    boards = np.isin(seen.shots, [i for i, kind in enumerate(recording.kinds) if kind == "calibrate"][:shots])
    (check,) = stereo_checks(recording, selected(seen, boards))
    return check


def test_a_good_calibration_is_left_alone(cell):
    check = checked(given(cell))
    assert not check.stale
    assert check.epipolar_rms_px == pytest.approx(0.05 * np.sqrt(2.0), rel=0.1)
    assert check.systematic_px < 0.02
    assert abs(check.scale - 1.0) < 4.0 * check.scale_std


@pytest.mark.parametrize("shots", [1, 50])
@pytest.mark.parametrize(("axis", "least_px"), [(0, 0.4), (2, 0.2)], ids=["pitch", "roll"])
def test_a_camera_that_turned_by_a_hundredth_of_a_degree_is_stale(cell, axis, least_px, shots):
    turn = np.zeros(3)
    turn[axis] = np.deg2rad(0.01 if axis == 0 else 0.05)
    check = checked(given(cell, turn), shots)
    assert check.stale
    assert check.systematic_px > least_px
    assert "calibrate the head again" in check.words


def test_a_changed_baseline_shows_in_the_boards_size(cell):
    """A shift along the baseline leaves every point on its line; only the size of the board tells."""
    baseline = cell.truth.rig.Ts_camera_head[1][:3, 3]
    check = checked(given(cell, shift_m=0.005 * baseline))
    assert check.systematic_px < 0.01
    assert check.stale
    assert "or the size of the board is declared wrong by +0.50 %" in check.words
    assert not checked(given(cell, shift_m=0.001 * baseline)).stale
    assert check.scale == pytest.approx(1.005, abs=5e-4)
    assert check.length_m == pytest.approx(1.005 * check.declared_m, rel=5e-4)


def test_a_stale_calibration_is_not_accepted(cell):
    moved = given(cell, (np.deg2rad(0.05), 0.0, 0.0))
    for recording, passed in ((given(cell), True), (moved, False)):
        cameras = calibrate_rig(recording, recording.pixels)
        (gate,) = stereo_gates(recording, cameras)
        assert gate.passed == passed
        assert ("stale" in gate.message) != passed


def test_without_given_cameras_there_is_nothing_to_check(cell):
    assert stereo_checks(cell.recording, cell.recording.pixels) == ()
