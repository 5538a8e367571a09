"""Which matrices turn "R is a rotation" into a semidefinite relaxation?

With x = (vec R, h), vec R row by row and h² = 1, a rotation satisfies quadratic equations xᵀ A_k x = b_k: rows
orthonormal (6), columns orthonormal (5 independent of the rows'), and each row the cross product of the others (9).
The last, h² = 1, stands apart because its multiplier is the bound itself. (docs/theory/certificate.md)
"""

from __future__ import annotations

from functools import cache
from itertools import combinations_with_replacement

import numpy as np

from sixthlink.geometry import Floats

__all__ = [
    "HOMOGENEOUS",
    "orthogonality_matrices",
    "scaled_triangle",
    "solve_relaxation",
    "symmetric_from_triangle",
]

HOMOGENEOUS = 9
"""Index of h in x."""


@cache
def orthogonality_matrices() -> Floats:
    """``(20, 10, 10)`` symmetric A_k with xᵀ A_k x = 0 for every rotation and h² = 1."""
    matrices = [_gram(i, j, rows=True) for i, j in combinations_with_replacement(range(3), 2)]
    # The trace of RᵀR is the trace of RRᵀ, so one of the six column equations is already there.
    matrices += [_gram(i, j, rows=False) for i, j in combinations_with_replacement(range(3), 2) if (i, j) != (2, 2)]
    matrices += [_handedness(i, axis) for i in range(3) for axis in range(3)]
    return np.stack(matrices)


def solve_relaxation(Q: Floats) -> tuple[Floats, Floats]:
    """Solve the dual of the relaxation: the largest bound on xᵀQx.

    Args:
        Q: ``(10, 10)`` symmetric, scaled to a norm of about 1.

    Returns:
        ``(10, 10)`` primal matrix, xxᵀ when the relaxation is tight, and ``(20,)`` multipliers of A_k.
    """
    import clarabel
    from scipy import sparse

    columns, homogeneous = _dual_columns()
    A = sparse.csc_matrix(-np.column_stack([columns, homogeneous]))
    q = np.zeros(A.shape[1])
    q[-1] = 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    cones = [clarabel.PSDTriangleConeT(10)]
    empty = sparse.csc_matrix((A.shape[1], A.shape[1]))
    answer = clarabel.DefaultSolver(empty, q, A, scaled_triangle(Q), cones, settings).solve()
    return symmetric_from_triangle(np.asarray(answer.z)), np.asarray(answer.x)[:-1]


def scaled_triangle(matrix: Floats) -> Floats:
    """``(55,)`` upper triangle by columns, off-diagonal entries times √2: inner products survive."""
    rows, columns, scale = _triangle_index()
    return matrix[..., rows, columns] * scale


def symmetric_from_triangle(triangle: Floats) -> Floats:
    """``(10, 10)`` symmetric matrix of a scaled triangle."""
    rows, columns, scale = _triangle_index()
    matrix = np.zeros((10, 10))
    matrix[rows, columns] = triangle / scale
    matrix[columns, rows] = matrix[rows, columns]
    return matrix


@cache
def _triangle_index() -> tuple[Floats, Floats, Floats]:
    pairs = [(i, j) for j in range(10) for i in range(j + 1)]
    rows, columns = (np.array(side) for side in zip(*pairs, strict=True))
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))


@cache
def _dual_columns() -> tuple[Floats, Floats]:
    homogeneous = np.zeros((10, 10))
    homogeneous[HOMOGENEOUS, HOMOGENEOUS] = 1.0
    return scaled_triangle(orthogonality_matrices()).T, scaled_triangle(homogeneous)


def _gram(i: int, j: int, *, rows: bool) -> Floats:
    """Row i · row j (or column i · column j) = δ_ij h²."""
    A = np.zeros((10, 10))
    for k in range(3):
        p, q = (3 * i + k, 3 * j + k) if rows else (3 * k + i, 3 * k + j)
        A[p, q] += 0.5
        A[q, p] += 0.5
    if i == j:
        A[HOMOGENEOUS, HOMOGENEOUS] = -1.0
    return A


def _handedness(i: int, axis: int) -> Floats:
    """Component ``axis`` of row i+1 × row i+2 = h · row i."""
    A = np.zeros((10, 10))
    u, v = (i + 1) % 3, (i + 2) % 3
    b, c = (axis + 1) % 3, (axis + 2) % 3
    for p, q, sign in ((3 * u + b, 3 * v + c, 0.5), (3 * u + c, 3 * v + b, -0.5)):
        A[p, q] += sign
        A[q, p] += sign
    A[3 * i + axis, HOMOGENEOUS] -= 0.5
    A[HOMOGENEOUS, 3 * i + axis] -= 0.5
    return A
