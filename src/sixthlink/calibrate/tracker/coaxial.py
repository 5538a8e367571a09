"""Which coaxial circles come nearest to the points of a sweep?

The unknowns are one axis (two shifts across it, two tilts) and, per reflector, height and radius: six numbers for one
circle. A point's distance from its circle has two parts, outside and above; both are weighed by what the point's
covariance says across the circle. Where along the circle a point lies is not asked. Equations (C1) to (C5) of
docs/theory/circle_points.md.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.tracker.sweep import Sweep
from sixthlink.geometry import Floats, Ints, across_axes, circle_through

__all__ = [
    "Coaxial",
    "judges_of",
    "nearest_circles",
    "normal_covariance",
    "phase_rows",
    "phases_of",
    "refooted",
    "reversed_axis",
    "robust_start",
    "start_circles",
    "triples_of",
    "whitened",
]

TRIPLES = 100
"""Circles through three points that compete with the one through all."""

JUDGES = 1000
"""Points that judge such circles: enough for a median, however long the sweep is."""

ITERATIONS = 60

CONVERGED = 1e-13
"""Step, as a share of the points' extent, that ends the iteration."""


@dataclass(frozen=True, eq=False)
class Coaxial:
    """Circles about one axis.

    Attributes:
        frame: ``(3, 3)`` rows: two unit vectors across the axis and its direction.
        origin_m: ``(3,)`` a point of the axis [m].
        heights_m: ``(M,)`` centre of each circle along the axis from the origin [m].
        radii_m: ``(M,)`` [m].
    """

    frame: Floats
    origin_m: Floats
    heights_m: Floats
    radii_m: Floats


def _parts(circles: Coaxial, sweep: Sweep) -> tuple[Floats, Floats, Floats]:
    """Deviations ``(N, 2)`` outside and above [m], spokes ``(N, 3)`` in the frame, distances from the axis ``(N,)``."""
    v = (sweep.points_m - circles.origin_m) @ circles.frame.T
    distances = np.hypot(v[:, 0], v[:, 1])
    outside = distances - circles.radii_m[sweep.reflectors]
    above = v[:, 2] - circles.heights_m[sweep.reflectors]
    return np.column_stack([outside, above]), v, distances


def _whitening(circles: Coaxial, sweep: Sweep, v: Floats, distances: Floats) -> Floats | None:
    """Inverse Cholesky factors ``(N, 2, 2)`` of the covariance of (outside, above) (C3); None stands for one metre."""
    if sweep.covariances_m2 is None:
        return None
    P = np.zeros((len(v), 2, 3))
    P[:, 0] = (v[:, :2] / np.maximum(distances, sweep.rounding_m)[:, None]) @ circles.frame[:2]
    P[:, 1] = circles.frame[2]
    # The rounding lets points that stand on the axis, whose spoke has no direction, still have a covariance.
    S = P @ sweep.covariances_m2 @ np.swapaxes(P, 1, 2) + sweep.rounding_m**2 * np.eye(2)
    return np.linalg.inv(np.linalg.cholesky(S))


def _jacobian(v: Floats, distances: Floats, sweep: Sweep) -> Floats:
    """Derivative ``(N, 2, 4 + 2M)`` of (outside, above) by shifts, tilts, then height and radius per circle (C4)."""
    N, M = len(v), len(sweep.names)
    spoke = v[:, :2] / np.maximum(distances, sweep.rounding_m)[:, None]
    J = np.zeros((N, 2, 4 + 2 * M))
    J[:, 0, 0:2] = -spoke
    J[:, 0, 2:4] = -v[:, 2:3] * spoke
    J[:, 1, 2:4] = v[:, :2]
    row = np.arange(N)
    J[row, 1, 4 + 2 * sweep.reflectors] = -1.0
    J[row, 0, 5 + 2 * sweep.reflectors] = -1.0
    return J


