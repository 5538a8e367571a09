"""Does the robot's motion agree with the declared size of the board?

A board declared two per cent too large is seen two per cent too far away, in every image alike: no camera can tell, but
the robot knows how far it has moved. With the scale s of all seen distances as one more unknown beside head,
placements, lenses and arm, the shots tell it with a standard deviation; where their motion is small or all alike, that
is large and nothing is said. The scale is judged, not corrected: a wrong number is the user's to correct.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.calibration import BoardEvidence, Gate
from sixthlink.calibrate.head import HeadProblem, Scatter
from sixthlink.calibrate.observations import Linearised, carried, whitened
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.geometry import Floats, motion_between
from sixthlink.solvers import Equations, reduced

__all__ = ["BoardScale", "board_evidence", "board_gate", "scale_by_head", "scale_by_joint"]

WRONG = ((4.0, 0.005), (3.0, 0.01))
"""Standard deviations and shares that a deviation must exceed, both of one pair, to be told: chance, and what lenses
and robots do to a scale without being wrong."""

DOUBTFUL = (2.0, 0.005)
"""The same for a hint."""

TOLD = 0.02
"""Standard deviation beyond which the motion says nothing of the size."""

MIRRORED = -0.5
"""A mirrored picture of a board without numbers is one of a board behind the camera: its scale is about -1."""


@dataclass(frozen=True)
class BoardScale:
    """How large the board is by the robot's motion.

    Attributes:
        scale: True over declared size.
        std: Its standard deviation.
    """

    scale: float
    std: float

    @property
    def wrong(self) -> bool:
        """Whether the declared size contradicts the robot."""
        return self.std <= TOLD and any(self._beyond(*limits) for limits in WRONG)

    @property
    def doubtful(self) -> bool:
        """Whether more shots should be asked about the declared size."""
        return self.std <= TOLD and self._beyond(*DOUBTFUL)

    def _beyond(self, deviations: float, share: float) -> bool:
        return abs(self.scale - 1.0) > max(deviations * self.std, share)


def board_gate(found: BoardScale) -> Gate:
    """Whether the board is as large as declared."""
    figure = f"by the robot's motion the board is {found.scale:.5f} ± {found.std:.5f} times as large as declared"
    if found.scale < MIRRORED:
        return Gate("board as large as declared", False, f"{figure}: the images are mirrored; turn off flipping")
    if found.std > TOLD:
        figure += ": the motion says nothing of its size"
    if found.wrong:
        figure += (
            f"; measure its squares or the distance of its dots and correct them ({100 * (found.scale - 1):+.2f} %), "
            "or look for a wrong unit or scale of the robot's positions or for a lens given too long or too short"
        )
    elif found.doubtful:
        figure += (
            f", {abs(found.scale - 1.0) / found.std:.1f} standard deviations off: measure its squares or the distance "
            "of its dots, or record more shots, tilted more and from different distances"
        )
    return Gate("board as large as declared", not found.wrong, figure)


def board_evidence(found: BoardScale | None, cameras: RigCalibration | None) -> BoardEvidence:
    """Size and shape of the board together."""
    shape = cameras.shape if cameras is not None else None
    return BoardEvidence(
        scale=None if found is None else found.scale,
        scale_std=None if found is None else found.std,
        sag_m=0.0 if shape is None else shape.sag_m,
        sag_std_m=0.0 if shape is None else shape.sag_std_m,
    )


def scale_by_joint(
    linear: Linearised, covariances: Floats, heads: Floats, prior: Floats, *, Ts_head_target: Floats, kept: Floats
) -> BoardScale:
    """The scale beside everything that a joint estimate has found.

    Args:
        linear: The shots at the answer.
        covariances: ``(N, 6, 6)`` their covariances.
        heads: ``(N, 3, 3)`` the head's axes in the base frame.
        prior: ``(K, G + 1)`` whitened rows on the shared unknowns, the residual last.
        Ts_head_target: ``(N, 4, 4)`` target poses as the head saw them.
        kept: ``(N,)`` 1 for shots that belong, 0 for others.
    """
    along = np.zeros((*linear.residuals.shape, 1))
    along[:, :3, 0] = np.einsum("nij,nj->ni", heads, Ts_head_target[:, :3, 3])
    shared = np.concatenate([linear.shared, along], axis=2)
    rows = Linearised(linear.residuals, shared, linear.own, linear.blocks, {"all": covariances})
    return _told(whitened(rows, {"all": 1.0}, kept), np.insert(prior, -1, 0.0, axis=1))


def scale_by_head(
    problem: HeadProblem, X: Floats, fitted: Scatter, by_lens: Floats, lens_covariance: Floats
) -> BoardScale:
    """The scale beside head, placements and lenses, every shot weighed by the scatter of all.

    Args:
        problem: Shots with their targets located, as eq. (10) sees them.
        X: ``(4, 4)`` the head.
        fitted: Its residuals, whose size is the noise.
        by_lens: ``(N, 6, g)`` how the poses follow the cameras' free unknowns, in head axes.
        lens_covariance: ``(g, g)`` of these.
    """
    T_seen = problem.Ts_outer @ X @ problem.Ts_inner
    N, g = len(T_seen), len(lens_covariance)
    R_outer, R_head = problem.Ts_outer[:, :3, :3], problem.Ts_outer[:, :3, :3] @ X[:3, :3]
    levers = (R_head @ problem.Ts_inner[:, :3, 3:])[:, :, 0]
    shared = np.zeros((N, 6, 6 + g))
    shared[:, :, :6] = carried(levers) @ _twice(R_outer)
    shared[:, :, 6:] = _twice(R_head) @ by_lens if g else 0.0
    first = np.array([np.flatnonzero(problem.placements == p)[0] for p in range(int(problem.placements.max()) + 1)])
    residuals = motion_between(T_seen[first][problem.placements], T_seen)
    sizes = np.repeat([fitted.rms_translation_m, fitted.rms_rotation_rad], 3) / np.sqrt(3.0)
    noise = np.tile(np.diag(np.maximum(sizes, 1e-9) ** 2), (N, 1, 1))
    own = -np.tile(np.eye(6), (N, 1, 1))
    linear = Linearised(residuals, shared, own, problem.placements, {})
    prior = np.zeros((g, 6 + g + 1))
    if g:
        prior[:, 6 : 6 + g] = np.linalg.inv(np.linalg.cholesky(lens_covariance))
    return scale_by_joint(linear, noise, R_head, prior, Ts_head_target=problem.Ts_inner, kept=np.ones(N))


def _told(equations: Equations, prior: Floats) -> BoardScale:
    small = reduced([[equations]], prior)
    pivot = float(small.factor[-1, -1])
    if abs(pivot) < 1.0:
        return BoardScale(1.0, 1.0)
    return BoardScale(1.0 - float(small.right[-1]) / pivot, 1.0 / abs(pivot))


def _twice(rotations: Floats) -> Floats:
    """Matrices ``(N, 6, 6)`` that turn a motion's axes by rotations ``(N, 3, 3)``."""
    M = np.zeros((len(rotations), 6, 6))
    M[:, :3, :3] = M[:, 3:, 3:] = rotations
    return M
