"""Is the board flat?

Paper on a warped plate, or a plate screwed down askew, bends by tenths of a millimetre: enough to bend lens and head
along. To second order a bent board is z = h·φ over three shapes φ: curved along x, along y, and twisted, each without
mean or slope, because those are a matter of the pose. With lenses, camera poses and target poses free, the views tell
h and its covariance; it enters where it stands out from both noise and what is worth telling.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, prior_information, refine_rig
from sixthlink.camera import rig_pixels
from sixthlink.geometry import Floats, frozen_floats, hat

__all__ = ["BoardShape", "bent_points", "board_shape"]

FALSE_ALARM = 1e-6
"""Chance of a flat board that is called bent: lens terms that no model has look a little like a bend."""

WORTH_TELLING_M = 2e-5
"""Sag below which a board counts as flat."""

EXPLAINED = 0.01
"""Share of the squared residuals that a bend must explain: what is significant only because there are many points, and
leaves the residuals as they were, is the lens model's affair."""

ROUNDS = 4
FEWEST_SHOTS = 5


@dataclass(frozen=True, eq=False)
class BoardShape:
    """How a board is bent.

    Attributes:
        heights_m: ``(P, )`` how far every point lies behind the flat board, along its z [m].
        sag_m: Largest minus smallest of them [m].
        sag_std_m: Standard deviation of it [m].
        explained: Share of the squared residuals that the bend explains.
    """

    heights_m: Floats
    sag_m: float
    sag_std_m: float
    explained: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "heights_m", frozen_floats(self.heights_m, (None,), "heights_m"))


def board_shape(problem: RigProblem, fit: RigFit, points_m: Floats) -> tuple[BoardShape, RigProblem, RigFit] | None:
    """The bend that the images show, with the problem and the fit that know of it; None where they show none.

    Args:
        problem: Observations.
        fit: Their best explanation by a flat board.
        points_m: ``(P, 3)`` points of the target [m].
    """
    if len(fit.Ts_head_target) < FEWEST_SHOTS or np.ptp(points_m[:, 2]) > 0.0:
        return None
    shapes = _shapes(points_m)
    if shapes is None:
        return None
    flat_cost, total = _cost(problem, fit), np.zeros(3)
    bent, found = problem, fit
    for _ in range(ROUNDS):
        step, covariance = _step(bent, found, shapes)
        total = total + step
        bent = bent_points(bent, points_m, shapes @ total)
        found = refine_rig(bent, found.rig, found.Ts_head_target)
        if step @ np.linalg.solve(covariance, step) < 1e-4:
            break
    noise2 = _cost(bent, found) / max(2 * len(bent.slots) - len(covariance) - 6 * len(found.Ts_head_target), 1)
    covariance = covariance * noise2
    chance = float(chdtrc(3, total @ np.linalg.solve(covariance, total)))
    heights = shapes @ total
    low, high = int(np.argmin(heights)), int(np.argmax(heights))
    sag, between = float(heights[high] - heights[low]), shapes[high] - shapes[low]
    explained = 1.0 - _cost(bent, found) / flat_cost
    if chance > FALSE_ALARM or sag < WORTH_TELLING_M or explained < EXPLAINED:
        return None
    return BoardShape(heights, sag, float(np.sqrt(between @ covariance @ between)), explained), bent, found


def bent_points(problem: RigProblem, points_m: Floats, heights_m: Floats) -> RigProblem:
    """The problem with its points at heights ``(P,)`` over the flat board [m]."""
    points = points_m + np.column_stack([np.zeros((len(points_m), 2)), heights_m])
    return replace(problem, points_target=points[problem.points])


def _shapes(points_m: Floats) -> Floats | None:
    """Three bends ``(P, 3)`` of about unit size without mean or slope; None where the points are too few for them."""
    centred = points_m[:, :2] - points_m[:, :2].mean(axis=0)
    x, y = (centred / np.abs(centred).max(axis=0).clip(1e-12)).T
    second = np.column_stack([x * x, x * y, y * y])
    first = np.column_stack([np.ones_like(x), x, y])
    shapes: Floats = second - first @ np.linalg.lstsq(first, second, rcond=None)[0]
    sizes = np.linalg.svd(shapes, compute_uv=False)
    return shapes if len(sizes) == 3 and sizes[-1] > 0.05 * sizes[0] else None


def _cost(problem: RigProblem, fit: RigFit) -> float:
    return float(np.sum((fit.residuals_px / problem.sigmas_px[:, None]) ** 2))


def _step(problem: RigProblem, fit: RigFit, shapes: Floats) -> tuple[Floats, Floats]:
    """Best change of the three heights at a fit, cameras and poses free, and its covariance per unit of variance."""
    S = len(fit.Ts_head_target)
    T = fit.Ts_head_target[problem.slots]
    lever = (T[:, :3, :3] @ problem.points_target[:, :, None])[:, :, 0]
    _, by_head, J, _ = rig_pixels(fit.rig, problem.cameras, lever + T[:, :3, 3], problem.unknowns)
    weight = 1.0 / problem.sigmas_px[:, None, None]
    by_height = (by_head @ T[:, :3, 2:3]) * shapes[problem.points][:, None, :] * weight
    shared = np.concatenate([J * weight, by_height], axis=2)
    own = np.concatenate([by_head, -by_head @ hat(lever)], axis=2) * weight
    r = (fit.residuals_px * weight[:, 0])[:, :, None]
    starts = np.searchsorted(problem.slots, np.arange(S))
    every = np.concatenate([shared, r], axis=2)
    own_information = np.add.reduceat(np.swapaxes(own, 1, 2) @ own, starts)
    C = np.add.reduceat(np.swapaxes(own, 1, 2) @ every, starts)
    flat = every.reshape(-1, every.shape[2])
    left = flat.T @ flat - np.tensordot(C, np.linalg.solve(own_information, C), axes=([0, 1], [0, 1]))
    G = J.shape[2]
    information = left[:-1, :-1].copy()
    information[:G, :G] += np.diag(prior_information(problem))
    covariance = np.linalg.inv(information)
    return -(covariance @ left[:-1, -1])[G:], np.asarray(covariance[G:, G:], dtype=np.float64)
