"""What do cameras, the heights of a bent target and the places of its corners have to do with each other?

The normal equations of all of them, the poses of the shots eliminated. Corners may be off in the target's plane, alike
in all views (:mod:`sixthlink.calibrate.print_errors`); heights are along shapes (:mod:`~.board_shape`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, free_terms, prior_information
from sixthlink.camera import rig_pixels
from sixthlink.geometry import Floats, Ints, hat

__all__ = ["CornerSpread", "CornerSystem", "corner_spread", "corner_system"]

SIGNIFICANCE = 2.0
"""Standard deviations by which the print's variance must stand out from zero."""

ROUNDS = 20

LEAST_NOISE = 1e-6
"""Share of the squared residuals that is noise at least: large offsets explain more than all of it at first."""


@dataclass(frozen=True, eq=False)
class CornerSystem:
    """Normal equations of G + K shared unknowns, lenses, cameras and heights, and of 2 P offsets of corners.

    Attributes:
        points: ``(P,)`` the corners.
        A: ``(G + K, G + K)`` information on the shared unknowns, with what was known of lenses beforehand.
        T: ``(G + K, 2 P)`` between these and the corners.
        K0: ``(2 P, 2 P)`` on the corners.
        y: ``(2 P,)`` gradient by the corners.
        gradient: ``(G + K,)`` by the shared unknowns.
        shares: ``(P, G + K)`` each corner's share of it.
        cost: Whitened sum of squares.
        freedom: Pixel coordinates less unknowns, the corners not counted.
    """

    points: Ints
    A: Floats
    T: Floats
    K0: Floats
    y: Floats
    gradient: Floats
    shares: Floats
    cost: float
    freedom: int


@dataclass(frozen=True, eq=False)
class CornerSpread:
    """How far corners are off, as a whole.

    Attributes:
        k: ``(N,)`` eigenvalues of the information on the corners, the shared unknowns eliminated.
        V: ``(2 P, N)`` their directions.
        z: ``(N,)`` gradient along these, at corners that are where they should be.
        noise2: Variance of a whitened pixel coordinate without the print's part.
        print2_m2: Variance of a corner's coordinate [m²]; 0 where none stands out.
    """

    k: Floats
    V: Floats
    z: Floats
    noise2: float
    print2_m2: float

    @property
    def ridge(self) -> float:
        """What is known of the corners beforehand, as information in whitened pixels [1/m²]."""
        return self.noise2 / self.print2_m2


