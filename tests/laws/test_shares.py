"""Do the shots say truly whether robot or head is the better witness, and is the head better for it?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sixthlink.calibrate.head.closed_form import CLOSED_FORMS
from sixthlink.calibrate.head.loops import Loops, head_loops, head_with_rotation
from sixthlink.calibrate.head.placement_sums import without_nuisance
from sixthlink.calibrate.head.shares import HeadShares
from sixthlink.geometry import Floats, apply_motion, exp_rotation, inverse, transform

TURN_RAD = np.deg2rad(0.3)
SHIFT_M = 1e-4


def _exact(seed: int, shots: int, placements: int = 1) -> tuple[Floats, Floats, Floats, np.ndarray]:
    rng = np.random.default_rng(seed)
    X = transform(exp_rotation(rng.normal(size=3)), 0.3 * np.array([0.6, -0.5, 0.6]))
    turns = exp_rotation(rng.uniform(-0.5, 0.5, (shots, 3))) @ np.diag([1.0, -1.0, -1.0])
    B = transform(turns, rng.uniform([-0.1, -0.1, 0.4], [0.1, 0.1, 0.8], (shots, 3)))
    where = np.arange(shots) % placements
    Z = transform(exp_rotation(rng.normal(size=(placements, 3))), rng.uniform(-1, 1, (placements, 3)))
    return X, Z[where] @ inverse(B) @ inverse(X), B, where


def _noisy(rng: np.random.Generator, Ts: Floats, turn_rad: float) -> Floats:
    return apply_motion(Ts, rng.normal(size=(len(Ts), 6)) * np.repeat([SHIFT_M, turn_rad], 3))


def _loops(seed: int, shots: int, robot_rad: float, head_rad: float, placements: int = 1) -> tuple[Floats, Loops]:
    X, A, B, where = _exact(seed, shots, placements)
    rng = np.random.default_rng(seed + 1)
    return X, head_loops(_noisy(rng, A, robot_rad), _noisy(rng, B, head_rad), where)


@pytest.mark.parametrize("placements", [1, 3])
@pytest.mark.parametrize("robot, head", [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.5), (0.3, 0.9)])
def test_share_is_the_robots_part_of_the_variance(robot: float, head: float, placements: int) -> None:
    loops = _loops(1, 600, robot * TURN_RAD, head * TURN_RAD, placements)[1]
    assert loops.shares.sight == pytest.approx(robot**2 / (robot**2 + head**2), abs=0.1)


def test_head_that_errs_about_its_own_origin_moves_the_target() -> None:
    """Its word is then right for the sight, which it moved, and wrong for its own mount."""
    _, A, B, where = _exact(2, 600)
    noise = exp_rotation(TURN_RAD * np.random.default_rng(0).normal(size=(600, 3)))
    shares = head_loops(A, transform(noise, np.zeros(3)) @ B, where).shares
    assert shares.sight > 0.95
    assert shares.mount < 0.05


def test_exact_shots_trust_both_alike() -> None:
    _, A, B, where = _exact(3, 12, 2)
    assert head_loops(A, B, where).shares == HeadShares(0.5, 0.5)


@pytest.mark.parametrize("scale", [1e3, 1e-3])
def test_unit_of_length_and_base_frame_do_not_matter(scale: float) -> None:
    _, A, B, where = _exact(4, 9)
    rng = np.random.default_rng(5)
    A, B = _noisy(rng, A, TURN_RAD), _noisy(rng, B, TURN_RAD)
    shares = head_loops(A, B, where).shares
    A = transform(exp_rotation(np.array([0.3, 2.0, -1.0])), [2.0, -1.0, 0.5]) @ A
    A[:, :3, 3] *= scale
    B[:, :3, 3] *= scale
    moved = head_loops(A, B, where).shares
    assert (moved.sight, moved.mount) == pytest.approx((shares.sight, shares.mount), abs=1e-7)


@pytest.mark.parametrize("robot, head, gain", [(1.0, 0.0, 0.9), (0.0, 1.0, 0.9), (1.0, 1.0, 1.02)])
def test_asking_the_shots_beats_trusting_both_alike(robot: float, head: float, gain: float) -> None:
    """Translation errors over 150 heads: a tenth and more is gained, and where both are alike next to nothing lost."""
    asked, halfway = [], []
    for seed in range(150):
        X, loops = _loops(10 * seed, 15, robot * TURN_RAD, head * TURN_RAD)
        both = replace(loops, shares=HeadShares(0.5, 0.5))
        for errors, form in ((asked, loops), (halfway, both)):
            errors.append(np.linalg.norm((head_with_rotation(form, loops.rotation_head) - X)[:3, 3]))
    assert np.mean(asked) < gain * np.mean(halfway)


@pytest.mark.parametrize("method", ["andreff", "daniilidis", "li"])
def test_shifts_help_the_rotation_whoever_errs(method: str) -> None:
    """The methods with shifts in the system are better at the rotation than those without, for either noise."""
    for robot, head in ((1.0, 0.0), (0.0, 1.0)):
        errors: dict[str, list[float]] = {method: [], "horaud": []}
        for seed in range(40):
            X, A, B, where = _exact(7 * seed, 15)
            rng = np.random.default_rng(seed)
            shots = _noisy(rng, A, robot * TURN_RAD), _noisy(rng, B, head * TURN_RAD), where
            for name, found in errors.items():
                found.append(float(np.linalg.norm((CLOSED_FORMS[name](*shots) - X)[:3, :3])))
        assert np.mean(errors[method]) < np.mean(errors["horaud"])


def test_nuisance_takes_its_best_value() -> None:
    """The rows that are left give the literal least squares with an unknown block per placement."""
    rng = np.random.default_rng(6)
    where = np.array([0, 0, 1, 1, 1, 2, 2])
    rows, x = rng.normal(size=(7, 4, 5)), rng.normal(size=3)
    left = without_nuisance(rows, where, 2) @ x
    literal = 0.0
    for p in range(3):
        own = rows[where == p].reshape(-1, 5)
        right = -own[:, 2:] @ x
        literal += float(np.sum((own[:, :2] @ np.linalg.lstsq(own[:, :2], right)[0] - right) ** 2))
    assert left @ left == pytest.approx(literal, rel=1e-12)
