"""A misprinted target: the corners are found where they are, and the lenses are believed no more than they deserve."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sixthlink.calibrate import calibrate_rig
from sixthlink.camera import lens_vector
from sixthlink.files import load_arm
from sixthlink.simulate import SCENARIOS, SimulatedCell, simulate_cell
from sixthlink.target import Chessboard

BOARD = Chessboard(columns=12, rows=9, square_m=0.02)


@cache
def cell(print_sigma_m: float, seed: int) -> SimulatedCell:
    plan = replace(SCENARIOS["paper"], placements=3, ruler_placements=0, print_sigma_m=print_sigma_m)
    return simulate_cell(plan, load_arm("abb_irb1400", folder=Path()), BOARD, seed=seed, images=False)


def without_similarity(errors_m: np.ndarray, points_m: np.ndarray) -> np.ndarray:
    """What is left of ``(P, 2)`` errors when shift, turn and scale are taken off: no image can show those."""
    p = points_m[:, :2] - points_m[:, :2].mean(axis=0)
    e = (errors_m[:, :2] - errors_m[:, :2].mean(axis=0)).T.ravel()
    similar = np.concatenate([np.column_stack([p[:, 0], -p[:, 1]]), np.column_stack([p[:, 1], p[:, 0]])])
    return e - similar @ np.linalg.lstsq(similar, e)[0]


def test_misprinted_corners_are_found():
    drawn = cell(5e-6, 0)
    found = calibrate_rig(drawn.recording, drawn.recording.pixels)
    before = without_similarity(BOARD.points_m - drawn.truth.points_m, BOARD.points_m)
    after = without_similarity(found.points_m - drawn.truth.points_m, BOARD.points_m)
    # 108 corners: the sample's own spread is known to 7 %.
    assert found.print_sigma_m == pytest.approx(5e-6, rel=0.2)
    assert np.std(after) < 0.25 * np.std(before)
    assert found.noise_px == pytest.approx(0.05, rel=0.02)


def test_a_perfect_print_raises_no_alarm():
    sigmas = [calibrate_rig(c.recording, c.recording.pixels).print_sigma_m for c in (cell(0.0, s) for s in range(6))]
    assert max(sigmas) < 1e-6
    assert np.count_nonzero(sigmas) <= 1


def test_lenses_are_believed_as_far_as_they_deserve():
    squares = []
    for seed in range(6):
        drawn = cell(5e-6, seed)
        found = calibrate_rig(drawn.recording, drawn.recording.pixels)
        std = np.sqrt(np.diag(found.covariance))
        errors = np.concatenate([lens_vector(c) for c in found.rig.cameras])
        errors -= np.concatenate([lens_vector(c) for c in drawn.truth.rig.cameras])
        errors = errors[found.unknowns.lens.ravel()]
        squares.append(np.mean((errors / std[: len(errors)]) ** 2))
    # Without the corners as unknowns the mean square is about 8; six recordings of some ten independent numbers each.
    assert np.mean(squares) == pytest.approx(1.0, abs=1.0)
