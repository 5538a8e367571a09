"""How are arm, head and placements found together?

Gauss-Newton on the group: every kind of observation is linearised and whitened by its own covariance, the own unknowns
of each block are eliminated, the maker's tolerances enter as further rows, and the small triangular factor that is left
gives the step and, at the end, the covariance.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.observations import Columns, JointState, Linearised, Observations, moved, whitened
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats
from sixthlink.solvers import Reduced, own_steps, reduced

__all__ = ["Fit", "JointProblem", "Scales", "Weights", "solve"]

ITERATIONS = 30
HALVINGS = 12
CONVERGED = 1e-7
"""Decrease of the cost still to be expected at which the iteration has arrived: a thousandth of a standard error."""

Scales = Mapping[str, float]
"""Standard deviation of every origin of noise, as a multiple of its pattern."""

Weights = Mapping[int, Floats]
"""Weight ``(N,)`` of the observations of some kinds, by the kind's place in the problem; 1 where not named."""


@dataclass(frozen=True, eq=False)
class JointProblem:
    """What is known and what is sought.

    Attributes:
        observations: Everything that was observed, one entry per kind.
        columns: The shared unknowns.
        prior: ``(K, G)`` whitened rows on the shared unknowns counted from the nominal arm and lenses, for example
            one over the maker's tolerance for every parameter of the arm.
        prior_right: ``(K,)`` their right sides.
    """

    observations: tuple[Observations, ...]
    columns: Columns
    prior: Floats
    prior_right: Floats


@dataclass(frozen=True, eq=False)
class Fit:
    """A solved problem.

    Attributes:
        state: The answer.
        linear: Every kind's residuals and derivatives at the answer.
        reduced: The factor at the answer.
        own: Own unknowns by name, in the order of ``reduced.own``.
        cost: Whitened sum of squares of observations and prior.
        iterations: Steps taken.
    """

    state: JointState
    linear: tuple[Linearised, ...]
    reduced: Reduced
    own: tuple[str, ...]
    cost: float
    iterations: int


def solve(problem: JointProblem, start: JointState, scales: Scales, weights: Weights | None = None) -> Fit:
    """Most likely state, given how large every origin of noise is.

    Args:
        problem: Observations, unknowns and prior.
        start: Where to begin; anything from the certified head with the nominal arm will do.
        scales: Size of every origin of noise.
        weights: Weights of single observations.

    Raises:
        CalibrationError: The steps do not settle.
    """
    state = start
    current = _linearised(problem, state, scales, weights or {})
    for iteration in range(ITERATIONS):
        if current.cost - current.reduced.unexplained <= CONVERGED * max(current.cost, 1.0):
            return current.with_iterations(iteration)
        shared, own = _step(current)
        for halving in range(HALVINGS):
            factor = 0.5**halving
            tried = moved(state, problem.columns, factor * shared, [(n, factor * y) for n, y in own])
            new = _linearised(problem, tried, scales, weights or {})
            if new.cost < current.cost:
                break
        else:
            return current.with_iterations(iteration)
        state, current = tried, new
    raise CalibrationError(
        f"the estimate did not settle within {ITERATIONS} steps: either there are too few observations for what is "
        "estimated (record 15 shots or more, of several placements), or they contradict each other (shots paired with "
        "the wrong joints, a wrong robot, sign or order of a joint)"
    )


@dataclass(frozen=True, eq=False)
class _Current:
    state: JointState
    linear: tuple[Linearised, ...]
    reduced: Reduced
    own: tuple[str, ...]
    cost: float

    def with_iterations(self, iterations: int) -> Fit:
        return Fit(self.state, self.linear, self.reduced, self.own, self.cost, iterations)


def _linearised(problem: JointProblem, state: JointState, scales: Scales, weights: Weights) -> _Current:
    linear = tuple(o.linearised(state, problem.columns) for o in problem.observations)
    white = [whitened(part, scales, weights.get(k)) for k, part in enumerate(linear)]
    offset = np.zeros(problem.columns.size)
    offset[problem.columns.lens_slice] = state.lens_step
    offset[problem.columns.arm_slice] = state.arm_step
    prior_residual = problem.prior @ offset - problem.prior_right
    own = tuple(dict.fromkeys(o.block for o in problem.observations))
    sets = [[w for w, o in zip(white, problem.observations, strict=True) if o.block == name] for name in own]
    small = reduced(sets, np.column_stack([problem.prior, prior_residual]))
    cost = sum(w.cost for w in white) + float(prior_residual @ prior_residual)
    return _Current(state, linear, small, own, cost)


def _step(current: _Current) -> tuple[Floats, list[tuple[str, Floats]]]:
    factor = current.reduced.factor
    scale = 1.0 / np.maximum(np.linalg.norm(factor, axis=0), np.finfo(np.float64).tiny)
    shared = -scale * np.linalg.lstsq(factor * scale, current.reduced.right, rcond=1e-12)[0]
    own = [(name, own_steps(rows, shared)) for name, rows in zip(current.own, current.reduced.own, strict=True) if name]
    return shared, own
