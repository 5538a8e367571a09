"""One pose per mark: the marks with their certified distance say about the scale exactly what the length alone says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from problems import random_transforms
from sixthlink.calibrate.arm import link_parameters
from sixthlink.calibrate.observations import (
    Columns,
    JointState,
    KnownLengths,
    MarkSightings,
    SocketDistances,
    whitened,
)
from sixthlink.files import load_arm
from sixthlink.geometry import transform_points
from sixthlink.robot import flange_poses
from sixthlink.solvers import reduced

SCALES = {"joints": 1.0, "pixels": 1.0, "standard": 1.0}


def test_marks_and_length_carry_the_same_information():
    rng = np.random.default_rng(0)
    arm = load_arm("abb_irb1400", folder=Path())
    X, n = random_transforms(rng, 1, 0.3)[0], 6
    q = rng.uniform(*arm.limits.T, (n, 6))
    points_head = rng.normal(0, 0.3, (n, 3))
    covariances = np.tile(np.diag([1e-10, 2e-10, 9e-10]), (n, 1, 1))
    places, marks = np.repeat([0, 1, 2], 2), np.tile([0, 1], 3)
    repeatability = np.full(6, 5e-5)
    standing = transform_points(flange_poses(arm, q) @ X, points_head).reshape(3, 2, 3)
    state = JointState(arm, X=X, marks_m=standing, arm_step=np.zeros(len(link_parameters(arm))))
    columns = Columns(arm=link_parameters(arm))
    seen = MarkSightings(q, points_head, covariances, places, marks, repeatability)
    # A distance is known for each place by itself, so that the three of them may differ.
    lengths_m = np.linalg.norm(standing[:, 1] - standing[:, 0], axis=1)
    prior = np.column_stack([np.eye(columns.size), np.zeros(columns.size)])
    for k in range(3):
        certified = SocketDistances(np.array([0]), float(lengths_m[k]), 1e-5, block="marks")
        rows = places == k
        one = MarkSightings(q[rows], points_head[rows], covariances[rows], 0 * places[rows], marks[rows], repeatability)
        at = JointState(arm, X=X, marks_m=standing[k : k + 1], arm_step=state.arm_step)
        by_marks = reduced([[whitened(o.linearised(at, columns), SCALES) for o in (one, certified)]], prior).factor
        alone = KnownLengths(
            q[rows],
            points_head[rows],
            covariances[rows],
            0 * places[rows],
            marks[rows],
            float(lengths_m[k]),
            1e-5,
            repeatability,
        )
        by_length = reduced([[whitened(alone.linearised(at, columns), SCALES)]], prior).factor
        assert by_marks.T @ by_marks == pytest.approx(by_length.T @ by_length, rel=1e-6, abs=1e-3)
    assert seen.linearised(state, columns).residuals == pytest.approx(0.0, abs=1e-12)
