"""Reference points tell whether the tracker stood still between the sweeps."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.calibrate.tracker import drift_findings, tracker_motion
from sixthlink.geometry import Floats, exp_rotation, transform_points
from sweeps import NOISE_M

FLOOR = np.array([[2.0, -1.0, 0.0], [3.0, 1.5, 0.1], [-1.0, 2.0, 0.3], [-2.0, -2.0, 0.0]])


def measured(rng: np.random.Generator, sweep_shifts: Floats, points: int) -> list[dict[str, Floats]]:
    return [
        {f"ref{k + 1}": FLOOR[k] + shift + NOISE_M * rng.normal(size=3) for k in range(points)}
        for shift in sweep_shifts
    ]


NAMES = [f"sweep{k}" for k in range(1, 7)]


@pytest.mark.parametrize("points", [1, 2, 4])
def test_a_shift_between_two_sweeps_is_named_once_where_it_happened(points):
    """F48: 0.2 mm."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        shifts = np.zeros((6, 3))
        shifts[3:, 1] = 2e-4
        (finding,) = drift_findings(NAMES, measured(rng, shifts, points), NOISE_M)
        assert finding.grave
        assert finding.kind == "tracker moved"
        assert "between sweeps sweep3 and sweep4" in finding.words
        assert finding.figures["shift_m"] == pytest.approx(2e-4, abs=1e-4)


@pytest.mark.parametrize(("points", "noise_m"), [(1, NOISE_M), (2, NOISE_M), (4, NOISE_M), (4, None)])
def test_a_tracker_that_stood_still_is_not_blamed(points, noise_m):
    blamed = 0
    for seed in range(250):
        rng = np.random.default_rng(seed)
        blamed += len(drift_findings(NAMES[:3], measured(rng, np.zeros((3, 3)), points), noise_m))
    assert blamed <= 2


def test_a_slow_drift_is_found_once_it_has_grown_out_of_the_noise():
    rng = np.random.default_rng(1)
    creep = np.arange(12)[:, None] * np.array([1.5e-5, 0.0, 0.0])
    names = [str(k) for k in range(12)]
    assert drift_findings(names, measured(rng, creep, 4), NOISE_M)
    assert drift_findings(names[:2], measured(rng, creep[:2], 4), NOISE_M) == ()


def test_shift_and_turn_come_back_with_their_uncertainty():
    turn, shift = np.array([2e-4, -1e-4, 3e-4]), np.array([1e-4, 2e-4, -1e-4])
    middle = FLOOR.mean(axis=0)
    exact = (FLOOR - middle) @ exp_rotation(turn).T + middle + shift
    motion = tracker_motion(FLOOR, exact, NOISE_M)
    assert np.abs(motion.shift_m - shift).max() < 1e-12
    assert np.abs(motion.turn_rad - turn).max() < 1e-12
    assert np.abs(transform_points(motion.T_before_after, exact) - FLOOR).max() < 1e-12
    squares = 0.0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        before, after = (p + NOISE_M * rng.normal(size=p.shape) for p in (FLOOR, exact))
        motion = tracker_motion(before, after, NOISE_M)
        off = np.r_[motion.shift_m - shift, motion.turn_rad - turn]
        squares += off @ np.linalg.solve(motion.covariance, off)
    assert squares / 300 == pytest.approx(6.0, rel=0.1)


def test_points_show_only_the_turns_that_they_can():
    along = FLOOR[1] - FLOOR[0]
    spun = (FLOOR[:2] - FLOOR[0]) @ exp_rotation(0.1 * along / np.linalg.norm(along)).T + FLOOR[0]
    assert tracker_motion(FLOOR[:2], spun, NOISE_M).chance > 0.9
    assert [tracker_motion(FLOOR[:k], FLOOR[:k], NOISE_M).seen_turns for k in (1, 2, 3)] == [0, 2, 3]
    for k in (1, 2):
        turned = tracker_motion(FLOOR[:k], FLOOR[:k] @ exp_rotation(np.array([0.0, 0.0, 1e-3])).T, NOISE_M)
        assert turned.chance < 1e-6


def test_drift_that_could_not_be_checked_is_said():
    (finding,) = drift_findings(["a", "b"], [{}, {}])
    assert not finding.grave
    assert finding.kind == "drift not checked"
    (finding,) = drift_findings(["a", "b"], [{"ref": FLOOR[0]}, {"ref": FLOOR[0]}])
    assert "noise is not known" in finding.words
    assert drift_findings(["a"], [{}]) == ()
    with pytest.raises(ValueError, match="too few"):
        tracker_motion(FLOOR[:2], FLOOR[:2])
