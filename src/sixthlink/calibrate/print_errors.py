"""How far are the corners of the target from where they should have been printed?

A misprinted corner errs alike in every image: its error does not average away, and lenses fitted as if every pixel
erred by itself are believed too much. Offsets o of all corners in the target's plane are therefore unknowns with one
common variance. With the shots' poses and the cameras eliminated, the residual's share y = Bᵀr at the corners has the
covariance s² K + v² K², s the noise of a pixel, v that of the print (restricted likelihood). The likeliest offsets are

    o = -(K + s²/v² I)⁻¹ y

found anew once the corners are there, as pixels do not follow them in straight proportion; and the cameras' covariance
is that of cameras and offsets together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sixthlink.calibrate.corner_system import corner_spread, corner_system
from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, refine_rig
from sixthlink.calibrate.unexplained import weighed
from sixthlink.geometry import Floats, Ints

__all__ = ["PrintErrors", "print_errors"]

FEWEST_SHOTS = 5
"""Shots from which a corner's own error can be told from the noise of its pixels."""

CORRECTIONS, SETTLED = 6, 1e-3
"""Rounds in which corners are put where they seem to be, and the step, in the print's standard deviations, that ends
them."""


@dataclass(frozen=True, eq=False)
class PrintErrors:
    """What the images say of the target's corners.

    Attributes:
        sigma_m: Standard deviation of a corner's coordinate [m].
        points: ``(P,)`` the corners that were seen.
        offsets_m: ``(P, 2)`` most likely offsets in the target's plane [m].
        noise: Noise of a pixel coordinate without the print's part, as a multiple of what the problem states [-].
    """

    sigma_m: float
    points: Ints
    offsets_m: Floats
    noise: float


def print_errors(problem: RigProblem, fit: RigFit, stated_px: Floats) -> tuple[PrintErrors, RigProblem, RigFit] | None:
    """Offsets of the corners, and problem and fit that know of them; None where the images show none.

    Args:
        problem: Observations, with the number of the corner in each row.
        fit: The best explanation with the corners as they should be.
        stated_px: ``(M,)`` standard deviation of each coordinate, as the detector states it [pixel].
    """
    if len(fit.Ts_head_target) < FEWEST_SHOTS:
        return None
    points, index = np.unique(problem.points, return_inverse=True)
    as_printed, offsets = problem.points_target, np.zeros(2 * len(points))
    for k in range(CORRECTIONS):
        spread = corner_spread(corner_system(problem, fit), offsets)
        if spread is None or spread.print2_m2 == 0.0:
            return None
        sigma_m, noise = float(np.sqrt(spread.print2_m2)), float(np.sqrt(spread.noise2))
        step = -(spread.V @ (spread.z / (spread.k + spread.ridge))) - offsets
        offsets = offsets + step
        found = PrintErrors(sigma_m, points, offsets.reshape(-1, 2), noise)
        moved = np.column_stack([offsets.reshape(-1, 2), np.zeros(len(points))])
        problem = replace(problem, points_target=as_printed + moved[index])
        fit = refine_rig(problem, fit.rig, fit.Ts_head_target)
        if k > 0 and np.square(step).mean() < (SETTLED * sigma_m) ** 2:
            break
        noise_px = noise * float(np.sqrt(np.mean(problem.sigmas_px**2)))
        problem, fit = weighed(problem, replace(fit, noise_px=noise_px), stated_px)
    return found, problem, _believed(problem, fit, found)


def _believed(problem: RigProblem, fit: RigFit, found: PrintErrors) -> RigFit:
    """The fit of corrected corners, with the noise and the covariance that their remaining doubt leaves."""
    system = corner_system(problem, fit)
    ridge = (found.noise / found.sigma_m) ** 2 * np.eye(len(system.K0))
    left = system.A - system.T @ np.linalg.solve(system.K0 + ridge, system.T.T)
    return replace(
        fit,
        noise_px=found.noise * float(np.sqrt(np.mean(problem.sigmas_px**2))),
        covariance=np.asarray(np.linalg.inv(left)) * found.noise**2,
    )