def whitened(circles: Coaxial, sweep: Sweep) -> tuple[Floats, Floats, Floats]:
    """Deviations ``(N, 2)`` [m], and whitened deviations ``(N, 2)`` and Jacobian ``(N, 2, 4 + 2M)``.

    Where no noise is stated, whitening divides by one metre.
    """
    deviations, v, distances = _parts(circles, sweep)
    J = _jacobian(v, distances, sweep)
    W = _whitening(circles, sweep, v, distances)
    if W is None:
        return deviations, deviations, J
    return deviations, (W @ deviations[:, :, None])[:, :, 0], W @ J


def nearest_circles(circles: Coaxial, sweep: Sweep, weights: Floats) -> Coaxial:
    """Gauss-Newton to the least weighted sum of squares, from a start, with halved steps where it would rise.

    Args:
        circles: The start.
        sweep: The points.
        weights: ``(N,)`` weights of the squares; 0 leaves a point out.
    """
    root = np.sqrt(weights)[:, None]
    extent = float(np.linalg.norm(np.ptp(sweep.points_m, axis=0))) + sweep.rounding_m
    units = np.r_[extent, extent, 1.0, 1.0, np.full(2 * len(sweep.names), extent)]
    for _ in range(ITERATIONS):
        deviations, v, distances = _parts(circles, sweep)
        W = _whitening(circles, sweep, v, distances)
        J = _jacobian(v, distances, sweep)
        r = root * (deviations if W is None else (W @ deviations[:, :, None])[:, :, 0])
        J = root[:, :, None] * (J if W is None else W @ J)
        step = units * np.linalg.lstsq(J.reshape(-1, len(units)) * units, -r.reshape(-1), rcond=1e-14)[0]
        before = float(np.sum(r**2))
        for _ in range(30):
            moved = _moved(circles, step)
            after = _parts(moved, sweep)[0]
            after = root * (after if W is None else (W @ after[:, :, None])[:, :, 0])
            if float(np.sum(after**2)) <= before * (1.0 + 1e-12):
                break
            step = 0.5 * step
        else:
            return circles
        circles = moved
        if float(np.abs(step / units).max()) < CONVERGED:
            break
    return circles


def normal_covariance(J: Floats) -> Floats:
    """Inverse of JᵀJ for whitened rows ``(N, 2, P)``, by QR of scaled columns."""
    flat = J.reshape(-1, J.shape[2])
    scale = np.maximum(np.linalg.norm(flat, axis=0), np.finfo(np.float64).tiny)
    half: Floats = np.linalg.pinv(np.linalg.qr(flat / scale, mode="r"), rcond=1e-13) / scale[:, None]
    return half @ half.T


def refooted(circles: Coaxial, sweep: Sweep, weights: Floats) -> Coaxial:
    """The same circles, the origin at the mean height of the points that count: there shifts and tilts part best."""
    height = float(np.average(circles.heights_m[sweep.reflectors], weights=weights))
    origin = circles.origin_m + height * circles.frame[2]
    return Coaxial(circles.frame, origin, circles.heights_m - height, circles.radii_m)


def reversed_axis(circles: Coaxial) -> Coaxial:
    """The same circles with the axis pointing the other way."""
    frame = across_axes(-circles.frame[2])
    return Coaxial(frame, circles.origin_m, -circles.heights_m, circles.radii_m)


def phases_of(circles: Coaxial, sweep: Sweep) -> Floats:
    """Phase ``(N,)`` of every point about the axis, from the first row of the frame [rad]."""
    v = _parts(circles, sweep)[1]
    return np.arctan2(v[:, 1], v[:, 0])


def phase_rows(circles: Coaxial, sweep: Sweep) -> Floats:
    """Derivative ``(N, 4)`` of the phases by shifts and tilts of the axis, the frame kept."""
    _, v, distances = _parts(circles, sweep)
    forward = np.column_stack([-v[:, 1], v[:, 0]]) / np.maximum(distances, sweep.rounding_m)[:, None] ** 2
    return np.concatenate([-forward, -v[:, 2:3] * forward], axis=1)


def _moved(circles: Coaxial, step: Floats) -> Coaxial:
    """Shift and tilt the axis, add to heights and radii; the frame turns with the least turn."""
    e1, e2, n = circles.frame
    frame = across_axes(n + step[2] * e1 + step[3] * e2)
    origin = circles.origin_m + step[0] * e1 + step[1] * e2
    return Coaxial(frame, origin, circles.heights_m + step[4::2], circles.radii_m + step[5::2])


