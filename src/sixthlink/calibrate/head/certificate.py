"""Is this the global minimum of eq. (11), and how is that proven?

Any rotation satisfies xᵀ A_k x = 0 (relaxation.py), so for any multipliers λ, with H = Q + Σ λ_k A_k - value·hh,

    F(x) - value = xᵀ H x ≥ 4 · (smallest eigenvalue of H)

because |x|² = 4 for every rotation. Multipliers for which H annihilates the answer and has no negative eigenvalue
prove that nothing lies below it. They are sought as the smallest ones that annihilate it; only where those do not
prove it is the semidefinite relaxation solved. H is split along the answer, so that the proof does not drown in
the rounding of Q: what the answer's row leaves enters squared, over the smallest eigenvalue of the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.factor import Objective, best_translation
from sixthlink.calibrate.head.refine import polished_rotation
from sixthlink.calibrate.head.relaxation import HOMOGENEOUS, orthogonality_matrices, solve_relaxation
from sixthlink.geometry import Floats, nearest_rotation

__all__ = ["GAP_TOLERANCE", "Certificate", "certificate_of", "linear_start", "solve_certified"]

GAP_TOLERANCE = 1e-6
"""Relative gap below which an answer counts as the proven global minimum."""

ROUNDING = 1e-14
"""Share of |Q| below which a value is rounding: data without noise have their minimum there."""


@dataclass(frozen=True)
class Certificate:
    """A value of eq. (11) and a proven lower bound of its global minimum.

    Attributes:
        value_m2: F of the answer [m²].
        bound_m2: No head has a smaller F than this [m²].
        relative_gap: (value - bound) / value, or over the rounding level of Q when the value is below it.
        certified: Whether the answer is proven to be the global minimum.
        eigenvalue_ratio: Smallest over largest eigenvalue of H beside the answer's own: how sharply the data single
            the answer out. Zero or less means that another head may be as good.
        relaxed: Whether the semidefinite relaxation had to be solved.
    """

    value_m2: float
    bound_m2: float
    relative_gap: float
    certified: bool
    eigenvalue_ratio: float
    relaxed: bool


def solve_certified(objective: Objective) -> tuple[Floats, Certificate]:
    """Global minimum of eq. (11), proven.

    Returns:
        Head ``(4, 4)`` and its certificate. Where the certificate says ``certified`` False, the motion is degenerate
        or the noise is beyond what the relaxation can carry; the head is then the best that was found.
    """
    U2 = objective.rotation_factor
    rotation = polished_rotation(U2, linear_start(U2))
    certificate = _certificate(U2, rotation, np.zeros(len(orthogonality_matrices())), relaxed=False)
    if not certificate.certified:
        rotation, certificate = _relaxed(U2, rotation)
    return best_translation(objective, rotation), certificate


def certificate_of(objective: Objective, rotation: Floats) -> Certificate:
    """Judge any given rotation ``(3, 3)``, for example a closed form's, a swarm's or last year's answer."""
    U2 = objective.rotation_factor
    simple = _certificate(U2, rotation, np.zeros(len(orthogonality_matrices())), relaxed=False)
    if simple.certified:
        return simple
    best, proven = _relaxed(U2, rotation)
    if np.array_equal(best, rotation):
        return proven
    value = _value(U2, rotation)
    gap = _relative_gap(value, proven.bound_m2, _scale(U2))
    certified = gap <= GAP_TOLERANCE
    return Certificate(value, proven.bound_m2, gap, certified, proven.eigenvalue_ratio, relaxed=True)


def _relaxed(U2: Floats, rotation: Floats) -> tuple[Floats, Certificate]:
    """The better of a given rotation and the relaxation's, with the relaxation's multipliers as proof."""
    scale = _scale(U2)
    matrix, multipliers = solve_relaxation(U2.T @ U2 / scale)
    leading = np.linalg.eigh(matrix)[1][:, -1]
    rounded = nearest_rotation((leading[:9] * np.sign(leading[HOMOGENEOUS] or 1.0)).reshape(3, 3))
    candidate = polished_rotation(U2, rounded)
    best = candidate if _value(U2, candidate) < _value(U2, rotation) else rotation
    return best, _certificate(U2, best, multipliers * scale, relaxed=True)


def _certificate(U2: Floats, rotation: Floats, multipliers: Floats, *, relaxed: bool) -> Certificate:
    """Certificate of a rotation with the multipliers nearest to the given ones that annihilate it."""
    A = orthogonality_matrices()
    x = np.append(rotation.ravel(), 1.0)
    value = _value(U2, rotation)
    H = U2.T @ U2 + np.tensordot(multipliers, A, axes=1)
    H[HOMOGENEOUS, HOMOGENEOUS] -= value
    gradients = (A @ x).T
    correction = np.linalg.lstsq(gradients, -(H @ x), rcond=1e-12)[0]
    H = H + np.tensordot(correction, A, axes=1)
    beside, along = _split(H, x)
    drop = 4.0 * max(0.0, -_smallest_eigenvalue(beside, along))
    eigenvalues = np.linalg.eigvalsh(beside)
    gap = _relative_gap(value, value - drop, _scale(U2))
    return Certificate(
        value_m2=value,
        bound_m2=max(0.0, value - drop),
        relative_gap=gap,
        certified=bool(gap <= GAP_TOLERANCE and eigenvalues[0] > 0.0),
        eigenvalue_ratio=float(eigenvalues[0] / max(abs(eigenvalues[-1]), 1e-300)),
        relaxed=relaxed,
    )


def _split(H: Floats, x: Floats) -> tuple[Floats, Floats]:
    """H in a basis that starts with x: the ``(9, 9)`` block beside it and the ``(9,)`` row along it."""
    basis = np.linalg.qr(np.column_stack([x, np.eye(10)[:, :9]]))[0]
    beside, unit = basis[:, 1:], basis[:, 0]
    return beside.T @ H @ beside, beside.T @ (H @ unit)


def _smallest_eigenvalue(beside: Floats, along: Floats) -> float:
    """Lower bound of the smallest eigenvalue of [[0, alongᵀ], [along, beside]] (Schur complement)."""
    lowest = float(np.linalg.eigvalsh(beside)[0])
    row = float(along @ along)
    if lowest > 0.0:
        return -row / lowest
    return lowest - float(np.sqrt(row))


def _relative_gap(value: float, bound: float, scale: float) -> float:
    return (value - max(0.0, bound)) / max(value, ROUNDING * scale)


def linear_start(U2: Floats) -> Floats:
    """Rotation nearest to the unconstrained least-squares solution of U₂ (vec R, 1)."""
    start = np.linalg.lstsq(U2[:, :9], -U2[:, 9], rcond=1e-9)[0]
    return nearest_rotation(np.asarray(start, dtype=np.float64).reshape(3, 3))


def _value(U2: Floats, rotation: Floats) -> float:
    residual = U2[:, :9] @ rotation.ravel() + U2[:, 9]
    return float(residual @ residual)


def _scale(U2: Floats) -> float:
    return float(np.sum(U2 * U2))
