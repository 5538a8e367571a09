"""What a recording says of the board itself: bent or declared too large, and neither by chance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sixthlink.calibrate import SolveOptions, calibrate_head, calibrate_jointly, calibrate_rig
from sixthlink.files import load_arm
from sixthlink.progress import Silent
from sixthlink.recording import Recording
from sixthlink.simulate import SCENARIOS, simulate_cell
from sixthlink.target import Chessboard

BOARD = Chessboard(12, 9, 0.02)


def recorded(seed: int = 0, **changes) -> Recording:
    scenario = replace(SCENARIOS["paper"], **changes)
    return simulate_cell(scenario, load_arm("abb_irb1400", folder=Path()), BOARD, seed=seed, images=False).recording


def resized(recording: Recording, factor: float) -> Recording:
    """The same pixels, with the squares declared larger by a factor."""
    return replace(recording, target=replace(BOARD, square_m=factor * BOARD.square_m))


def judged(recording: Recording, solve):
    return solve(recording, calibrate_rig(recording, recording.pixels), SolveOptions(), Silent())


def size_gate(calibration):
    (gate,) = (g for g in calibration.gates if g.name == "board as large as declared")
    return gate


@pytest.mark.parametrize("sag_m", [0.05e-3, 0.3e-3, 1e-3])
def test_a_bent_board_is_measured(sag_m):
    recording = recorded(board_sag_m=sag_m)
    found = calibrate_rig(recording, recording.pixels)
    assert found.shape is not None
    assert abs(found.shape.sag_m - sag_m) < 4.0 * found.shape.sag_std_m + 0.05 * sag_m
    assert np.ptp(found.points_m[:, 2]) == pytest.approx(found.shape.sag_m)
    assert found.noise_px == pytest.approx(0.05, rel=0.03)


@pytest.mark.parametrize("seed", range(6))
def test_a_flat_board_is_not_called_bent(seed):
    recording = recorded(seed)
    assert calibrate_rig(recording, recording.pixels).shape is None


def test_with_its_bend_known_the_lens_is_right_again():
    """0.3 mm bends the focal length by many of its standard deviations unless it is known."""
    straight, bent = recorded(), recorded(board_sag_m=0.3e-3)
    wanted = calibrate_rig(straight, straight.pixels).rig.cameras[0].focal_px
    known, taken = (calibrate_rig(bent, bent.pixels, flat=flat).rig.cameras[0].focal_px for flat in (False, True))
    assert np.abs(known - wanted).max() < 0.2 * np.abs(taken - wanted).max()


@pytest.mark.parametrize("factor", [0.98, 1.02])
@pytest.mark.parametrize("solve", [calibrate_jointly, calibrate_head], ids=["joint", "head alone"])
def test_squares_declared_two_per_cent_wrong_are_noticed(solve, factor):
    calibration = judged(resized(recorded(), factor), solve)
    assert not size_gate(calibration).passed
    assert calibration.board.scale == pytest.approx(1.0 / factor, abs=0.006)
    assert "measure its squares" in size_gate(calibration).message


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("solve", [calibrate_jointly, calibrate_head], ids=["joint", "head alone"])
def test_right_squares_raise_no_alarm(solve, seed):
    calibration = judged(recorded(seed), solve)
    assert size_gate(calibration).passed
    assert abs(calibration.board.scale - 1.0) < 5.0 * calibration.board.scale_std


@pytest.mark.parametrize("seed", range(6))
def test_a_weak_geometry_raises_no_alarm(seed):
    """Five shots of one placement under an arm that is off: the size is hardly seen, and so nothing is claimed."""
    recording = recorded(seed, placements=1, poses=5)
    calibration = judged(recording, calibrate_head)
    assert size_gate(calibration).passed