def corner_system(problem: RigProblem, fit: RigFit, shapes: Floats | None = None) -> CornerSystem:
    """The normal equations at a fit.

    Args:
        problem: Observations, with the number of the corner in each row.
        fit: The best explanation with the corners where the problem says.
        shapes: ``(P', K)`` heights of all points of the target along its z per unit of each unknown, if there are any.
    """
    S, M = len(fit.Ts_head_target), len(problem.slots)
    points, index = np.unique(problem.points, return_inverse=True)
    P = len(points)
    T_head_target = fit.Ts_head_target[problem.slots]
    lever = (T_head_target[:, :3, :3] @ problem.points_target[:, :, None])[:, :, 0]
    _, by_head, J, _ = rig_pixels(fit.rig, problem.cameras, lever + T_head_target[:, :3, 3], problem.unknowns)
    G, weight = J.shape[2], 1.0 / problem.sigmas_px[:, None, None]
    by_point = by_head @ T_head_target[:, :3, :3] * weight
    shared, B = J * weight, by_point[:, :, :2]
    if shapes is not None:
        shared = np.concatenate([shared, by_point[:, :, 2:] * shapes[problem.points][:, None, :]], axis=2)
    own = np.concatenate([by_head, -by_head @ hat(lever)], axis=2) * weight
    r = fit.residuals_px * weight[:, 0]
    starts, of_own = np.searchsorted(problem.slots, np.arange(S)), np.swapaxes(own, 1, 2)
    own_information = np.add.reduceat(of_own @ own, starts)
    every = np.concatenate([shared, r[:, :, None]], axis=2)
    absorbed = np.linalg.solve(own_information, np.add.reduceat(of_own @ every, starts))
    # What no pose of the target explains too.
    every = every - own @ absorbed[problem.slots]
    shared, r = every[:, :, :-1], every[:, :, -1]
    of_shared, of_corner = np.swapaxes(shared, 1, 2), np.swapaxes(B, 1, 2)
    A = np.asarray(np.sum(of_shared @ shared, axis=0))
    before = prior_information(problem)
    A[:G, :G] += np.diag(before)
    crossed, shares, y = np.zeros((P, shared.shape[2], 2)), np.zeros((P, shared.shape[2])), np.zeros((P, 2))
    np.add.at(crossed, index, of_shared @ B)
    np.add.at(shares, index, (of_shared @ r[:, :, None])[:, :, 0])
    np.add.at(y, index, (of_corner @ r[:, :, None])[:, :, 0])
    gradient = shares.sum(axis=0)
    gradient[:G] += before * free_terms(problem, fit.rig)
    corners, own_corner = np.zeros((P, 2, 2)), np.zeros((S, P, 6, 2))
    np.add.at(corners, index, of_corner @ B)
    np.add.at(own_corner, (problem.slots, index), of_own @ B)
    K0 = np.zeros((P, 2, P, 2))
    K0[np.arange(P), :, np.arange(P), :] = corners
    by_pose = own_corner.transpose(0, 2, 1, 3).reshape(S, 6, 2 * P)
    explained = np.tensordot(by_pose, np.linalg.solve(own_information, by_pose), axes=([0, 1], [0, 1]))
    return CornerSystem(
        points=points,
        A=A,
        T=crossed.transpose(1, 0, 2).reshape(-1, 2 * P),
        K0=K0.reshape(2 * P, 2 * P) - explained,
        y=y.ravel(),
        gradient=gradient,
        shares=shares,
        cost=float(np.sum(r * r)),
        freedom=2 * M - 6 * S - shared.shape[2],
    )


def corner_spread(system: CornerSystem, offsets_m: Floats) -> CornerSpread | None:
    """Variances of the noise and of the print; None where the views are too few to tell one from the other.

    Args:
        system: The normal equations with the corners off by ``offsets_m``.
        offsets_m: ``(2 P,)``.
    """
    solved = np.linalg.solve(system.A, np.column_stack([system.T, system.gradient]))
    K, y = system.K0 - system.T.T @ solved[:, :-1], system.y - system.T.T @ solved[:, -1]
    cost = system.cost - float(system.gradient @ solved[:, -1])
    k, V = np.linalg.eigh(K)
    seen = k > 1e-9 * k[-1]
    k, V = k[seen], V[:, seen]
    freedom = system.freedom - len(k)
    if freedom < 1:
        return None
    # What corners are off by already is part of their whole offset, of which the print's variance speaks.
    left, z = V.T @ y, V.T @ (y - K @ offsets_m)
    noise2 = max(cost - float(np.sum(left**2 / k)), LEAST_NOISE * system.cost) / freedom
    print2, std = _print_variance(k, z, noise2)
    return CornerSpread(k, V, z, noise2, print2 if print2 > SIGNIFICANCE * std else 0.0)


def _print_variance(k: Floats, z: Floats, noise2: float) -> tuple[float, float]:
    """Variance of the print, from z² / k = s² + v² k on average, and its standard deviation."""
    print2 = 0.0
    for _ in range(ROUNDS):
        weights = 1.0 / (noise2 + print2 * k) ** 2
        print2 = max(float(weights @ (z**2 - noise2 * k)) / float(weights @ k**2), 0.0)
    weights = 1.0 / (noise2 + print2 * k) ** 2
    return print2, float(np.sqrt(2.0 / (weights @ k**2)))
