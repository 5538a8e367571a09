"""How do arm, head, placements, noise and the verdict on every shot settle together?

From a first state under the nominal arm: first with a heavy-tailed loss, then with the shots and touches that belong,
each at full weight, while the sizes of the noise follow the residuals. No starting guess is asked for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.arm import ArmParameter, Visibility, link_parameters, visibility
from sixthlink.calibrate.joint.consensus import limit, student_weights
from sixthlink.calibrate.joint.data import JointData, observations_of, reflector_names, start_of
from sixthlink.calibrate.joint.noise import fitted_covariances, shared_covariance, updated_scales
from sixthlink.calibrate.joint.problem import Fit, JointProblem, Scales, Weights, solve
from sixthlink.calibrate.observations import (
    Columns,
    JointState,
    TargetPoseShots,
    covariances,
    mahalanobis,
    whitened,
)
from sixthlink.geometry import Floats
from sixthlink.solvers import reduced

__all__ = ["Estimate", "estimate"]

ROBUST_ROUNDS, ROUNDS = 4, 12
SETTLED = 1e-3
"""Relative change of every scale below which the noise counts as settled."""

FEWEST_FOR_NOISE = 12
"""Degrees of freedom from which the noise is estimated; with fewer it stays as stated."""

RECORDED = ("across", "along", "tilt", "roll", "contact", "readings", "orientation")
"""Origins of noise that nobody states: they are always estimated."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """The settled answer.

    Attributes:
        problem: What was solved.
        fit: Its answer.
        scales: Size of every origin of noise.
        kept: Per kind of single observations (shots, touches, measured points), ``(N,)`` which belong.
        parameters: Every parameter of the arm that was considered.
        visibility: Whether the data see it.
        chi2_per_dof: Whitened sum of squares per degree of freedom under the stated noise, or under the estimated
            one for origins that nobody stated.
        dof: Degrees of freedom.
    """

    problem: JointProblem
    fit: Fit
    scales: Scales
    kept: tuple[npt.NDArray[np.bool_], ...]
    parameters: tuple[ArmParameter, ...]
    visibility: tuple[Visibility, ...]
    chi2_per_dof: float
    dof: int

    @property
    def covariance(self) -> Floats:
        """``(G, G)`` of the shared unknowns."""
        return shared_covariance(self.fit)


def estimate(
    data: JointData,
    *,
    parameters: Sequence[ArmParameter] | None = None,
    noise: str = "estimated",
) -> Estimate:
    """Arm, head and placements together.

    Args:
        data: What was observed.
        parameters: Parameters of the arm to consider; every constant of its links by default.
        noise: ``estimated`` from the residuals, or ``stated`` to keep what arm and images say.

    Raises:
        CalibrationError: The steps do not settle.
    """
    wanted = tuple(link_parameters(data.arm) if parameters is None else parameters)
    state, first = start_of(data)
    seen = _seen(data, wanted, state, first)
    free = tuple(p for p, v in zip(wanted, seen, strict=True) if v.seen)
    problem = _problem(data, _columns(data, free))
    state = replace(state, arm_step=np.zeros(len(free)))
    fit, scales, weights = _settled(data, problem, state, first, noise)
    chi2_per_dof, dof = _chi2(data, problem, fit, scales, weights)
    kept = tuple(w > 0.0 for w in weights.values())
    return Estimate(problem, fit, scales, kept, wanted, seen, chi2_per_dof, dof)


def _settled(
    data: JointData, problem: JointProblem, state: JointState, scales: Scales, noise: str
) -> tuple[Fit, Scales, Weights]:
    """Rounds of fit, verdict on every single observation, and size of the noise."""
    blocks = [o.block for o in problem.observations]
    linear = [o.linearised(state, problem.columns) for o in problem.observations[: data.singles]]
    weights = {k: student_weights(mahalanobis(part, scales), part.residuals.shape[1]) for k, part in enumerate(linear)}
    fit = solve(problem, state, scales, weights)
    origins = _estimated(fit, data, noise)
    for round_ in range(ROBUST_ROUNDS + ROUNDS):
        robust = round_ < ROBUST_ROUNDS
        new_weights = {k: _weights(fit, k, blocks[k], scales, old, robust=robust) for k, old in weights.items()}
        used = weights if robust else new_weights
        new_scales = (
            updated_scales(fit, blocks, scales, free=origins, weights=used, stated=data.stated) if origins else scales
        )
        change = max((abs(new_scales[n] / scales[n] - 1.0) for n in origins), default=0.0)
        same = all(np.array_equal(new_weights[k], weights[k]) for k in weights)
        scales, weights = new_scales, new_weights
        fit = solve(problem, fit.state, scales, weights)
        if not robust and same and change < SETTLED:
            break
    return fit, scales, weights


def _weights(fit: Fit, kind: int, block: str, scales: Scales, old: Floats, *, robust: bool) -> Floats:
    """Weights of a heavy-tailed loss, or 1 for what belongs and 0 for what is larger than chance makes the largest.

    An observation that was left out also carries the fit's own doubt about where it should be.
    """
    linear = fit.linear[kind]
    dimensions = linear.residuals.shape[1]
    if robust:
        return student_weights(mahalanobis(linear, scales), dimensions)
    H = fitted_covariances(fit, linear, block, shared_covariance(fit))
    total = covariances(linear, scales) + np.where(old > 0.0, 0.0, 1.0)[:, None, None] * H
    r = linear.residuals[:, :, None]
    d2 = np.einsum("nij,nij->n", r, np.linalg.solve(total, r))
    return (d2 <= limit(len(old), dimensions)).astype(np.float64)


def _seen(data: JointData, wanted: Sequence[ArmParameter], state: JointState, scales: Scales) -> tuple[Visibility, ...]:
    """Which parameters of the arm the data see, by the rank-revealing factor of all of them together.

    The shots are taken as predicted: a residual's own lever would make parameters that only move the base, and so are
    the placements' business, look as if they were seen.
    """
    columns = _columns(data, tuple(wanted))
    at = replace(state, arm_step=np.zeros(len(wanted)))
    problem = _problem(data, columns)
    lens_rows = problem.prior[len(wanted) :]
    predicted = [o.as_predicted(at) if isinstance(o, TargetPoseShots) else o for o in problem.observations]
    white = [(o.block, whitened(o.linearised(at, columns), scales)) for o in predicted]
    names = dict.fromkeys(block for block, _ in white)
    sets = [[w for block, w in white if block == name] for name in names]
    small = reduced(sets, np.column_stack([lens_rows, np.zeros(len(lens_rows))]))
    if data.shots is None:
        return visibility(small.factor, wanted, others="the points on the flange or where they were found")
    return visibility(small.factor, wanted)


def _columns(data: JointData, arm: tuple[ArmParameter, ...]) -> Columns:
    return Columns(
        head=data.shots is not None,
        tool=data.touches is not None,
        reflectors=reflector_names(data),
        turned=() if data.probed is None else tuple(np.unique(data.probed.reflectors).tolist()),
        lens=len(data.lens_covariance),
        arm=arm,
    )


def _problem(data: JointData, columns: Columns) -> JointProblem:
    A, g = len(columns.arm), columns.lens
    prior, right = np.zeros((A + g, columns.size)), np.zeros(A + g)
    prior[:A, columns.arm_slice] = np.diag([1.0 / p.sigma for p in columns.arm])
    if g:
        white = np.linalg.inv(np.linalg.cholesky(data.lens_covariance))
        prior[A:, columns.lens_slice] = white
        right[A:] = -white @ data.lens_offset
    return JointProblem(observations_of(data), columns, prior, right)


def _estimated(fit: Fit, data: JointData, noise: str) -> tuple[str, ...]:
    """Origins whose size the residuals shall tell."""
    if _dof(fit, {}) < FEWEST_FOR_NOISE:
        return ()
    here = {name for linear in fit.linear for name in linear.noises}
    wanted = {*RECORDED} if noise == "stated" and "joints" in data.stated else {"joints", *RECORDED}
    return tuple(sorted(here & wanted))


def _dof(fit: Fit, weights: Weights) -> int:
    """Numbers observed minus unknowns without a prior; a prior row pays for its own parameter."""
    count = 0
    for k, linear in enumerate(fit.linear):
        used = np.count_nonzero(weights[k]) if k in weights else len(linear.residuals)
        count += int(used) * linear.residuals.shape[1]
    unknown = sum(rows.shape[0] * rows.shape[1] for rows in fit.reduced.own)
    points = 3 * (fit.state.tool_m is not None) + fit.state.reflectors_m.size
    turned = 3 * sum(bool((np.eye(3) != R).any()) for R in fit.state.Rs_link_reflector)
    return count - unknown - 6 * (fit.state.X is not None) - points - turned


def _chi2(data: JointData, problem: JointProblem, fit: Fit, scales: Scales, weights: Weights) -> tuple[float, int]:
    stated: Mapping[str, float] = dict(scales) | dict(data.stated)
    cost = 0.0
    for k, linear in enumerate(fit.linear):
        d2 = mahalanobis(linear, stated)
        cost += float(d2 @ (weights[k] > 0.0)) if k in weights else float(d2.sum())
    step = np.zeros(problem.columns.size)
    step[problem.columns.lens_slice] = fit.state.lens_step
    step[problem.columns.arm_slice] = fit.state.arm_step
    cost += float(np.sum((problem.prior @ step - problem.prior_right) ** 2))
    dof = _dof(fit, weights)
    return cost / max(dof, 1), dof
