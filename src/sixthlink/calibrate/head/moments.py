"""How are a million shots read without writing out their rows?

Every entry of a row is an entry of the outer pose times one of the inner, so that the sums of all products of rows
are a few small matrix products over the shots. But squares lose the small residuals in the one direction in which
the rows nearly vanish: the answer. So a first answer is taken from a sample, and that direction becomes a column of
its own, formed shot by shot as the difference from the placement's first shot, which is small already. All other
directions are as large as the robot's turns; squared, they lose nothing that counts. What fails the checks of
:func:`_factor` is for the direct route (rows.py). (docs/theory/factor.md)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.rows import Grouping, Segments, row_factors, segments, triangular
from sixthlink.geometry import Floats

__all__ = ["moment_factors"]

SAMPLE_BLOCKS, BLOCK_SHOTS = 64, 8
"""Runs of shots, spread over the recording, that make the first answer."""

WEAKEST = 1e-6
"""Smallest share of a direction's square that must be left when its mean and the directions before are taken off."""

KEPT = 1e-4
"""Smallest share of the answer's square that must be left likewise, unless all of it is rounding."""


@dataclass(frozen=True, eq=False)
class _Start:
    """First answer.

    Attributes:
        centre_m: ``(3,)`` mean position of the target in the head; positions count from it.
        translation: ``(3, 4)`` (R, t) that makes the position rows smallest, t at the centre.
        basis: ``(9, 9)`` orthonormal columns; the last is the vec R that makes the orientation rows smallest.
    """

    centre_m: Floats
    translation: Floats
    basis: Floats


@dataclass(eq=False)
class _Moments:
    """Sums over the shots read so far.

    Attributes:
        squares: ``(9, 25)`` R_outᵀR_out times, of the inner pose, R_in R_inᵀ and s sᵀ with s = (t_in, 1).
        along: ``(3, 7)`` R_outᵀ times the answer's residual times R_inᵀ, and sᵀ.
        residuals: ``(2,)`` squares of the answer's residual: orientation, position.
        rotation_means: ``(10, 10)`` what the means of the placements take off, orientation rows.
        translation_means: ``(13, 13)`` the same, position rows.
        open_sums: ``(129, 1)`` sums over the placement that is being read.
        origin: ``(3, 4)`` value of its first shot.
    """

    squares: Floats
    along: Floats
    residuals: Floats
    rotation_means: Floats
    translation_means: Floats
    open_sums: Floats
    origin: Floats


def moment_factors(Ts_outer: Floats, Ts_inner: Floats, groups: Grouping) -> tuple[Floats, Floats] | None:
    """Factors ``(13, 13)`` and ``(9, 9)`` as of :func:`rows.row_factors`, or None where squares would lose digits."""
    start = _start(Ts_outer, Ts_inner, groups)
    moments = _Moments(*(np.zeros(shape) for shape in ((9, 25), (3, 7), 2, (10, 10), (13, 13), (129, 1), (3, 4))))
    for cut in segments(groups):
        outer, inner = (
            np.ascontiguousarray(groups.taken(Ts, cut.first, cut.last).reshape(-1, 12).T).reshape(3, 4, -1)
            for Ts in (Ts_outer, Ts_inner)
        )
        inner[:, 3] -= start.centre_m[:, None]
        residuals = _residuals(outer, inner, start, cut, moments)
        _add_squares(moments, outer[:, :3], inner, residuals, np.repeat(groups.counts[cut.placements], cut.lengths))
        _add_means(moments, outer[:, :3], inner, residuals, cut)
    translation, rotation = _translation_factor(moments, start), _rotation_factor(moments, start)
    return None if translation is None or rotation is None else (translation, rotation)


