"""Which points of a sweep belong to its circles, and how large is their noise?

A point belongs when its distance from the circles that the *others* make is no larger than chance makes the largest
of all. The first look decides who the others are: all points if the plain fit looks sane, otherwise those that a
heavy-tailed fit, started from the best of many three-point circles, finds close. Equations (C6) to (C8) of
docs/theory/circle_points.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.tracker.coaxial import (
    Coaxial,
    nearest_circles,
    normal_covariance,
    robust_start,
    start_circles,
    whitened,
)
from sixthlink.calibrate.tracker.mixture import a_third_fits_better
from sixthlink.calibrate.tracker.sweep import Sweep
from sixthlink.geometry import Floats

__all__ = ["Belonging", "belonging", "freedom", "limit", "noise_variance"]

FALSE_ALARM = 1e-3
"""Share of good sweeps in which one good point is left out."""

STUDENT = 3.0
"""Degrees of freedom of the heavy-tailed loss."""

SANE = 1.5
"""Ratio of the RMS to the noise of the median up to which the plain fit needs no second look."""

BETTER = 3.0
"""Times nearer that a third of the points may be to a circle through three of them; more is not chance."""

CLOSE = 3.5
"""Times the noise of the median within which a point founds the first set."""

ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Belonging:
    """Circles, and the points that made them.

    Attributes:
        circles: The least-squares circles of the points that belong.
        kept: ``(N,)`` whether each point belongs.
    """

    circles: Coaxial
    kept: npt.NDArray[np.bool_]


def freedom(kept: npt.NDArray[np.bool_], sweep: Sweep) -> int:
    """Degrees of freedom: two parts of each distance, less the unknowns of axis and circles that have points."""
    return 2 * int(np.count_nonzero(kept)) - 4 - 2 * len(np.unique(sweep.reflectors[kept]))


def limit(points: int, dof: float) -> float:
    """Squared whitened distance, in units of the noise's variance, that the largest of so many points may have (C8).

    The closed forms of F(2, dof) and, where the noise is known (dof infinite), of χ² with two degrees of freedom.
    """
    chance = FALSE_ALARM / max(points, 1)
    if not np.isfinite(dof):
        return -2.0 * float(np.log(chance))
    return dof * (chance ** (-2.0 / dof) - 1.0)


def noise_variance(r: Floats, kept: npt.NDArray[np.bool_], sweep: Sweep) -> float:
    """Variance of whitened deviations, never below the rounding of the coordinates."""
    return max(float(np.sum(r[kept] ** 2)) / max(freedom(kept, sweep), 1), _floor(sweep))


def belonging(sweep: Sweep) -> Belonging:
    """Fit the circles and tell which points belong to them."""
    every = np.ones(len(sweep.points_m), dtype=bool)
    circles = nearest_circles(start_circles(sweep), sweep, every.astype(np.float64))
    r = whitened(circles, sweep)[1]
    dof = freedom(every, sweep)
    # Two of five points left out would leave nothing to judge by.
    if dof < 6 or (_sane(r, dof, sweep) and bool(_belongs(circles, sweep, every).all())):
        return Belonging(circles, every)
    return _grown(*_first_set(sweep), sweep)


def _floor(sweep: Sweep) -> float:
    """Smallest variance that is not rounding; in units of the stated noise where there is one."""
    if sweep.covariances_m2 is None:
        return sweep.rounding_m**2
    return sweep.rounding_m**2 / float(np.trace(sweep.covariances_m2, axis1=1, axis2=2).mean() / 3.0)


def _median_variance(r: Floats, dof: int, sweep: Sweep) -> float:
    """Variance by the median, which outliers hardly move; 2 ln 2 is the median of χ² with two degrees of freedom."""
    median = float(np.median(np.sum(r**2, axis=1))) / (2.0 * np.log(2.0))
    return max(median * 2.0 * len(r) / max(dof, 1), _floor(sweep))


def _sane(r: Floats, dof: int, sweep: Sweep) -> bool:
    """Whether the plain fit looks like noise: by its own median, and by what is stated or by what others could fit.

    One point that is far off may swing a short arc so that all points are off alike.
    """
    variance = float(np.sum(r**2)) / dof
    if variance > SANE**2 * _median_variance(r, dof, sweep):
        return False
    if sweep.covariances_m2 is not None:
        return variance < SANE**2
    return variance <= 2.0 * _floor(sweep) or not a_third_fits_better(sweep, float(np.sqrt(variance)) / BETTER)


def _first_set(sweep: Sweep) -> tuple[Coaxial, npt.NDArray[np.bool_]]:
    """Circles of a Student loss (C6), and the points close to them."""
    circles = robust_start(sweep)
    every = np.ones(len(sweep.points_m), dtype=bool)
    dof = freedom(every, sweep)
    for _ in range(4):
        r = whitened(circles, sweep)[1]
        weights = (STUDENT + 2.0) / (STUDENT + np.sum(r**2, axis=1) / _median_variance(r, dof, sweep))
        circles = nearest_circles(circles, sweep, weights)
    r = whitened(circles, sweep)[1]
    close = np.sum(r**2, axis=1) <= CLOSE**2 * _median_variance(r, dof, sweep)
    return circles, close


def _grown(circles: Coaxial, kept: npt.NDArray[np.bool_], sweep: Sweep) -> Belonging:
    """Refit and judge again until nobody enters or leaves."""
    seen: set[bytes] = set()
    for _ in range(ROUNDS):
        circles = nearest_circles(circles, sweep, kept.astype(np.float64))
        belongs = _belongs(circles, sweep, kept)
        if (belongs == kept).all() or belongs.tobytes() in seen or freedom(belongs, sweep) < 2:
            break
        seen.add(belongs.tobytes())
        kept = belongs
    return Belonging(circles, kept)


def _belongs(circles: Coaxial, sweep: Sweep, kept: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Whether each point is no further from the circles of the others than chance allows (C7, C8).

    It must be too far for its own sweep's noise and, where noise is stated, for that as well.
    """
    _, r, J = whitened(circles, sweep)
    H = J @ normal_covariance(J[kept]) @ np.swapaxes(J, 1, 2)
    # A point that made the circles has drawn them to itself: the covariance of its deviation is smaller, not larger.
    S = np.eye(2) + np.where(kept, -1.0, 1.0)[:, None, None] * H
    S = S + 1e-9 * np.eye(2)
    d2 = np.einsum("ni,nij,nj->n", r, np.linalg.inv(S), r)
    dof, total = freedom(kept, sweep), float(np.sum(r[kept] ** 2))
    own_dof = np.where(kept, dof - 2.0, float(dof))
    others = np.maximum((total - np.where(kept, d2, 0.0)) / np.maximum(own_dof, 1.0), _floor(sweep))
    limits = np.array([limit(len(r), d) if d > 0 else np.inf for d in (dof - 2.0, float(dof))])
    far = d2 > others * np.where(kept, limits[0], limits[1])
    if sweep.covariances_m2 is not None:
        far &= d2 > limit(len(r), np.inf)
    return ~far
