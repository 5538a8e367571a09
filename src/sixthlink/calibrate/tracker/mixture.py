"""Which points of a sweep could be several circles', and which circle is each on?

Circles through three points compete by the distance that a third of all points keep: half of the points on another
circle do not disturb it. The best is refined on the points near it and taken away; then the best of the rest.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.tracker.coaxial import judges_of, nearest_circles, start_circles, triples_of, whitened
from sixthlink.calibrate.tracker.sweep import Sweep, subset
from sixthlink.geometry import Circle, Floats, Ints, beside_circle, circle_through

__all__ = ["FEWEST", "a_third_fits_better", "peeled"]

FEWEST = 5
"""Points that a circle of its own must have."""

ROUNDS = 8

OF_THE_BEST = 0.3
"""Share of the points whose distance judges a three-point circle."""


def _through_triples(sweep: Sweep) -> tuple[Circle, Floats]:
    """Circles through three points ``(T,)``, and the distance ``(T,)`` that a third of the points keep [m]."""
    triples = triples_of(sweep)
    through = circle_through(sweep.points_m[triples])
    if len(triples) == 0:
        return through, np.zeros(0)
    batch = Circle(through.centre_m[:, None], through.normal[:, None], through.radius_m[:, None])
    distances = np.linalg.norm(beside_circle(batch, sweep.points_m[judges_of(sweep)]), axis=2)
    # The three points on the circle do not count.
    N = distances.shape[1]
    return through, np.quantile(distances, min((3.0 + OF_THE_BEST * (N - 3.0)) / N, 1.0), axis=1)


def a_third_fits_better(sweep: Sweep, length_m: float) -> bool:
    """Whether some circle through three points keeps a third of the others within a length [m]."""
    _, quantiles = _through_triples(sweep)
    return len(quantiles) > 0 and float(quantiles.min()) < length_m


def peeled(sweep: Sweep) -> Ints:
    """Which circle each point is on ``(N,)``, -1 for none: the best circle first, then the best of the rest."""
    labels = np.full(len(sweep.points_m), -1, dtype=np.int64)
    for label in range(3):
        rest = np.flatnonzero(labels < 0)
        if len(rest) < FEWEST:
            break
        part = subset(sweep, labels < 0)
        inside = _best_circle(part)
        if inside is None or np.count_nonzero(inside) < FEWEST:
            break
        labels[rest[inside]] = label
    return _settled(sweep, labels)


def _settled(sweep: Sweep, labels: Ints) -> Ints:
    """Every point that is on some circle goes to the nearest, until none moves: the first to choose took too many."""
    grouped = labels >= 0
    for _ in range(ROUNDS):
        distances = []
        for label in range(int(labels.max()) + 1):
            own = subset(sweep, labels == label)
            if len(own.points_m) < FEWEST:
                return labels
            circles = nearest_circles(start_circles(own), own, np.ones(len(own.points_m)))
            distances.append(np.linalg.norm(whitened(circles, sweep)[0], axis=1))
        settled = np.where(grouped, np.argmin(distances, axis=0), -1) if distances else labels
        if (settled == labels).all():
            break
        labels = settled
    return labels


def _best_circle(part: Sweep) -> npt.NDArray[np.bool_] | None:
    """The points of the circle that fits a third of them best."""
    through, quantiles = _through_triples(part)
    if len(quantiles) == 0:
        return None
    winner = int(np.argmin(quantiles))
    best = Circle(through.centre_m[winner], through.normal[winner], through.radius_m[winner])
    nearest = np.linalg.norm(beside_circle(best, part.points_m), axis=1)
    noise_m = float(quantiles[winner]) / np.sqrt(-2.0 * np.log(1.0 - OF_THE_BEST))
    for _ in range(ROUNDS):
        inside = nearest <= 5.0 * noise_m + 10.0 * part.rounding_m
        if np.count_nonzero(inside) < 4:
            return None
        own = subset(part, inside)
        circles = nearest_circles(start_circles(own), own, np.ones(len(own.points_m)))
        nearest = np.linalg.norm(whitened(circles, part)[0], axis=1)
        dof = max(2 * int(np.count_nonzero(inside)) - 6, 1)
        noise_m = float(np.sqrt(np.sum(nearest[inside] ** 2) / dof))
    return nearest <= 5.0 * noise_m + 10.0 * part.rounding_m
