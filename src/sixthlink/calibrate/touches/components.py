"""How large is each part of correlated noise, and what do the unknowns know when it is that large?

A linear model with several covariance patterns, solved densely: generalised least squares under the present variances,
restricted maximum likelihood for the variances (Fisher scoring, none negative), and for every combination of unknowns
the degrees of freedom that its estimated variance is worth.

Sources: Harville, "Maximum likelihood approaches to variance component estimation", JASA 72 (1977); Satterthwaite, "An
approximate distribution of estimates of variance components", Biometrics Bulletin 2 (1946); Kenward and Roger, "Small
sample inference for fixed effects from restricted maximum likelihood", Biometrics 53 (1997), eq. (3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.stats import t

from sixthlink.geometry import Floats

__all__ = ["CorrelatedRows", "MixedFit", "mixed_fit", "weighted_fit"]

ROUNDS, HALVINGS = 40, 8
SETTLED = 1e-2
"""Change of twice the log-likelihood from which the variances count as settled."""

FLOOR = 1e-6
"""A part's smallest variance, as a share of the first guess: it can vanish, but the equations stay regular."""

FEWEST_DEGREES = 2.0
"""A variance is never counted as worth less than this: below, the t distribution says nothing about its width."""


@dataclass(frozen=True, eq=False)
class CorrelatedRows:
    """Rows ``right + rows @ x`` with noise of several patterns, and rows of unit variance.

    Attributes:
        rows: ``(n, p)`` derivative of each observed number by the unknowns.
        right: ``(n,)`` residual at zero.
        patterns: ``(k, n, n)`` covariance per unit of each variance.
        white_rows: ``(m, p)`` further rows whose variance is known and divided out: tolerances, certified lengths.
        white_right: ``(m,)`` their residuals.
    """

    rows: Floats
    right: Floats
    patterns: Floats
    white_rows: Floats
    white_right: Floats


@dataclass(frozen=True, eq=False)
class MixedFit:
    """Unknowns and variances.

    Attributes:
        step: ``(p,)`` the unknowns.
        covariance: ``(p, p)`` theirs.
        variances: ``(k,)`` size of each pattern.
        by_variance: ``(k, p, p)`` change of the covariance per unit of each variance.
        weighing: ``(p, p)`` what weights by estimated instead of true variances add to the covariance, and what the
            estimated covariance lacks for the same reason.
        doubt: ``(k, k)`` covariance of the variances.
        cost: Minus twice the restricted log-likelihood, but for a constant.
    """

    step: Floats
    covariance: Floats
    variances: Floats
    by_variance: Floats
    weighing: Floats
    doubt: Floats
    cost: float

    def variance_of(self, gradient: Floats) -> tuple[float, float]:
        """Variance of ``gradient @ step``, and the degrees of freedom that its size is known with."""
        variance = float(gradient @ (self.covariance + self.weighing) @ gradient)
        slopes = np.einsum("i,kij,j->k", gradient, self.by_variance, gradient)
        unsure = float(slopes @ self.doubt @ slopes)
        degrees = 2.0 * variance**2 / unsure if unsure > 0.0 else np.inf
        return variance, max(degrees, FEWEST_DEGREES)

    def std_of(self, gradient: Floats, *, coverage: float) -> float:
        """Standard deviation whose ``coverage`` multiples hold 95 %, few degrees of freedom included."""
        variance, degrees = self.variance_of(gradient)
        return float(np.sqrt(variance) * t.ppf(0.975, degrees) / coverage)


@dataclass(frozen=True, eq=False)
class _Solved:
    step: Floats
    covariance: Floats
    rest: Floats
    projector: Floats
    cost: float


def mixed_fit(data: CorrelatedRows, start: Floats) -> MixedFit:
    """Unknowns and variances of the largest restricted likelihood.

    Args:
        data: The rows.
        start: ``(k,)`` first guess of the variances, all above 0.
    """
    variances = start
    now = _solved(data, variances)
    for _ in range(ROUNDS):
        wanted = _scored(data, now, variances, FLOOR * start)
        for halving in range(HALVINGS):
            tried = variances + 0.5**halving * (wanted - variances)
            new = _solved(data, tried)
            if new.cost < now.cost:
                break
        else:
            break
        settled = now.cost - new.cost < SETTLED
        variances, now = tried, new
        if settled:
            break
    return _answer(data, now, variances, _doubt(data, now, variances))


def weighted_fit(data: CorrelatedRows, sizes: MixedFit) -> MixedFit:
    """Unknowns under variances that another fit, of part of the same data, has found."""
    return _answer(data, _solved(data, sizes.variances), sizes.variances, sizes.doubt)


def _solved(data: CorrelatedRows, variances: Floats) -> _Solved:
    """Generalised least squares under these variances, by orthogonal factors of the whitened rows."""
    factor = np.linalg.cholesky(np.einsum("k,kij->ij", variances, data.patterns))
    inverse = np.linalg.inv(factor)
    rows = np.concatenate([inverse @ data.rows, data.white_rows])
    right = np.concatenate([inverse @ data.right, data.white_right])
    scale = 1.0 / np.maximum(np.linalg.norm(rows, axis=0), np.finfo(np.float64).tiny)
    Q, R = np.linalg.qr(rows * scale)
    root = scale[:, None] * np.linalg.inv(R)
    step = -root @ (Q.T @ right)
    left = right + rows @ step
    n = len(data.right)
    fitted = Q[:n]
    projector = inverse.T @ (np.eye(n) - fitted @ fitted.T) @ inverse
    cost = float(left @ left) + 2.0 * float(np.log(np.diag(factor)).sum())
    cost += 2.0 * float(np.sum(np.log(np.abs(np.diag(R))) - np.log(scale)))
    return _Solved(step, root @ root.T, inverse.T @ left[:n], projector, cost)


def _scored(data: CorrelatedRows, now: _Solved, variances: Floats, least: Floats) -> Floats:
    """Variances after one step of Fisher scoring."""
    information, products = _information(data, now)
    score = np.einsum("i,kij,j->k", now.rest, data.patterns, now.rest)
    expected = np.array([np.trace(P) for P in products])
    left = variances[:, None] * information * variances
    right = left.sum(axis=1) + variances * (score - expected)
    ratios = nnls(left, right)[0]
    return np.maximum(ratios * variances, least)


def _information(data: CorrelatedRows, now: _Solved) -> tuple[Floats, Floats]:
    products = now.projector @ data.patterns
    k = len(products)
    turned = np.swapaxes(products, 1, 2).reshape(k, -1)
    return products.reshape(k, -1) @ turned.T, products


def _doubt(data: CorrelatedRows, now: _Solved, variances: Floats) -> Floats:
    """Covariance of the variances: the inverse of their information."""
    information, _ = _information(data, now)
    scaled = variances[:, None] * information * variances
    doubt: Floats = 2.0 * variances[:, None] * np.linalg.pinv(scaled, rcond=1e-10, hermitian=True) * variances
    return doubt


def _answer(data: CorrelatedRows, now: _Solved, variances: Floats, doubt: Floats) -> MixedFit:
    total = np.einsum("k,kij->ij", variances, data.patterns)
    carried = np.linalg.solve(total, data.rows) @ now.covariance
    moved = data.patterns @ carried
    by_variance = carried.T @ moved
    spread = now.projector @ np.einsum("kl,lip->kip", doubt, moved)
    weighing = 2.0 * np.einsum("kip,kiq->pq", moved, spread)
    return MixedFit(now.step, now.covariance, variances, by_variance, weighing, doubt, now.cost)
