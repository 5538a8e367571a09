"""Is the board flat?

Paper on a warped plate, or a plate screwed down askew, bends by tenths of a millimetre: enough to bend lens and head
along. A bent board is z = h·φ over shapes φ, polynomials of the place on the board without mean or slope, because those
are a matter of the pose: to second order three, curved along x, along y, and twisted; to third order seven, to fourth
twelve. A sheet that was printed and then bent does not stretch: its points come nearer to each other as seen from the
front, by the displacements (u, v) that leave least strain,

    u_x + z_x² / 2,   v_y + z_y² / 2,   u_y + v_x + z_x z_y                              (S7)

A plate that was bent when it was printed has its points above where they should be. The views tell which. With lenses,
camera poses and target poses free, they tell h and its covariance; an order enters where it stands out from both noise
and what is worth telling.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from sixthlink.calibrate.corner_system import CornerSystem, corner_spread, corner_system
from sixthlink.calibrate.rig_refinement import RigFit, RigProblem, refine_rig
from sixthlink.calibrate.unexplained import weighed
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats, Ints, frozen_floats
from sixthlink.target import turn_names

__all__ = ["BoardShape", "board_shape"]

FALSE_ALARM = 1e-6
"""Chance of a flat board that is called bent: lens terms that no model has look a little like a bend."""

WORTH_TELLING_M = 2e-5
"""Sag below which a board counts as flat."""

EXPLAINED = 0.01
"""Share of the squared residuals that a bend must explain: what is significant only because there are many points, and
leaves the residuals as they were, is the lens model's affair."""

ORDERS, MOST_DRAWN_IN = (2, 3, 4), 5
"""Orders of the bend that are tried, and the highest of what it does to places on the board."""

LEAST_SHAPE = 0.01
"""Smallest against largest shape, below which the points are too few to tell shapes apart."""

ROUNDS, SETTLED_M = 8, 1e-7
FEWEST_SHOTS, CORNERS_PER_SHAPE = 5, 4


@dataclass(frozen=True, eq=False)
class BoardShape:
    """How a board is bent.

    Attributes:
        offsets_m: ``(P, 3)`` from every point of the flat board to where it is [m].
        sag_m: Largest minus smallest of them along the board's z [m].
        sag_std_m: Standard deviation of it [m].
        explained: Share of the squared residuals that the bend explains.
    """

    offsets_m: Floats
    sag_m: float
    sag_std_m: float
    explained: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "offsets_m", frozen_floats(self.offsets_m, (None, 3), "offsets_m"))


@dataclass(frozen=True, eq=False)
class _Sheet:
    """What bends of one order are made of.

    Attributes:
        shapes: ``(P, K)`` of about unit size, without mean or slope.
        slopes: ``(2, P, K)`` their derivatives by x and by y [1/m].
        drifts: ``(P, B)`` what places on the board may be moved by.
        drift_slopes: ``(2, P, B)`` their derivatives [1/m].
        stretches: Whether its points stay above their places.
    """

    shapes: Floats
    slopes: Floats
    drifts: Floats
    drift_slopes: Floats
    stretches: bool = False


@dataclass(frozen=True, eq=False)
class _Bend:
    """A bend: problem and fit that know of it, where it puts the points, its evidence and the chance to seem one."""

    problem: RigProblem
    fit: RigFit
    offsets_m: Floats
    cost: float
    unknowns: int
    sag_std_m: float
    chance: float