def start_circles(sweep: Sweep) -> Coaxial:
    """Circles without a guess: plane by SVD, algebraic centre (C5)."""
    p, M = sweep.points_m, len(sweep.names)
    counts = np.bincount(sweep.reflectors, minlength=M)[:, None]
    means = np.stack([np.bincount(sweep.reflectors, p[:, k], M) for k in range(3)], axis=1) / counts
    frame = across_axes(np.linalg.svd(p - means[sweep.reflectors], full_matrices=False)[2][2])
    origin = p.mean(axis=0)
    v = (p - origin) @ frame.T
    rows = np.zeros((len(p), 2 + M))
    rows[:, :2] = 2.0 * v[:, :2]
    rows[np.arange(len(p)), 2 + sweep.reflectors] = 1.0
    centre = np.linalg.lstsq(rows, np.sum(v[:, :2] ** 2, axis=1), rcond=None)[0][:2]
    return _with_sizes(frame, origin + centre @ frame[:2], sweep, np.mean)


def robust_start(sweep: Sweep) -> Coaxial:
    """The circles with the least median distance: through all points, or about the axis of three points."""
    best = start_circles(sweep)
    triples = triples_of(sweep)
    if len(triples) == 0:
        return best
    through = circle_through(sweep.points_m[triples])
    judges = judges_of(sweep)
    reflectors = sweep.reflectors[judges]
    v = sweep.points_m[judges] - through.centre_m[:, None]
    above = np.sum(v * through.normal[:, None], axis=2)
    outside = np.linalg.norm(v - above[:, :, None] * through.normal[:, None], axis=2)
    for k in np.unique(reflectors).tolist():
        here = reflectors == k
        for part in (above, outside):
            part[:, here] -= np.median(part[:, here], axis=1, keepdims=True)
    medians = np.median(np.hypot(above, outside), axis=1)
    winner = int(np.argmin(medians))
    if medians[winner] >= np.median(np.linalg.norm(_parts(best, sweep)[0][judges], axis=1)):
        return best
    return _with_sizes(across_axes(through.normal[winner]), through.centre_m[winner], sweep, np.median)


def judges_of(sweep: Sweep) -> Ints:
    """Up to ``JUDGES`` points, evenly over the sweep, by which circles through three points are compared."""
    N = len(sweep.points_m)
    return np.unique(np.linspace(0, N - 1, min(N, JUDGES)).round().astype(np.int64))


def triples_of(sweep: Sweep) -> Ints:
    """Up to ``TRIPLES`` index triples ``(T, 3)``, each of one reflector and not on one line."""
    generator = np.random.default_rng(0)
    members = [np.flatnonzero(sweep.reflectors == k) for k in range(len(sweep.names))]
    members = [m for m in members if len(m) >= 3]
    if not members:
        return np.zeros((0, 3), dtype=np.int64)
    each = -(-TRIPLES // len(members))
    drawn = np.concatenate([m[generator.integers(len(m), size=(each, 3))] for m in members])
    a, b = (sweep.points_m[drawn[:, k]] - sweep.points_m[drawn[:, 0]] for k in (1, 2))
    area = np.linalg.norm(np.cross(a, b), axis=1)
    extent = float(np.linalg.norm(np.ptp(sweep.points_m, axis=0)))
    return drawn[area > extent * 10.0 * sweep.rounding_m]


def _with_sizes(frame: Floats, origin: Floats, sweep: Sweep, middle: Callable[[Floats], np.floating]) -> Coaxial:
    M = len(sweep.names)
    v = (sweep.points_m - origin) @ frame.T
    distances = np.hypot(v[:, 0], v[:, 1])
    heights = np.array([middle(v[sweep.reflectors == k, 2]) for k in range(M)])
    radii = np.array([middle(distances[sweep.reflectors == k]) for k in range(M)])
    return Coaxial(frame, origin, heights, radii)
