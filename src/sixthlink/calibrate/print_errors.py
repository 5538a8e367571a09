"""How far are the corners of the target from where they should have been printed?

A misprinted corner errs alike in every image: its error does not average away, and lenses fitted as if every pixel
erred by itself are believed too much. Offsets o of all corners in the target's plane are therefore unknowns with one
common variance. With the shots' poses and the cameras eliminated, the residual's share y = Bᵀr at the corners has the
covariance s² K + v² K², s the noise of a pixel, v that of the print (restricted likelihood). The likeliest offsets are

    o = -(K + s²/v² I)⁻¹ y

and the cameras' covariance is that of cameras and offsets together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, prior_information
from sixthlink.camera import rig_pixels
from sixthlink.geometry import Floats, Ints, hat

__all__ = ["PrintErrors", "believed", "print_errors"]

FEWEST_SHOTS = 5
"""Shots from which a corner's own error can be told from the noise of its pixels."""

SIGNIFICANCE = 2.0
"""Standard deviations by which the print's variance must stand out from zero."""

ROUNDS = 20


@dataclass(frozen=True, eq=False)
class PrintErrors:
    """What the images say of the target's corners.

    Attributes:
        sigma_m: Standard deviation of a corner's coordinate [m].
        points: ``(P,)`` the corners that were seen.
        offsets_m: ``(P, 2)`` most likely offsets in the target's plane [m].
        noise: Noise of a pixel coordinate without the print's part, as a multiple of what the detector states [-].
    """

    sigma_m: float
    points: Ints
    offsets_m: Floats
    noise: float


@dataclass(frozen=True, eq=False)
class _Reduced:
    """Information on cameras (A), between cameras and corners (T), on corners (K0), and the corners' residual y."""

    A: Floats
    T: Floats
    K0: Floats
    y: Floats
    cost: float


def print_errors(problem: RigProblem, fit: RigFit) -> PrintErrors | None:
    """Offsets of the corners at the best cameras, or None where the images show none.

    Args:
        problem: Observations, with the number of the corner in each row.
        fit: The best explanation with the corners as they should be.
    """
    S, M, G = len(fit.Ts_head_target), len(problem.slots), problem.unknowns.size
    if S < FEWEST_SHOTS:
        return None
    points, index = np.unique(problem.points, return_inverse=True)
    small = _reduced(problem, fit, index, len(points))
    inverse_A = np.asarray(np.linalg.inv(small.A))
    k, V = np.linalg.eigh(small.K0 - small.T.T @ inverse_A @ small.T)
    seen = k > 1e-9 * k[-1]
    k, V = k[seen], V[:, seen]
    z = V.T @ small.y
    freedom = 2 * M - 6 * S - G - len(k)
    if freedom < 1:
        return None
    noise2 = (small.cost - float(np.sum(z**2 / k))) / freedom
    print2, std = _print_variance(k, z, noise2)
    if print2 <= SIGNIFICANCE * std:
        return None
    return PrintErrors(
        sigma_m=float(np.sqrt(print2)),
        points=points,
        offsets_m=-(V @ (z / (k + noise2 / print2))).reshape(-1, 2),
        noise=float(np.sqrt(noise2)),
    )


def believed(problem: RigProblem, fit: RigFit, found: PrintErrors) -> RigFit:
    """The fit of corrected corners, with the noise and the covariance that their remaining doubt leaves."""
    points, index = np.unique(problem.points, return_inverse=True)
    small = _reduced(problem, fit, index, len(points))
    ridge = (found.noise / found.sigma_m) ** 2 * np.eye(len(small.K0))
    left = small.A - small.T @ np.linalg.solve(small.K0 + ridge, small.T.T)
    return replace(
        fit,
        noise_px=found.noise * float(np.sqrt(np.mean(problem.sigmas_px**2))),
        covariance=np.asarray(np.linalg.inv(left)) * found.noise**2,
    )


def _print_variance(k: Floats, z: Floats, noise2: float) -> tuple[float, float]:
    """Variance of the print, from z² / k = s² + v² k on average, and its standard deviation."""
    print2 = 0.0
    for _ in range(ROUNDS):
        weights = 1.0 / (noise2 + print2 * k) ** 2
        print2 = max(float(weights @ (z**2 - noise2 * k)) / float(weights @ k**2), 0.0)
    weights = 1.0 / (noise2 + print2 * k) ** 2
    return print2, float(np.sqrt(2.0 / (weights @ k**2)))


def _reduced(problem: RigProblem, fit: RigFit, index: Ints, P: int) -> _Reduced:
    """Information on cameras and corners, every shot's pose eliminated."""
    S = len(fit.Ts_head_target)
    T_head_target = fit.Ts_head_target[problem.slots]
    lever = (T_head_target[:, :3, :3] @ problem.points_target[:, :, None])[:, :, 0]
    points_head = lever + T_head_target[:, :3, 3]
    _, by_head, J, _ = rig_pixels(fit.rig, problem.cameras, points_head, problem.unknowns)
    weight = 1.0 / problem.sigmas_px[:, None, None]
    J, J_own = J * weight, np.concatenate([by_head, -by_head @ hat(lever)], axis=2) * weight
    B = by_head @ T_head_target[:, :3, :2] * weight
    r = fit.residuals_px * weight[:, 0]
    starts = np.searchsorted(problem.slots, np.arange(S))
    own = np.add.reduceat(np.swapaxes(J_own, 1, 2) @ J_own, starts)
    by_cameras = np.add.reduceat(np.swapaxes(J_own, 1, 2) @ J, starts)
    by_corner = np.zeros((S, P, 6, 2))
    np.add.at(by_corner, (problem.slots, index), np.swapaxes(J_own, 1, 2) @ B)
    by_both = np.concatenate([by_cameras, by_corner.transpose(0, 2, 1, 3).reshape(S, 6, 2 * P)], axis=2)
    absorbed = np.tensordot(by_both, np.linalg.solve(own, by_both), axes=([0, 1], [0, 1]))
    G = J.shape[2]
    flat = J.reshape(2 * len(J), G)
    mixed, corners, y = np.zeros((P, G, 2)), np.zeros((P, 2, 2)), np.zeros((P, 2))
    np.add.at(mixed, index, np.swapaxes(J, 1, 2) @ B)
    np.add.at(corners, index, np.swapaxes(B, 1, 2) @ B)
    np.add.at(y, index, (np.swapaxes(B, 1, 2) @ r[:, :, None])[:, :, 0])
    K0 = np.zeros((P, 2, P, 2))
    K0[np.arange(P), :, np.arange(P), :] = corners
    return _Reduced(
        A=flat.T @ flat + np.diag(prior_information(problem)) - absorbed[:G, :G],
        T=mixed.transpose(1, 0, 2).reshape(G, 2 * P) - absorbed[:G, G:],
        K0=K0.reshape(2 * P, 2 * P) - absorbed[G:, G:],
        y=y.ravel(),
        cost=float(np.sum(r * r)),
    )