def board_shape(
    problem: RigProblem, fit: RigFit, points_m: Floats, stated_px: Floats, turn: Ints | None = None
) -> tuple[BoardShape, RigProblem, RigFit] | None:
    """The bend that the images show, with the problem and the fit that know of it; None where they show none.

    Args:
        problem: Observations.
        fit: Their best explanation by a flat board.
        points_m: ``(P, 3)`` points of the target [m].
        stated_px: ``(M,)`` standard deviation of each coordinate, as the detector states it [pixel].
        turn: ``(P,)`` index of each point after a turn that leaves the target as it is, if there is one: shots may have
            been read from either end.
    """
    if len(fit.Ts_head_target) < FEWEST_SHOTS or np.ptp(points_m[:, 2]) > 0.0:
        return None
    names = turn_names(turn, len(points_m))
    flat_cost = _cost(problem, fit.residuals_px)
    flat = best = _Bend(problem, fit, np.zeros_like(points_m), flat_cost, 0, 0.0, 0.0)
    for order in ORDERS:
        sheet = _sheet(points_m, names, order)
        if sheet is None or len(np.unique(names.min(axis=0))) < CORNERS_PER_SHAPE * sheet.shapes.shape[1]:
            break
        K = sheet.shapes.shape[1]
        if best.unknowns == K:
            continue
        first = _step(corner_system(best.problem, best.fit, sheet.shapes), names, K)
        if _chance(*first, best.unknowns) >= FALSE_ALARM:
            continue
        sheets = sheet, replace(sheet, stretches=True)
        try:
            bends = [_bent(flat, k, names, best.unknowns, stated_px) for k in sheets]
        except CalibrationError:  # it ran away: something else than a bend is wrong
            continue
        tried = min(bends, key=lambda bend: bend.cost)
        more_m = float(np.ptp(tried.offsets_m[:, 2] - best.offsets_m[:, 2]))
        if tried.chance < FALSE_ALARM and more_m > WORTH_TELLING_M and tried.cost < (1.0 - EXPLAINED) * best.cost:
            best = tried
    if best is flat:
        return None
    sag_m = float(np.ptp(best.offsets_m[:, 2]))
    shape = BoardShape(best.offsets_m, sag_m, best.sag_std_m, 1.0 - best.cost / flat_cost)
    return shape, best.problem, best.fit


def _bent(flat: _Bend, sheet: _Sheet, names: Ints, known: int, stated_px: Floats) -> _Bend:
    """The bend by which a sheet explains the views best, and whether chance explains all but its ``known`` shapes."""
    shapes = sheet.shapes
    problem, fit, heights, offsets = flat.problem, flat.fit, np.zeros(shapes.shape[1]), flat.offsets_m
    for _ in range(ROUNDS):
        step, _, _ = _step(corner_system(problem, fit, shapes), names, len(heights))
        heights = heights + step
        offsets = np.column_stack([_drawn_in(sheet, heights), shapes @ heights])
        problem = replace(problem, points_target=flat.problem.points_target + offsets[problem.points])
        problem, fit = weighed(problem, refine_rig(problem, fit.rig, fit.Ts_head_target), stated_px)
        if np.abs(shapes @ step).max() < SETTLED_M:
            break
    _, covariance, freedom = _step(corner_system(problem, fit, shapes), names, len(heights))
    between = shapes[np.argmax(offsets[:, 2])] - shapes[np.argmin(offsets[:, 2])]
    return _Bend(
        problem=problem,
        fit=fit,
        offsets_m=offsets,
        cost=_cost(flat.problem, fit.residuals_px),
        unknowns=len(heights),
        sag_std_m=float(np.sqrt(between @ covariance @ between)),
        chance=_chance(heights, covariance, freedom, known),
    )


def _chance(heights: Floats, covariance: Floats, freedom: int, known: int) -> float:
    """How often chance alone makes heights beyond the first ``known`` as large as these (F test)."""
    new, C = heights[known:], covariance[known:, known:]
    return float(fdtrc(len(new), freedom, new @ np.linalg.solve(C, new) / len(new)))


