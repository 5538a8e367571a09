"""Eliminating blocks one by one is the same least squares as all unknowns at once."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.solvers import Equations, covariance_of_own, own_steps, reduced


def system(rng: np.random.Generator, *, blocks: int = 4, own: int = 3, shared: int = 5, rows: int = 60):
    block = np.concatenate([np.arange(blocks), rng.integers(0, blocks, rows - blocks)]).repeat(own + 1)
    M = len(block)
    equations = Equations(rng.normal(size=M), rng.normal(size=(M, shared)), rng.normal(size=(M, own)), block)
    dense = np.zeros((M, shared + blocks * own))
    dense[:, :shared] = equations.shared
    for b in range(blocks):
        dense[block == b, shared + own * b : shared + own * (b + 1)] = equations.own[block == b]
    return equations, dense


@pytest.mark.parametrize("own", [1, 3, 6])
def test_steps_and_covariances_are_those_of_the_dense_problem(own):
    rng = np.random.default_rng(own)
    equations, dense = system(rng, own=own)
    small = reduced([[equations]])
    step = -np.linalg.solve(small.factor, small.right)
    expected, cost, _, _ = np.linalg.lstsq(dense, -equations.residuals)
    assert step == pytest.approx(expected[:5], abs=1e-10)
    assert own_steps(small.own[0], step).ravel() == pytest.approx(expected[5:], abs=1e-10)
    assert small.unexplained == pytest.approx(cost[0], rel=1e-10)
    whole = np.linalg.inv(dense.T @ dense)
    shared = np.linalg.inv(small.factor.T @ small.factor)
    of_own, crossed = covariance_of_own(small.own[0], shared)
    assert shared == pytest.approx(whole[:5, :5], rel=1e-8)
    for b in range(4):
        at = slice(5 + own * b, 5 + own * (b + 1))
        assert of_own[b] == pytest.approx(whole[at, at], rel=1e-7)
        assert crossed[b] == pytest.approx(whole[at, :5], rel=1e-6, abs=1e-9)


def test_sets_add_up_and_parts_of_a_set_share_their_blocks():
    rng = np.random.default_rng(7)
    first, dense_first = system(rng, own=2)
    second, dense_second = system(rng, own=2)
    prior = rng.normal(size=(3, 6))
    together = reduced([[first, second]], prior)
    dense = np.concatenate([dense_first, dense_second, np.column_stack([prior[:, :5], np.zeros((3, 8))])])
    right = np.concatenate([first.residuals, second.residuals, prior[:, 5]])
    expected = np.linalg.lstsq(dense, -right)[0]
    assert -np.linalg.solve(together.factor, together.right) == pytest.approx(expected[:5], abs=1e-10)
    apart = reduced([[first], [second]], prior)
    assert len(apart.own) == 2
    assert apart.unexplained < together.unexplained


def test_an_own_unknown_that_nothing_touches_stays_where_it_is():
    """As if it were not there: a socket that one place has and another has not."""
    rng = np.random.default_rng(8)
    equations, _ = system(rng, own=3)
    here = equations.own.copy()
    here[equations.blocks == 2, 1] = 0.0
    silent = Equations(equations.residuals, equations.shared, here, equations.blocks)
    small = reduced([[silent]])
    dense = np.zeros((len(here), 5 + 12))
    dense[:, :5] = silent.shared
    for b in range(4):
        dense[silent.blocks == b, 5 + 3 * b : 8 + 3 * b] = here[silent.blocks == b]
    expected = np.linalg.lstsq(dense, -silent.residuals)[0]
    step = -np.linalg.solve(small.factor, small.right)
    assert step == pytest.approx(expected[:5], abs=1e-10)
    own = own_steps(small.own[0], step)
    assert own.ravel() == pytest.approx(expected[5:], abs=1e-10)
    assert own[2, 1] == 0.0