def _start(Ts_outer: Floats, Ts_inner: Floats, groups: Grouping) -> _Start:
    firsts = np.linspace(0, groups.shots - BLOCK_SHOTS, SAMPLE_BLOCKS).astype(np.int64)
    sample = np.unique(firsts[:, None] + np.arange(BLOCK_SHOTS))
    placement = np.searchsorted(groups.firsts, sample, side="right")
    places = np.flatnonzero(np.diff(placement, prepend=0))
    shots = sample if groups.order is None else groups.order[sample]
    outer, inner = Ts_outer[shots], Ts_inner[shots]
    chosen = Grouping(None, places, np.diff(places, append=len(sample)))
    translation, rotation = (triangular(rows) for rows in row_factors(outer, inner, chosen))
    scale = np.linalg.norm(translation[:, :12], axis=0)
    scale[scale == 0.0] = 1.0
    theta = np.linalg.lstsq(translation[:, :12] / scale, -translation[:, 12], rcond=1e-12)[0] / scale
    centre, R = inner[:, :3, 3].mean(axis=0), theta[3:].reshape(3, 3)
    return _Start(centre, np.column_stack([R, theta[:3] + R @ centre]), np.linalg.svd(rotation)[2].T)


def _residuals(outer: Floats, inner: Floats, start: _Start, cut: Segments, moments: _Moments) -> Floats:
    """Target poses ``(3, 4, n)`` of the first answer, minus that of their placement's first shot."""
    turned = np.empty_like(inner)
    turned[:, :3] = (start.basis[:, 8].reshape(3, 3) @ inner[:, :3].reshape(3, -1)).reshape(3, 3, -1)
    turned[:, 3] = start.translation[:, :3] @ inner[:, 3] + start.translation[:, 3:]
    values: Floats = np.einsum("abn,bcn->acn", outer[:, :3], turned)
    values[:, 3] += outer[:, 3]
    origins = values[..., cut.starts]
    if cut.continued:
        origins[..., 0] = moments.origin
    moments.origin = origins[..., -1]
    values -= np.repeat(origins, cut.lengths, axis=2)
    return values


def _add_squares(moments: _Moments, R_out: Floats, inner: Floats, residuals: Floats, weights: Floats) -> None:
    """Add the products of rows, weighed by the shots of their placement."""
    n = len(weights)
    R_in, s = inner[:, :3], np.concatenate([inner[:, 3], np.ones((1, n))])
    outer_squares = np.einsum("abn,acn->bcn", R_out, R_out)
    outer_squares *= weights
    inner_squares = np.empty((25, n))
    np.einsum("bdn,cdn->bcn", R_in, R_in, out=inner_squares[:9].reshape(3, 3, n))
    np.multiply(s[:, None], s, out=inner_squares[9:].reshape(4, 4, n))
    moments.squares += outer_squares.reshape(9, n) @ inner_squares.T
    weighed = residuals * weights
    turned = np.einsum("abn,acn->bcn", R_out, weighed)
    moments.along[:, :3] += np.einsum("bdn,cdn->bc", turned[:, :3], R_in)
    moments.along[:, 3:] += turned[:, 3] @ s.T
    moments.residuals += np.vdot(weighed[:, :3], residuals[:, :3]), np.vdot(weighed[:, 3], residuals[:, 3])


