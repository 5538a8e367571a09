"""Which shots agree with each other, before and after anything is known of the arm?

Before: under the nominal arm, the head that fits the best three quarters of the shots best (least trimmed squares by
concentration steps, Rousseeuw and Van Driessen 1999), every step a certified solution. Gross mistakes, a board read
from the wrong end or two shots exchanged, cannot drag it along. After: a shot belongs when its residual, measured by
its own covariance and by what the fit has taken up, is no larger than chance makes the largest of all shots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from sixthlink.calibrate.head import HeadProblem, objective, placement_poses, solve_certified
from sixthlink.geometry import Floats, inverse, rotation_angle

__all__ = ["Consensus", "consensus", "limit", "student_weights"]

KEPT_SHARE = 0.75
"""Share of every placement's shots that the first head has to explain."""

ROUNDS = 12

FALSE_ALARM = 1e-3
"""Chance that any good shot of a recording is called wrong."""

DEGREES = 4.0
"""Degrees of freedom of the heavy-tailed loss: gross errors weigh little, Gaussian ones nearly fully."""


@dataclass(frozen=True, eq=False)
class Consensus:
    """The head that most shots agree on under the nominal arm.

    Attributes:
        X: ``(4, 4)`` the head.
        Ts_stand_target: ``(P, 4, 4)`` placements.
        translations_m: ``(N,)`` distance of each shot's target to its placement [m].
        rotations_rad: ``(N,)`` angle of each shot's target to its placement [rad].
    """

    X: Floats
    Ts_stand_target: Floats
    translations_m: Floats
    rotations_rad: Floats


def consensus(problem: HeadProblem, rotation_length_m: float) -> Consensus:
    """Least trimmed squares on eq. (11)."""
    kept = _congruent(problem)
    best: Consensus | None = None
    previous = np.zeros_like(kept)
    for _ in range(ROUNDS):
        best = _fitted(problem, kept, rotation_length_m)
        previous, kept = kept, _nearest(problem.placements, _size(best, rotation_length_m))
        if np.array_equal(kept, previous):
            break
    assert best is not None  # noqa: S101 - there is at least one round
    return best


def student_weights(d2: Floats, dimensions: int) -> Floats:
    """Weights ``(N,)`` of a multivariate Student loss for squared whitened lengths ``(N,)``.

    The lengths are first scaled to the median that chance gives, so that a wrong idea of the noise, or an arm that is
    still nominal, does not make every shot an outlier.
    """
    inflation = max(1.0, float(np.median(d2)) / float(chi2.median(dimensions)))
    weights: Floats = (DEGREES + dimensions) / (DEGREES + d2 / inflation)
    return np.minimum(weights, 1.0)


def limit(shots: int, dimensions: int) -> float:
    """Squared whitened length that the largest of so many good shots exceeds once in a thousand recordings."""
    return float(chi2.isf(FALSE_ALARM / shots, dimensions))


def _congruent(problem: HeadProblem) -> npt.NDArray[np.bool_]:
    """Best three quarters of each placement by how well robot and head agree on the angles between shots."""
    mismatch = np.zeros(len(problem.placements))
    R_out, R_in = problem.Ts_outer[:, :3, :3], problem.Ts_inner[:, :3, :3]
    for p in range(int(problem.placements.max()) + 1):
        members = np.flatnonzero(problem.placements == p)
        # Sixty partners are plenty for a median, and keep the work linear in the shots.
        partners = members[np.linspace(0, len(members) - 1, min(len(members), 60)).round().astype(np.int64)]
        robot = rotation_angle(np.swapaxes(R_out[members], 1, 2)[:, None] @ R_out[partners][None])
        head = rotation_angle(R_in[members][:, None] @ np.swapaxes(R_in[partners], 1, 2)[None])
        mismatch[members] = np.median(np.abs(robot - head), axis=1)
    return _nearest(problem.placements, mismatch)


def _nearest(placements: npt.NDArray[np.int64], sizes: Floats) -> npt.NDArray[np.bool_]:
    kept = np.zeros(len(sizes), dtype=bool)
    for p in range(int(placements.max()) + 1):
        members = np.flatnonzero(placements == p)
        count = max(min(len(members), 3), int(np.ceil(KEPT_SHARE * len(members))))
        kept[members[np.argsort(sizes[members], kind="stable")[:count]]] = True
    return kept


def _fitted(problem: HeadProblem, kept: npt.NDArray[np.bool_], rotation_length_m: float) -> Consensus:
    part = HeadProblem(problem.Ts_outer[kept], problem.Ts_inner[kept], problem.placements[kept])
    X = solve_certified(objective(part, rotation_length_m))[0]
    Ts_stand_target = placement_poses(part, X)
    deviations = inverse(Ts_stand_target[problem.placements]) @ problem.Ts_outer @ X @ problem.Ts_inner
    translations_m = np.linalg.norm(deviations[:, :3, 3], axis=1)
    return Consensus(X, Ts_stand_target, translations_m, rotation_angle(deviations[:, :3, :3]))


def _size(found: Consensus, rotation_length_m: float) -> Floats:
    return np.hypot(found.translations_m, rotation_length_m * found.rotations_rad)
