"""Motions that cannot show the whole head: refused by name, and good ones never."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import noisy, random_transforms
from sixthlink.calibrate.head import HeadProblem, observability
from sixthlink.errors import TooFewShotsError

SIGMA_M, SIGMA_RAD = 5e-5, np.deg2rad(0.02)


def turns(kind: str, rng: np.random.Generator, shots: int) -> np.ndarray:
    """Rotation vectors of the flange about its first pose [rad]."""
    axis = Rotation.random(random_state=rng).as_matrix()[0]
    return {
        "good": rng.normal(0.0, 1.0, (shots, 3)) * rng.uniform(0.15, 0.8),
        "pure translation": np.zeros((shots, 3)),
        "identical": np.zeros((shots, 3)),
        "parallel axes": rng.uniform(-1.0, 1.0, (shots, 1)) * rng.uniform(0.3, 2.0) * axis,
        "too little rotation": rng.normal(0.0, 1.0, (shots, 3)) * np.deg2rad(rng.uniform(0.0, 0.7)),
    }[kind]


def recorded(kind: str, rng: np.random.Generator) -> HeadProblem:
    shots = int(rng.integers(5, 40))
    outer = np.tile(random_transforms(rng, 1)[0], (shots, 1, 1))
    outer[:, :3, :3] = Rotation.from_rotvec(turns(kind, rng, shots)).as_matrix() @ outer[:, :3, :3]
    if kind != "identical":
        outer[:, :3, 3] = np.array([0.8, 0.0, 0.8]) + rng.uniform(-0.4, 0.4, (shots, 3))
    X, target = random_transforms(rng, 2, 0.3)
    inner = noisy(rng, np.linalg.inv(outer @ X) @ target, SIGMA_M, SIGMA_RAD)
    return HeadProblem(noisy(rng, outer, SIGMA_M, SIGMA_RAD), inner, np.zeros(shots, dtype=int))


def words(problem: HeadProblem) -> tuple[str, ...]:
    return observability(problem, carrier="flange").words


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("pure translation", "position in the flange frame, all three"),
        ("identical", "orientation in the flange frame, all three"),
        ("parallel axes", "along the common axis"),
        ("too little rotation", "position"),
    ],
)
def test_degenerate_sets_are_named(kind, expected):
    rng = np.random.default_rng(0)
    for _ in range(200):
        assert any(expected in sentence for sentence in words(recorded(kind, rng)))


def test_good_sets_are_not_refused():
    rng = np.random.default_rng(1)
    assert sum(bool(words(recorded("good", rng))) for _ in range(400)) <= 2


def test_the_named_axis_is_the_common_axis():
    rng = np.random.default_rng(2)
    shots = 12
    outer = np.tile(np.eye(4), (shots, 1, 1))
    outer[:, :3, :3] = Rotation.from_rotvec(rng.uniform(-1, 1, (shots, 1)) * [0.0, 0.0, 1.0]).as_matrix()
    outer[:, :3, 3] = rng.uniform(-0.4, 0.4, (shots, 3))
    X, target = random_transforms(rng, 2, 0.3)
    problem = HeadProblem(outer, np.linalg.inv(outer @ X) @ target, np.zeros(shots, dtype=int))
    assert words(problem) == ("the head's position along the common axis (0.00, 0.00, 1.00) of the flange",)


def test_two_shots_of_one_placement_are_too_few():
    rng = np.random.default_rng(3)
    Ts = random_transforms(rng, 2)
    with pytest.raises(TooFewShotsError, match="at least 3"):
        HeadProblem(Ts, Ts, np.zeros(2, dtype=int))