def _add_means(moments: _Moments, R_out: Floats, inner: Floats, residuals: Floats, cut: Segments) -> None:
    """Take off the means of the placements that end in this chunk; what goes on stays open."""
    n = inner.shape[-1]
    table = np.empty((129, n))
    rows = table[:117].reshape(9, 13, n)
    flat = R_out.reshape(9, 1, n)
    np.multiply(flat, inner[:, :3].reshape(1, 9, n), out=rows[:, :9])
    np.multiply(flat, inner[:, 3], out=rows[:, 9:12])
    rows[:, 12] = flat[:, 0]
    table[117:] = residuals.reshape(12, n)
    sums = np.add.reduceat(table, cut.starts, axis=1)
    if cut.continued:
        sums[:, :1] += moments.open_sums
    if cut.goes_on:
        moments.open_sums, sums = sums[:, -1:], sums[:, :-1]
    entries = sums[:117].reshape(3, 3, 13, -1)
    answer = sums[117:].reshape(3, 4, -1)
    orientation, position = np.empty((3, 3, sums.shape[1], 10)), np.empty((3, sums.shape[1], 13))
    # Entry (a, b, (c, d), p) of R_out R_in belongs to the row (a, d) of p and to the column (b, c).
    orientation[..., :9] = entries[:, :, :9].reshape(3, 3, 3, 3, -1).transpose(0, 3, 4, 1, 2).reshape(3, 3, -1, 9)
    orientation[..., 9] = answer[:, :3]
    position[..., :12] = entries[:, :, 9:].transpose(0, 3, 1, 2).reshape(3, -1, 12)
    position[..., 12] = answer[:, 3]
    moments.rotation_means += np.tensordot(orientation, orientation, axes=([0, 1, 2], [0, 1, 2]))
    moments.translation_means += np.tensordot(position, position, axes=([0, 1], [0, 1]))


def _translation_factor(moments: _Moments, start: _Start) -> Floats | None:
    gram = np.empty((13, 13))
    gram[:12, :12] = moments.squares[:, 9:].reshape(3, 3, 4, 4).transpose(0, 2, 1, 3).reshape(12, 12)
    gram[12, :12] = gram[:12, 12] = moments.along[:, 3:].ravel()
    gram[12, 12] = moments.residuals[1]
    t_first = [3, 7, 11, 0, 1, 2, 4, 5, 6, 8, 9, 10, 12]
    size = float(np.diag(gram)[:12] @ start.translation.ravel() ** 2)
    order = np.ix_(t_first, t_first)
    U = _factor(gram[order], moments.translation_means[order], size)
    if U is None:
        return None
    # (t, vec R, 1) to what the columns count: t at the centre, and both from the first answer.
    change = np.eye(13)
    change[:3, 3:12] = np.kron(np.eye(3), start.centre_m)
    change[:3, 12] = -start.translation[:, 3]
    change[3:12, 12] = -start.translation[:, :3].ravel()
    return U @ change


def _rotation_factor(moments: _Moments, start: _Start) -> Floats | None:
    squares = moments.squares[:, :9].reshape(3, 3, 3, 3).transpose(0, 2, 1, 3).reshape(9, 9)
    gram = np.zeros((10, 10))
    gram[:9, :9] = squares
    gram[9, :9] = gram[:9, 9] = moments.along[:, :3].ravel()
    gram[9, 9] = moments.residuals[0]
    beside = np.zeros((10, 9))
    beside[:9, :8], beside[9, 8] = start.basis[:, :8], 1.0
    U = _factor(beside.T @ gram @ beside, beside.T @ moments.rotation_means @ beside, np.trace(squares))
    return None if U is None else U @ start.basis.T


def _factor(squares: Floats, means: Floats, size: float) -> Floats | None:
    """Upper triangular factor of squares minus means, the answer's column last; None where digits would be lost.

    ``size`` is the sum of squares of the terms that cancel in the answer's column: the measure of its rounding.
    """
    diagonal = np.diag(squares)[:-1]
    if not (diagonal > 0.0).all():
        return None
    scale = np.sqrt(diagonal)
    gram = squares - means
    try:
        L = np.linalg.cholesky(gram[:-1, :-1] / scale / scale[:, None])
    except np.linalg.LinAlgError:
        return None
    last = np.linalg.solve(L, gram[:-1, -1] / scale)
    own = squares[-1, -1]
    left = gram[-1, -1] - float(last @ last)
    if np.diag(L).min() ** 2 < WEAKEST or (left < KEPT * own and own > np.finfo(np.float64).eps * size):
        return None
    U = np.zeros_like(gram)
    U[:-1, :-1], U[:-1, -1], U[-1, -1] = L.T * scale, last, np.sqrt(max(left, 0.0))
    return U
