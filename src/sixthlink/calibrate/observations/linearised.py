"""What does every kind of observation hand to the solver?

Residuals, their derivatives, and how much noise of each origin they carry. The noise is kept apart by origin (joints,
pixels, ...) so that its size can be estimated: the covariance of an observation is the sum over origins of its pattern
times the square of that origin's scale.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sixthlink.calibrate.observations.state import Columns, JointState
from sixthlink.geometry import Floats, Ints
from sixthlink.solvers import Equations

__all__ = ["Linearised", "Observations", "Posed", "covariances", "mahalanobis", "whitened"]


@dataclass(frozen=True, eq=False)
class Linearised:
    """N observations of d numbers each, near one state.

    Attributes:
        residuals: ``(N, d)`` predicted minus observed [m, rad].
        shared: ``(N, d, G)`` derivative by the shared unknowns.
        own: ``(N, d, L)`` derivative by the own unknowns of the observation's block.
        blocks: ``(N,)`` block of each observation.
        noises: Covariance ``(N, d, d)`` per unit of each origin's variance.
    """

    residuals: Floats
    shared: Floats
    own: Floats
    blocks: Ints
    noises: Mapping[str, Floats]


class Observations(Protocol):
    """One kind of observation."""

    @property
    def block(self) -> str:
        """Which own unknowns its blocks carry: ``placements``, ``points``, ``instruments`` or nothing."""

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals and derivatives near a state."""


class Posed(Observations, Protocol):
    """A kind whose every observation was made from a pose of the robot of its own."""

    @property
    def joints(self) -> Floats:
        """``(N, J)`` joint values [rad or m]."""


def covariances(linear: Linearised, scales: Mapping[str, float]) -> Floats:
    """Covariance ``(N, d, d)`` of each observation, given the scale of each origin of noise."""
    total: Floats = sum(
        (scales[name] ** 2 * pattern for name, pattern in linear.noises.items()),
        start=np.zeros((1, 1, 1)),
    )
    return total


def whitened(linear: Linearised, scales: Mapping[str, float], weights: Floats | None = None) -> Equations:
    """Rows of unit variance; ``weights`` ``(N,)`` multiply an observation's sum of squares."""
    N, d, G = linear.shared.shape
    rows = np.concatenate([linear.residuals[:, :, None], linear.shared, linear.own], axis=2)
    white = np.linalg.solve(np.linalg.cholesky(covariances(linear, scales)), rows)
    if weights is not None:
        white *= np.sqrt(weights)[:, None, None]
    flat = white.reshape(N * d, -1)
    return Equations(flat[:, 0], flat[:, 1 : 1 + G], flat[:, 1 + G :], np.repeat(linear.blocks, d))


def mahalanobis(linear: Linearised, scales: Mapping[str, float]) -> Floats:
    """Squared whitened length ``(N,)`` of each residual: of d degrees of freedom when the noise is as stated."""
    white = np.linalg.solve(np.linalg.cholesky(covariances(linear, scales)), linear.residuals[:, :, None])
    return np.einsum("nij,nij->n", white, white)
