"""What is true in the estimate's own parameters, and how well could any unbiased estimator do?

Parameters that no data can tell apart stay nominal in the estimate, although they are not nominal in the cell. The
equivalent truth is the state in the estimate's parametrisation that reproduces the noise-free recording. The bound is
the inverse of the information at that state, under the noise that is true: the Cramér-Rao bound with the maker's
tolerances as prior. One Gauss-Newton step from the truth is an estimator that attains it exactly, but needs the truth;
its error under the same noise is the yardstick for that of the real estimator.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sixthlink.calibrate.arm import arm_with_steps
from sixthlink.calibrate.joint import Estimate, Fit, JointProblem, observations_of, shared_covariance, solve
from sixthlink.calibrate.observations import JointState, TargetPoseShots, mahalanobis, whitened
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats
from sixthlink.solvers import covariance_of_own, own_steps, reduced
from sixthlink.study.draw import Draw

__all__ = ["Bound", "bound_at", "equivalent_truth"]

SHARPENED = 1e-2
"""By what the noise shrinks in the noise-free problem, so that the prior yields to whatever the data show."""

UNREPRODUCED = 0.1
"""Largest whitened length of a noise-free residual: what is left is no equivalent truth any more."""

TRUE_NOISE = {"joints": 1.0, "pixels": 1.0, "standard": 0.0}
"""Scales of the noise that is true of every draw."""


@dataclass(frozen=True, eq=False)
class Bound:
    """The efficient estimator at the truth.

    Attributes:
        shared: ``(G,)`` its error in the shared unknowns.
        own: ``(P, 6)`` its error in the placements.
        covariance: ``(G, G)`` Cramér-Rao bound of the shared unknowns.
        own_covariance: ``(P, 6, 6)`` that of the placements.
    """

    shared: Floats
    own: Floats
    covariance: Floats
    own_covariance: Floats


def equivalent_truth(found: Estimate, draw: Draw, Ts_base_target: Floats) -> JointState:
    """The state in the estimate's parametrisation that reproduces the noise-free recording.

    Where the noise-free data say nothing, it stays at the cell's own values.

    Args:
        found: The estimate, for its parametrisation.
        draw: The recording and its truth.
        Ts_base_target: ``(P, 4, 4)`` true placements.

    Raises:
        CalibrationError: No state of that parametrisation reproduces the noise-free recording.
    """
    columns = replace(found.problem.columns, lens=0)
    steps = np.array([draw.arm.values[p.step] - draw.data.arm.values[p.step] for p in columns.arm])
    state = JointState(
        arm_with_steps(draw.data.arm, columns.arm, steps),
        X=draw.T_flange_head,
        arm_step=steps,
        Ts_stand_target=Ts_base_target,
    )
    shots = observations_of(draw.data)[0]
    assert isinstance(shots, TargetPoseShots)  # noqa: S101 - shots come first
    exact = replace(shots, Ts_head_target=draw.exact, by_lens=np.zeros((0, 6, 0)))
    prior = np.zeros((len(steps), columns.size))
    prior[:, columns.arm_slice] = np.diag([1.0 / p.sigma for p in columns.arm])
    problem = JointProblem((exact,), columns, prior, prior[:, columns.arm_slice] @ steps)
    fit = solve(problem, state, {name: SHARPENED * scale for name, scale in TRUE_NOISE.items()})
    left = float(np.sqrt(mahalanobis(fit.linear[0], TRUE_NOISE).max()))
    if left > UNREPRODUCED:
        raise CalibrationError(
            f"the parameters that are free reproduce the noise-free recording only to {left:.2f} standard deviations "
            "of a shot; a parameter that was held nominal is no repetition of the others"
        )
    return replace(fit.state, lens_step=draw.lens_truth)


def bound_at(truth: JointState, found: Estimate, draw: Draw) -> Bound:
    """The Cramér-Rao bound of a recording, and the error of the estimator that attains it with the truth's help."""
    problem = replace(found.problem, observations=observations_of(draw.data), prior=_true_prior(found, draw))
    columns = problem.columns
    linear = tuple(o.linearised(truth, columns) for o in problem.observations)
    white = [whitened(part, TRUE_NOISE) for part in linear]
    offset = np.zeros(columns.size)
    offset[columns.lens_slice], offset[columns.arm_slice] = truth.lens_step, truth.arm_step
    small = reduced([white], np.column_stack([problem.prior, problem.prior @ offset]))
    covariance = shared_covariance(Fit(truth, linear, small, ("placements",), 0.0, 0))
    step = np.asarray(-np.linalg.lstsq(small.factor, small.right, rcond=None)[0], dtype=np.float64)
    own = small.own[0]
    return Bound(step, own_steps(own, step), covariance, covariance_of_own(own, covariance)[0])


def _true_prior(found: Estimate, draw: Draw) -> Floats:
    """Prior rows with the lenses' covariance that is true; the estimator may have been told another."""
    prior, columns = found.problem.prior.copy(), found.problem.columns
    if columns.lens:
        lens_rows = np.linalg.inv(np.linalg.cholesky(draw.data.lens_covariance))
        prior[len(columns.arm) :, columns.lens_slice] = lens_rows
    return prior
