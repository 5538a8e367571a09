"""Is there a smooth path beside the circles, that no noise makes?

Polynomials along the arc, outside and above, with everything that axis and circles can take up removed, are fitted to
the deviations; what they explain is compared with what they leave (C11, C12 of docs/theory/circle_points.md).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.special import fdtrc

from sixthlink.calibrate.tracker.belonging import freedom
from sixthlink.calibrate.tracker.coaxial import Coaxial, phases_of, whitened
from sixthlink.calibrate.tracker.sweep import Sweep
from sixthlink.geometry import Floats

__all__ = ["SmoothPath", "smooth_path"]

DEGREE = 6
"""Highest degree of the path."""


@dataclass(frozen=True, eq=False)
class SmoothPath:
    """What a smooth path beside the circles explains.

    Attributes:
        rms_m: RMS distance of the points from their circles [m].
        before: Root of the whitened squares per degree of freedom without the path; in metres where no noise is stated.
        left: The same with the path.
        chance: Chance of so much explained by noise alone.
        share_above: Share of the path that lies along the axis.
    """

    rms_m: float
    before: float
    left: float
    chance: float
    share_above: float


def smooth_path(circles: Coaxial, sweep: Sweep) -> SmoothPath | None:
    """The smooth path of points beside their circles; None where they are too few to tell a path from noise."""
    every = np.ones(len(sweep.points_m), dtype=bool)
    deviations, r, J = whitened(circles, sweep)
    dof, total = freedom(every, sweep), float(np.sum(r**2))
    path, terms = _smooth_part(circles, sweep, r, J)
    left_dof, explained = dof - terms, float(np.sum(path**2))
    if terms == 0 or left_dof < 4 or explained == 0.0:
        return None
    left = max(total - explained, 0.0) / left_dof
    return SmoothPath(
        rms_m=float(np.sqrt(np.mean(np.sum(deviations**2, axis=1)))),
        before=float(np.sqrt(total / dof)),
        left=float(np.sqrt(left)),
        chance=float(fdtrc(terms, left_dof, explained / terms / max(left, np.finfo(np.float64).tiny))),
        share_above=float(np.sum(path[:, 1] ** 2) / explained),
    )


def _smooth_part(circles: Coaxial, sweep: Sweep, r: Floats, J: Floats) -> tuple[Floats, int]:
    """Part ``(N, 2)`` of the whitened deviations that is smooth along the circles, and how many terms made it."""
    N, M = len(r), len(sweep.names)
    phases = phases_of(circles, sweep)
    degree = min(DEGREE, N // (2 * M) - 1)
    if degree < 3:
        return np.zeros_like(r), 0
    columns = []
    for k in range(M):
        here = sweep.reflectors == k
        along = legvander(_along(phases[here]), degree)
        for part in range(2):
            block = np.zeros((N, 2, degree + 1))
            block[here, part] = along
            columns.append(block)
    basis = np.concatenate(columns, axis=2).reshape(2 * N, -1)
    Q = np.linalg.qr(J.reshape(2 * N, -1))[0]
    basis = basis - Q @ (Q.T @ basis)
    U, sizes, _ = np.linalg.svd(basis, full_matrices=False)
    U = U[:, sizes > 1e-3 * sizes.max(initial=1e-300)]
    return (U @ (U.T @ r.reshape(-1))).reshape(N, 2), U.shape[1]


def _along(phases: Floats) -> Floats:
    """Places along the arc from -1 to 1, cut at the largest gap."""
    turned = np.mod(phases, 2.0 * np.pi)
    order = np.sort(turned)
    gap = int(np.argmax(np.diff(np.r_[order, order[0] + 2.0 * np.pi])))
    start = order[(gap + 1) % len(order)]
    places = np.mod(turned - start, 2.0 * np.pi)
    places[turned == start] = 0.0
    return 2.0 * places / max(float(places.max()), 1e-12) - 1.0
