"""How do arm, tool and sockets settle when touches err alike?

The joint estimate gives a first answer and says which touches belong. From there, Gauss-Newton with the correlated
errors of :mod:`~.pose_errors`, whose sizes the residuals tell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sixthlink.calibrate.joint import Estimate, JointData
from sixthlink.calibrate.observations import Columns, FixedPointTouches, JointState, SocketDistances, moved
from sixthlink.calibrate.touches.components import CorrelatedRows, MixedFit, mixed_fit, weighted_fit
from sixthlink.calibrate.touches.pose_errors import PARTS, SMOOTHNESS_RAD, error_patterns, sockets_of
from sixthlink.geometry import Floats, Ints

__all__ = ["SettledTouches", "settled_touches"]

STEPS = 4
MOST_FOR_SIZES = 250
"""Touches from which the sizes of the errors are told; the time grows with the cube."""

ARRIVED = 1e-3
"""Largest step, in standard deviations, at which the answer has arrived."""


@dataclass(frozen=True, eq=False)
class SettledTouches:
    """Arm, tool and sockets under correlated errors.

    Attributes:
        state: The answer.
        columns: Its shared unknowns.
        fit: Covariance of shared unknowns, then of all points place by place, and the sizes of the noise.
        smoothness_rad: ℓ of the part of the errors that follows the pose.
    """

    state: JointState
    columns: Columns
    fit: MixedFit
    smoothness_rad: float

    @property
    def shared_covariance(self) -> Floats:
        """``(G, G)`` of the shared unknowns."""
        G = self.columns.size
        return self.fit.covariance[:G, :G]

    def distance(self, place: int, ends: tuple[int, int], *, coverage: float) -> tuple[float, float]:
        """Distance between two points of a place [m], and its standard uncertainty.

        Args:
            place: Number of the place.
            ends: Numbers of the points.
            coverage: The uncertainty is such that this multiple of it holds 95 %.
        """
        between = self.state.points_m[place, ends[1]] - self.state.points_m[place, ends[0]]
        length_m = float(np.linalg.norm(between))
        gradient = np.zeros(len(self.fit.step))
        for end, sign in zip(ends, (-1.0, 1.0), strict=True):
            start = self.columns.size + 3 * (place * self.state.points_m.shape[1] + end)
            gradient[start : start + 3] = sign * between / length_m
        return length_m, self.fit.std_of(gradient, coverage=coverage)


def settled_touches(data: JointData, found: Estimate, *, parts: Sequence[str] = PARTS) -> SettledTouches:
    """Arm, tool and sockets under errors that follow the pose, with the touches that belong.

    Args:
        data: What was touched.
        found: The joint estimate of the same data.
        parts: Parts of the errors that are considered.
    """
    assert data.touches is not None  # noqa: S101 - the caller has touches
    kept = np.flatnonzero(found.kept[0])
    touches, part = _chosen(data.touches, kept), _chosen(data.touches, _sample(data.touches, kept))
    state, columns = found.fit.state, found.problem.columns
    chosen = [PARTS.index(name) for name in parts]

    def rows(of: FixedPointTouches, at: JointState, smoothness_rad: float) -> CorrelatedRows:
        whole = _rows(of, data.distances, found, at, smoothness_rad)
        return replace(whole, patterns=whole.patterns[chosen])

    contact, joints = found.scales["contact"] ** 2, found.scales["joints"] ** 2
    first = np.array([0.5 * joints, contact, 0.25 * joints, joints])[chosen]
    fits = [mixed_fit(rows(part, state, ell), first) for ell in SMOOTHNESS_RAD]
    best = int(np.argmin([f.cost for f in fits]))
    sizes, ell = fits[best], SMOOTHNESS_RAD[best]
    fit = sizes if len(part.joints) == len(kept) else weighted_fit(rows(touches, state, ell), sizes)
    for _ in range(STEPS):
        state = _moved(state, columns, fit.step)
        size = np.abs(fit.step) / np.sqrt(np.diag(fit.covariance))
        sizes = mixed_fit(rows(part, state, ell), sizes.variances)
        fit = sizes if len(part.joints) == len(kept) else weighted_fit(rows(touches, state, ell), sizes)
        if size.max() < ARRIVED:
            break
    return SettledTouches(_moved(state, columns, fit.step), columns, fit, ell)


def _sample(touches: FixedPointTouches, kept: Ints) -> Ints:
    """Touches that tell the sizes of the errors: all, or as many as are quickly worked with, evenly by socket."""
    every = -(-len(kept) // MOST_FOR_SIZES)
    by_socket = kept[np.argsort(sockets_of(touches)[kept], kind="stable")]
    return np.sort(by_socket[::every])


def _chosen(touches: FixedPointTouches, indices: Ints) -> FixedPointTouches:
    return replace(
        touches, joints=touches.joints[indices], places=touches.places[indices], points=touches.points[indices]
    )


def _moved(state: JointState, columns: Columns, step: Floats) -> JointState:
    G = columns.size
    return moved(state, columns, step[:G], [("points", step[G:])])


def _rows(
    touches: FixedPointTouches,
    distances: SocketDistances | None,
    found: Estimate,
    state: JointState,
    smoothness_rad: float,
) -> CorrelatedRows:
    """All rows near a state: touches with their correlated noise; tolerances and certified distances, whitened."""
    columns = found.problem.columns
    G = columns.size
    B, m = state.points_m.shape[:2]
    linear = touches.linearised(state, columns)
    N = len(linear.residuals)
    rows = np.zeros((N, 3, G + 3 * B * m))
    rows[:, :, :G] = linear.shared
    at = G + 3 * (touches.places * m + touches.points)
    for k in range(3):
        rows[np.arange(N), k, at + k] = -1.0
    prior = found.problem.prior
    offset = np.zeros(G)
    offset[columns.arm_slice] = state.arm_step
    white, right = [np.pad(prior, ((0, 0), (0, 3 * B * m)))], [prior @ offset - found.problem.prior_right]
    if distances is not None:
        known = distances.linearised(state, columns)
        for r, place, own in zip(known.residuals[:, 0], known.blocks, known.own[:, 0], strict=True):
            row = np.zeros((1, G + 3 * B * m))
            row[0, G + 3 * m * place : G + 3 * m * (place + 1)] = own
            white.append(row / distances.uncertainty_m)
            right.append(np.array([r / distances.uncertainty_m]))
    untouched = np.setdiff1d(np.arange(B * m), touches.places * m + touches.points)
    for point in untouched:
        # Nothing says where it is; it stays, so that the equations are regular.
        white.append(np.eye(3, G + 3 * B * m, G + 3 * int(point)))
        right.append(np.zeros(3))
    patterns = error_patterns(touches, state, smoothness_rad)
    return CorrelatedRows(
        rows.reshape(3 * N, -1), linear.residuals.ravel(), patterns, np.concatenate(white), np.concatenate(right)
    )
