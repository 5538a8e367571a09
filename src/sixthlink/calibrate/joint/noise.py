"""How large is the noise of each origin, as the residuals themselves tell it?

Variance components by restricted maximum likelihood. At the answer, a residual's covariance is its own noise minus
what the fit has taken up. For origin k the score rᵀW V_k W r has the expectation Σ_l θ_l tr(W V_k W V_l) minus
tr(W V_k W H), with θ the variances and H the covariance of the fitted values; setting both equal for every origin
gives the variances, none of them negative (Fisher scoring; non-negative least squares).

Source: Harville, "Maximum likelihood approaches to variance component estimation", JASA 72 (1977), section 5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import nnls

from sixthlink.calibrate.joint.problem import Fit, Scales, Weights
from sixthlink.calibrate.observations import Linearised, covariances
from sixthlink.geometry import Floats
from sixthlink.solvers import covariance_of_own

__all__ = ["fitted_covariances", "shared_covariance", "updated_scales"]

BELIEF = 30.0
"""Residuals that a stated size of the noise is worth: it rules where few shots say little, and yields to many."""

SMALLEST = 0.05
"""Share of its present size to which a scale may fall at once: an origin is never switched off by one look."""


def shared_covariance(fit: Fit) -> Floats:
    """Covariance ``(G, G)`` of the shared unknowns; directions that nothing determines have none."""
    factor = fit.reduced.factor
    scale = 1.0 / np.maximum(np.linalg.norm(factor, axis=0), np.finfo(np.float64).tiny)
    inverse: Floats = scale[:, None] * np.linalg.pinv(factor * scale, rcond=1e-12)
    return inverse @ inverse.T


def fitted_covariances(fit: Fit, linear: Linearised, block: str, shared: Floats) -> Floats:
    """Covariance ``(N, d, d)`` of the fitted values of one kind: J C Jᵀ."""
    J = linear.shared
    total: Floats = J @ shared @ np.swapaxes(J, 1, 2)
    if linear.own.shape[2]:
        own, crossed = covariance_of_own(fit.reduced.own[fit.own.index(block)], shared)
        L = linear.own
        mixed = L @ crossed[linear.blocks] @ np.swapaxes(J, 1, 2)
        total = total + L @ own[linear.blocks] @ np.swapaxes(L, 1, 2) + mixed + np.swapaxes(mixed, 1, 2)
    return total


def updated_scales(
    fit: Fit,
    blocks: Sequence[str],
    scales: Scales,
    *,
    free: Sequence[str],
    weights: Weights,
    stated: Scales,
) -> Mapping[str, float]:
    """Scales after one scoring step of the free origins.

    Args:
        fit: The answer under the present scales.
        blocks: Own unknowns of each kind of observation.
        scales: Present scales.
        free: Origins whose size is estimated.
        weights: Weights of the observations; those of weight 0 do not count.
        stated: Sizes that were stated beforehand: they count as much as ``BELIEF`` residuals.
    """
    names = [n for n in scales if any(n in linear.noises for linear in fit.linear)]
    shared = shared_covariance(fit)
    score, taken, T = np.zeros(len(names)), np.zeros(len(names)), np.zeros((len(names), len(names)))
    for k, (linear, block) in enumerate(zip(fit.linear, blocks, strict=True)):
        weight = weights.get(k, np.ones(len(linear.residuals)))
        used = weight > 0.0
        W = np.linalg.inv(covariances(linear, scales))[used]
        H = fitted_covariances(fit, linear, block, shared)[used]
        Wr = (W @ linear.residuals[used, :, None])[:, :, 0]
        here = [j for j, n in enumerate(names) if n in linear.noises]
        products = {j: W @ linear.noises[names[j]][used] for j in here}
        for j in here:
            VWr = (linear.noises[names[j]][used] @ Wr[:, :, None])[:, :, 0]
            score[j] += float(np.sum(weight[used] * np.sum(Wr * VWr, axis=1)))
            taken[j] += float(np.einsum("nij,nji->", products[j] @ W, H))
            for i in here:
                T[j, i] += float(np.einsum("nij,nji->", products[j], products[i]))
    theta = np.array([scales[n] ** 2 for n in names])
    chosen = [j for j, n in enumerate(names) if n in free]
    others = [j for j in range(len(names)) if j not in chosen]
    # Scaled to the present variances, so that the equations of large and small origins weigh alike.
    left = theta[chosen, None] * T[np.ix_(chosen, chosen)] * theta[chosen]
    right = theta[chosen] * ((score + taken)[chosen] - T[np.ix_(chosen, others)] @ theta[others])
    for row, j in enumerate(chosen):
        if names[j] in stated:
            left[row, row] += BELIEF
            right[row] += BELIEF * (stated[names[j]] / scales[names[j]]) ** 2
    ratios = nnls(left, right)[0]
    new = dict(scales)
    for j, ratio in zip(chosen, ratios, strict=True):
        new[names[j]] = scales[names[j]] * float(np.sqrt(max(ratio, SMALLEST**2)))
    return new
