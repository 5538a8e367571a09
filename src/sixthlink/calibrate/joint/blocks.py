"""Do couplings, joint scales, periodic errors or yielding joints earn their place in the model?

Only what predicts observations that it has not seen better enters. The shots are dealt into folds that lie apart in
joint space: an arm's errors are smooth functions of the pose, and a neighbour that was seen would give the answer away.
With and without a block, the others predict each fold, and every observation is scored by its likelihood under the
prediction, the prediction's own doubt included. A block enters when the mean gain stands out by two standard errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from sixthlink.calibrate.arm import BLOCKS, optional_parameters
from sixthlink.calibrate.joint.data import JointData
from sixthlink.calibrate.joint.estimate import Estimate, estimate
from sixthlink.calibrate.joint.noise import fitted_covariances, shared_covariance
from sixthlink.calibrate.joint.problem import Fit, Scales, solve
from sixthlink.calibrate.observations import Posed, covariances
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats, Ints

__all__ = ["BlockVerdict", "estimate_with_blocks"]

FOLDS = 5
STANDARD_ERRORS = 2.0

NUMBERS_PER_UNKNOWN = 4
"""Observed numbers per unknown of head and arm below which a block is not even tried: few shots are explained by
anything. The cameras' unknowns are known from their images."""


@dataclass(frozen=True)
class BlockVerdict:
    """Whether one optional block of arm parameters entered.

    Attributes:
        block: Name of the block.
        entered: Whether it is part of the model.
        gain: Mean gain of log-likelihood (times 2) per observation that it has not seen [-].
        standard_error: Of that mean [-].
    """

    block: str
    entered: bool
    gain: float
    standard_error: float


def estimate_with_blocks(
    data: JointData, *, noise: str = "estimated", blocks: Sequence[str] = BLOCKS, base: Estimate | None = None
) -> tuple[Estimate, tuple[BlockVerdict, ...]]:
    """Arm, head and placements together, with those optional blocks that held-out observations ask for.

    Args:
        data: What was observed.
        noise: As in :func:`~.estimate.estimate`.
        blocks: Blocks to consider, in this order.
        base: The estimate without them, where it is already there.
    """
    best = base or estimate(data, noise=noise)
    verdicts = []
    scores = _heldout_scores(best)
    for block in blocks:
        extra = optional_parameters(data.arm, block)
        unknowns = best.problem.columns.size - best.problem.columns.lens + len(extra)
        if not extra or _numbers(best) < NUMBERS_PER_UNKNOWN * unknowns:
            continue
        try:
            tried = estimate(data, noise=noise, parameters=(*best.parameters, *extra))
            # The smaller model's noise and verdicts judge both, or the larger one would set its own standard.
            tried = replace(tried, scales=best.scales, kept=best.kept)
            gains = scores - _heldout_scores(tried)
        except CalibrationError:
            continue
        gain, error = float(gains.mean()), float(gains.std(ddof=1) / np.sqrt(len(gains)))
        entered = gain > STANDARD_ERRORS * error
        verdicts.append(BlockVerdict(block, entered, gain, error))
        if entered:
            best = estimate(data, noise=noise, parameters=tried.parameters)
            scores = _heldout_scores(best)
    return best, tuple(verdicts)


def _numbers(found: Estimate) -> int:
    """Numbers that the kept observations bring, less the own unknowns of their blocks."""
    kept = sum(int(k.sum()) * found.fit.linear[i].residuals.shape[1] for i, k in enumerate(found.kept))
    return kept - sum(rows.shape[0] * rows.shape[1] for rows in found.fit.reduced.own)


def _heldout_scores(found: Estimate) -> Floats:
    """Minus twice the log-likelihood of every kept observation, predicted by the folds that did not hold it."""
    scores = [np.zeros(len(kept)) for kept in found.kept]
    folds = [_dealt(found, k) for k in range(len(found.kept))]
    for fold in range(FOLDS):
        weights = {k: (kept & (folds[k] != fold)).astype(np.float64) for k, kept in enumerate(found.kept)}
        fit = solve(found.problem, found.fit.state, found.scales, weights)
        shared = shared_covariance(fit)
        for k in range(len(found.kept)):
            block = found.problem.observations[k].block
            scores[k] += np.where(folds[k] == fold, _score(fit, k, block, found.scales, shared), 0.0)
    return np.concatenate([s[kept] for s, kept in zip(scores, found.kept, strict=True)])


def _score(fit: Fit, kind: int, block: str, scales: Scales, shared: Floats) -> Floats:
    linear = fit.linear[kind]
    total = covariances(linear, scales) + fitted_covariances(fit, linear, block, shared)
    r = linear.residuals[:, :, None]
    d2 = np.einsum("nij,nij->n", r, np.linalg.solve(total, r))
    return np.asarray(d2 + np.linalg.slogdet(total)[1], dtype=np.float64)


def _dealt(found: Estimate, kind: int) -> Ints:
    """Fold ``(N,)`` of every observation: slabs of joint space within each block, across its longest direction."""
    blocks, joints = found.fit.linear[kind].blocks, cast("Posed", found.problem.observations[kind]).joints
    fold = np.empty(len(blocks), dtype=np.int64)
    for b in np.unique(blocks):
        members = np.flatnonzero(blocks == b)
        spread = joints[members] - joints[members].mean(axis=0)
        longest = np.linalg.svd(spread, full_matrices=False)[2][0]
        fold[members[np.argsort(spread @ longest, kind="stable")]] = np.arange(len(members)) * FOLDS // len(members)
    return fold
