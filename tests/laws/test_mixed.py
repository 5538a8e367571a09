"""Correlated noise: the dense solver gives what textbooks give where they have a formula."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t

from sixthlink.calibrate.touches.components import CorrelatedRows, mixed_fit

COVERAGE = 1.959963984540054


def rows(X, y, patterns, white=None, right=None) -> CorrelatedRows:
    p = X.shape[1]
    return CorrelatedRows(
        X, -y, np.stack(patterns), np.zeros((0, p)) if white is None else white, np.zeros(0) if right is None else right
    )


def test_independent_noise_is_least_squares_with_students_interval():
    rng = np.random.default_rng(0)
    X, n, p = rng.standard_normal((30, 4)), 30, 4
    y = X @ [1.0, 2.0, 3.0, 4.0] + 0.3 * rng.standard_normal(n)
    found = mixed_fit(rows(X, y, [np.eye(n)]), np.array([1.0]))
    best, rss = np.linalg.lstsq(X, y)[:2]
    assert found.step == pytest.approx(best, abs=1e-8)
    assert found.variances[0] == pytest.approx(rss[0] / (n - p), rel=1e-3)
    covariance = np.linalg.inv(X.T @ X) * rss[0] / (n - p)
    assert found.covariance == pytest.approx(covariance, rel=2e-3)
    gradient = np.array([1.0, -1.0, 0.0, 0.0])
    assert found.variance_of(gradient)[1] == pytest.approx(n - p, rel=1e-3)
    half = found.std_of(gradient, coverage=COVERAGE) * COVERAGE
    assert half == pytest.approx(t.ppf(0.975, n - p) * np.sqrt(gradient @ covariance @ gradient), rel=2e-3)


def test_groups_that_err_alike_count_once():
    """Balanced groups: the analysis of variance, and for the mean one degree of freedom less than groups."""
    rng = np.random.default_rng(1)
    groups, each = 6, 10
    n = groups * each
    number = np.repeat(np.arange(groups), each)
    y = 5.0 + 2.0 * rng.standard_normal(groups)[number] + 0.5 * rng.standard_normal(n)
    alike = (number[:, None] == number[None]).astype(float)
    found = mixed_fit(rows(np.ones((n, 1)), y, [np.eye(n), alike]), np.array([1.0, 1.0]))
    means = y.reshape(groups, each).mean(axis=1)
    within = float(np.sum((y - means[number]) ** 2) / (n - groups))
    between = float(means.var(ddof=1))
    assert found.variances == pytest.approx([within, between - within / each], rel=2e-3)
    assert found.covariance[0, 0] == pytest.approx(between / groups, rel=2e-3)
    assert found.variance_of(np.ones(1))[1] == pytest.approx(groups - 1, rel=1e-2)


def test_a_part_that_is_not_there_vanishes():
    rng = np.random.default_rng(2)
    n, number = 60, np.repeat(np.arange(6), 10)
    alike = (number[:, None] == number[None]).astype(float)
    y = rng.standard_normal(n)
    y -= np.array([y[number == g].mean() for g in range(6)])[number]
    found = mixed_fit(rows(np.ones((n, 1)), y, [np.eye(n), alike]), np.array([1.0, 1.0]))
    assert found.variances[1] < 1e-5 * found.variances[0]


def test_known_rows_count_with_their_own_variance():
    X, y = np.ones((8, 1)), np.array([1.0, -1.0] * 4)
    found = mixed_fit(rows(X, y, [np.eye(8)], white=np.array([[1e3]]), right=np.array([-2e3])), np.array([1.0]))
    assert found.step[0] == pytest.approx(2.0, abs=1e-3)