def _step(system: CornerSystem, names: Ints, K: int) -> tuple[Floats, Floats, int]:
    """Best change of the last K unknowns, the heights, their covariance and its degrees of freedom.

    Corners err alike in all views. Where they are surely the same ones, their offsets are unknowns; where one may have
    been taken for another, its share of the gradient and the other's are one draw (Liang and Zeger 1986).
    """
    gradient, A = system.gradient, system.A
    if len(names) == 1:
        spread = corner_spread(system, np.zeros(len(system.y)))
        noise2 = system.cost / max(system.freedom, 1) if spread is None else spread.noise2
        if spread is not None and spread.print2_m2 > 0.0:
            ridge = spread.ridge * np.eye(len(system.y))
            solved = np.linalg.solve(system.K0 + ridge, np.column_stack([system.T.T, system.y]))
            A, gradient = A - system.T @ solved[:, :-1], gradient - system.T @ solved[:, -1]
        inverse = np.asarray(np.linalg.inv(A))
        return -(inverse @ gradient)[-K:], noise2 * inverse[-K:, -K:], max(system.freedom, 1)
    inverse = np.asarray(np.linalg.inv(A))
    _, same = np.unique(names[:, system.points].min(axis=0), return_inverse=True)
    draws = np.zeros((same.max() + 1, K))
    np.add.at(draws, same, system.shares @ inverse[-K:].T)
    freedom = max(len(draws) - K, 1)
    return -(inverse @ gradient)[-K:], draws.T @ draws * (len(draws) / freedom), freedom


def _sheet(points_m: Floats, names: Ints, order: int) -> _Sheet | None:
    """Shapes of one order at the points that look alike from every end; None where points are too few for them."""
    centred = points_m[:, :2] - points_m[:, :2].mean(axis=0)
    size_m = np.full(2, np.abs(centred).max().clip(1e-12))
    parts = []
    for degree in range(2, order + 1):
        shapes, slopes = _monomials(centred, size_m, degree, degree)
        turned = np.mean([np.linalg.lstsq(shapes, shapes[k], rcond=None)[0] for k in names], axis=0)
        U, share, _ = np.linalg.svd(turned)
        parts.append((shapes @ U[:, share > 0.5], slopes @ U[:, share > 0.5]))
    shapes, slopes = (np.concatenate(k, axis=-1) for k in zip(*parts, strict=True))
    plane = np.column_stack([np.ones(len(centred)), centred])
    tilt = np.linalg.lstsq(plane, shapes, rcond=None)[0]
    shapes, slopes = shapes - plane @ tilt, slopes - tilt[1:, None]
    sizes = np.linalg.svd(shapes, compute_uv=False)
    if len(sizes) < shapes.shape[1] or sizes[-1] < LEAST_SHAPE * sizes[0]:
        return None
    return _Sheet(shapes, slopes, *_monomials(centred, size_m, 1, min(2 * order - 1, MOST_DRAWN_IN)))


def _monomials(centred: Floats, size_m: Floats, lowest: int, highest: int) -> tuple[Floats, Floats]:
    """Products ``(P, K)`` of powers of x and y, scaled, with these sums of powers, and derivatives ``(2, P, K)``."""
    i, j = np.array([(n - j, j) for n in range(lowest, highest + 1) for j in range(n + 1)]).T
    x, y = (centred / size_m).T[:, :, None]
    slopes = [i * x ** np.maximum(i - 1, 0) * y**j / size_m[0], j * x**i * y ** np.maximum(j - 1, 0) / size_m[1]]
    return x**i * y**j, np.stack(slopes)


def _drawn_in(sheet: _Sheet, heights: Floats) -> Floats:
    """How far the points ``(P, 2)`` of a sheet are moved along it, on average nowhere [m]."""
    if sheet.stretches:
        return np.zeros((len(sheet.shapes), 2))
    z_x, z_y = sheet.slopes @ heights
    u_x, u_y = sheet.drift_slopes
    nothing = np.zeros_like(u_x)
    strains = np.block([[u_x, nothing], [nothing, u_y], [u_y, u_x]])
    wanted = -np.concatenate([0.5 * z_x**2, 0.5 * z_y**2, z_x * z_y])
    moved = sheet.drifts @ np.linalg.lstsq(strains, wanted, rcond=None)[0].reshape(2, -1).T
    return np.asarray(moved - moved.mean(axis=0))


def _cost(problem: RigProblem, residuals_px: Floats) -> float:
    return float(np.sum((residuals_px / problem.sigmas_px[:, None]) ** 2))
