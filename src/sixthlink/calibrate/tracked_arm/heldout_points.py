"""How far off is the arm where it has not looked?

The poses are dealt into five parts at random; each part is predicted by a fit to the four others, with the model, the
noise and the verdicts on single points of the whole. Points that were measured at one pose stay together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sixthlink.calibrate.joint import Estimate, JointData, JointProblem, solve, start_of
from sixthlink.calibrate.joint.problem import Fit, Weights
from sixthlink.calibrate.observations import JointState
from sixthlink.calibrate.tracked_arm.tracked_arm import PointErrors
from sixthlink.geometry import Floats, Ints
from sixthlink.robot import Arm

__all__ = ["errors_at", "heldout_errors"]

FOLDS = 5


def heldout_errors(data: JointData, found: Estimate, nominal: Arm) -> tuple[PointErrors, PointErrors]:
    """Errors of the points that belong, each predicted without its pose: calibrated arm and nominal arm.

    Args:
        data: The points.
        found: The estimate of the whole.
        nominal: The arm as it was known beforehand.
    """
    start, _ = start_of(replace(data, arm=nominal))
    still = replace(found.problem.columns, arm=())
    no_prior = np.zeros((0, still.size))
    problem = JointProblem(found.problem.observations, still, no_prior, np.zeros(0))
    return (
        _predicted(data, found, found.problem, found.fit.state),
        _predicted(data, found, problem, replace(start, arm_step=np.zeros(0))),
    )


def errors_at(found: Estimate, fit: Fit) -> PointErrors:
    """Errors of the points that belong at a fit."""
    return _errors([part.residuals[kept] for part, kept in zip(fit.linear, found.kept, strict=True)])


def _predicted(data: JointData, found: Estimate, problem: JointProblem, start: JointState) -> PointErrors:
    folds = _dealt(data)
    predicted = [np.zeros_like(part.residuals) for part in found.fit.linear]
    for fold in range(FOLDS):
        weights: Weights = {k: (kept & (folds[k] != fold)).astype(np.float64) for k, kept in enumerate(found.kept)}
        fit = solve(problem, start, found.scales, weights)
        for k, part in enumerate(fit.linear):
            predicted[k][folds[k] == fold] = part.residuals[folds[k] == fold]
    return _errors([p[kept] for p, kept in zip(predicted, found.kept, strict=True)])


def _dealt(data: JointData) -> list[Ints]:
    """Fold of every point; all points of a pose in one."""
    joints = np.concatenate([kind.joints for kind in data.outside])
    pose_of = np.unique(np.round(joints, 6), axis=0, return_inverse=True)[1].ravel()
    poses = int(pose_of.max()) + 1
    fold_of = np.random.default_rng(0).permutation(np.arange(poses) % FOLDS)[pose_of]
    return list(np.split(fold_of, np.cumsum([len(kind.joints) for kind in data.outside])[:-1]))


def _errors(residuals: list[Floats]) -> PointErrors:
    turns = [r[:, 3:] for r in residuals if r.shape[1] == 6]
    return PointErrors(
        np.concatenate([np.linalg.norm(r[:, :3], axis=1) for r in residuals]),
        np.linalg.norm(np.concatenate(turns), axis=1) if turns else np.zeros(0),
    )
