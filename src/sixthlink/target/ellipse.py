"""Where exactly is the middle of a dark disc?

A disc seen askew is a dark ellipse on bright ground. Across its rim the lens blurs the step of grey into a Gaussian's
integral Φ, so that every pixel near the rim says how far from it the rim runs. One model of these grey values is
fitted to each disc by least squares,

    grey = (1 + slope · x) (dark + step Φ(d / s + ½ κ s)),

d being a pixel's distance from the ellipse and s the blur: pixels count by their squared gradient, as in direct fits
of a conic to image gradients (Ouellet and Hébert 2009), but nothing is interpolated or differentiated, and the
uncertainty follows from the residuals of the same fit. The slope keeps uneven light from pulling the middle, and the
rim's curvature κ accounts for blur that moves a bent edge outwards.

The model is a little wrong where the blur is no Gaussian or nearly as wide as the disc. Such errors are alike on
opposite sides of the rim and cannot move the middle. The last step fits them away, so that they do not count as noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["Ellipses", "fit_discs"]

Singles = npt.NDArray[np.float32]
Bools = npt.NDArray[np.bool_]

UNKNOWNS, ALIKE = 10, 6
"""Centre (2), root M of the shape (3), blur, dark grey, step of grey, slope of the light (2), in this order; and the
columns of the last step that are alike on opposite sides."""

DENSITY, FEW_RAYS, MOST_RAYS = 1.4, 40, 160
"""Places per pixel along rays and rim, which round to nearly every pixel of a small disc's rim; rays of the first fit
and of the last: beyond 18 pixels of radius some pixels are left out to save time."""

LEAST_BLUR_PX, MOST_BLUR_PX = 0.25, 8.0
"""Between these the blur is looked for; a pixel's own area already blurs by 0.29."""

SMALLEST_SEMI_AXIS_PX, LARGEST_SIGMA_PX = 1.2, 0.2
"""In narrower ellipses rim and blur cannot be told apart; a middle less certain is no measurement."""

LEAST_STEP, MOST_MISFIT = 1.0, 0.25
"""Least step from dark to bright [grey value], and RMS residual of a fit that can be trusted as a share of it."""

ODD_HARMONICS = (3, 5)
"""Waves around the rim that no unknown follows: they tell how much neighbouring pixels err together."""


@dataclass(frozen=True, eq=False)
class Ellipses:
    """Fitted ellipses.

    Attributes:
        centres: ``(N, 2)`` middles [pixel].
        shapes: ``(N, 2, 2)`` symmetric E of (p - c)ᵀ E⁻¹ (p - c) = 1 on the rim: its eigenvalues are the squared
            semi-axes [pixel²].
        covariances: ``(N, 2, 2)`` covariance of each middle [pixel²].
        good: ``(N,)`` whether each can be trusted; where false, middle and shape are the first estimates and the
            covariance is infinite.
    """

    centres: Floats
    shapes: Floats
    covariances: Floats
    good: Bools

    @property
    def sigmas_px(self) -> Floats:
        """``(N,)`` standard deviation of a coordinate, the quadratic mean of both [pixel]."""
        return np.asarray(np.sqrt(0.5 * np.trace(self.covariances, axis1=1, axis2=2)))

    @property
    def radii_px(self) -> Floats:
        """``(N,)`` radius of the circle of equal area [pixel]."""
        return np.asarray(np.linalg.det(self.shapes) ** 0.25)


@dataclass(frozen=True, eq=False)
class _Samples:
    """Pixels around the rims, all ``(N, P)``: place from each disc's origin, grey value, 1 where it counts or 0."""

    x: Singles
    y: Singles
    grey: Singles
    counts: Singles


def fit_discs(image: GreyImage, centres: Floats, shapes: Floats, room: Floats, off_px: float) -> Ellipses:
    """Ellipses of dark discs on bright ground, from the grey values around their rims.

    Args:
        image: ``(height, width)`` grey image; it is not modified.
        centres: ``(N, 2)`` first estimates of the middles [pixel].
        shapes: ``(N, 2, 2)`` first estimates of the shapes, as in :class:`Ellipses` [pixel²].
        room: ``(N,)`` how far from its middle, in radii of the disc, nothing but plain ground is seen.
        off_px: How wrong the first estimates of a middle or a radius may be [pixel].

    Returns:
        The ellipses. One is good if it lies in the image, is darker than its ground, the model explains the grey values
        and neither middle nor size moved farther than the first estimates may be wrong.
    """
    if not len(centres):
        return Ellipses(np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, 2)), np.zeros(0, dtype=np.bool_))
    origins = np.rint(centres)
    state = _first_state(centres - origins, shapes, off_px)
    wide = _samples(image, origins, state, room, 2.0 + 2.0 * off_px, rays=FEW_RAYS)
    state[:, 6], bright = np.quantile(wide.grey, (0.1, 0.9), axis=1)
    state[:, 7] = bright - state[:, 6]
    state = _fitted(state, wide, 12)
    reach = 0.7 + 2.2 * float(np.median(state[:, 5]))
    close = _samples(image, origins, state, room, reach, rays=MOST_RAYS)
    state = _fitted(state, close, 4)
    steps, covariances, misfits = _last_step(state, close)
    M = _roots(state)
    fitted = np.asarray(np.linalg.inv(M @ M), dtype=np.float64)
    found = Ellipses(origins + state[:, :2] + steps, fitted, covariances, misfits < MOST_MISFIT)
    reach = 1.0 + 2.0 * off_px
    good = found.good & _inside(found, image) & (found.sigmas_px < LARGEST_SIGMA_PX)
    good &= np.linalg.norm(steps, axis=1) <= 4.0 * found.sigmas_px + 0.02
    good &= np.linalg.norm(found.centres - centres, axis=1) <= reach
    good &= np.abs(found.radii_px - np.linalg.det(shapes) ** 0.25) <= reach
    good &= np.linalg.eigvalsh(fitted)[:, 0] >= SMALLEST_SEMI_AXIS_PX**2
    covariances[~good], fitted[~good] = np.diag([np.inf, np.inf]), shapes[~good]
    return Ellipses(np.where(good[:, None], found.centres, centres), fitted, covariances, good)


def _inside(found: Ellipses, image: GreyImage) -> Bools:
    """Which ellipses lie in the image with all of their rim, and a pixel of ground around it."""
    reach = np.sqrt(np.diagonal(found.shapes, axis1=1, axis2=2)) + 1.0
    low, high = found.centres - reach, found.centres + reach
    return np.asarray(((low >= 0.0) & (high <= np.array(image.shape)[::-1] - 1.0)).all(axis=1))


def _first_state(offsets: Floats, shapes: Floats, off_px: float) -> Floats:
    """``(N, 10)`` first unknowns; the greys are still 0."""
    values, vectors = np.linalg.eigh(shapes)
    M = (vectors / np.sqrt(np.maximum(values, 1.0))[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    state = np.zeros((len(offsets), UNKNOWNS))
    state[:, :2] = offsets
    state[:, 2], state[:, 3], state[:, 4] = M[:, 0, 0], M[:, 0, 1], M[:, 1, 1]
    state[:, 5] = 0.7 + 0.6 * off_px
    return state


def _roots(state: Floats) -> Floats:
    """``(N, 2, 2)`` symmetric M of |M (p - c)| = 1 on the rim."""
    return np.stack([state[:, 2:4], state[:, 3:5]], axis=1)


def _samples(image: GreyImage, origins: Floats, state: Floats, room: Floats, reach_px: float, *, rays: int) -> _Samples:
    """Pixels within reach of each rim, each once: places on rays across the rim, rounded."""
    height, width = image.shape
    M = _roots(state)
    longest = 1.0 / float(np.linalg.eigvalsh(M)[:, 0].min())
    A = int(np.clip(np.ceil(DENSITY * 2.0 * np.pi * longest), FEW_RAYS, rays))
    angle = np.arange(A) * (2.0 * np.pi / A)
    q = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rim, normal = q @ np.linalg.inv(M), q @ M
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    steps = np.linspace(-reach_px, reach_px, int(np.ceil(2.0 * DENSITY * reach_px)) + 1)
    places = (origins + state[:, :2])[:, None, None] + rim[:, :, None] + steps[:, None] * normal[:, :, None]
    last = np.array([width, height]) - 1
    u, v = np.moveaxis(np.clip(np.rint(places), 0, last).astype(np.int64).reshape(len(M), -1, 2), -1, 0)
    index = np.sort(v * width + u, axis=1)
    once = np.ones_like(index, dtype=np.bool_)
    once[:, 1:] = index[:, 1:] != index[:, :-1]
    # Those that count come first, so that the rest can be cut off.
    first = np.argsort(~once, axis=1, kind="stable")[:, : int(once.sum(axis=1).max())]
    index, once = np.take_along_axis(index, first, axis=1), np.take_along_axis(once, first, axis=1)
    v, u = np.divmod(index, width)
    x, y = u - origins[:, 0, None], v - origins[:, 1, None]
    q = np.stack([x - state[:, 0, None], y - state[:, 1, None]], axis=-1) @ M
    counts = once & (np.linalg.norm(q, axis=-1) <= room[:, None])
    return _Samples(*(k.astype(np.float32) for k in (x, y, image[v, u], counts)))


def _model(state: Floats, samples: _Samples, columns: int = UNKNOWNS) -> tuple[Singles, Singles]:
    """Grey values ``(N, P)`` of the model less those of the image, and their derivatives ``(N, columns, P)``.

    With q = M (p - c), the gradient of |q| is g = |M q| / |q|, the distance from the rim to first order
    d = (|q| - 1) / g, and the rim's curvature κ = det(M)² / g³.
    """
    from scipy.special import ndtr

    cx, cy, m11, m12, m22, s, dark, step, by_x, by_y = state.T.astype(np.float32)[..., None]
    x, y = samples.x - cx, samples.y - cy
    qx, qy = m11 * x + m12 * y, m12 * x + m22 * y
    norm = np.sqrt(qx * qx + qy * qy) + np.float32(1e-6)  # a pixel may be the very middle
    qx, qy = qx / norm, qy / norm
    nx, ny = m11 * qx + m12 * qy, m12 * qx + m22 * qy
    determinant = m11 * m22 - m12 * m12
    gradient = np.maximum(np.sqrt(nx * nx + ny * ny), determinant / (m11 + m22))
    nx, ny, qx, qy = nx / gradient, ny / gradient, qx / gradient, qy / gradient
    far = (norm - 1) / (gradient * s)
    bend = determinant**2 * s / (2 * gradient**3)
    z = far + bend
    light = (1 + by_x * x + by_y * y) * samples.counts
    share = ndtr(z)
    shade = dark + step * share
    rise = np.exp(np.float32(-0.5) * z * z) * light * (step * np.float32(1.0 / np.sqrt(2.0 * np.pi)) / s)
    J = np.empty((len(z), columns, z.shape[1]), dtype=np.float32)
    J[:, 0], J[:, 1] = -rise * nx, -rise * ny
    J[:, 2], J[:, 3], J[:, 4] = rise * qx * x, rise * (qx * y + qy * x), rise * qy * y
    J[:, 5] = rise * (bend - far)
    J[:, 6], J[:, 7] = light, light * share
    J[:, 8], J[:, 9] = samples.counts * shade * x, samples.counts * shade * y
    if columns > UNKNOWNS:
        c, d = nx * nx - ny * ny, 2 * nx * ny
        skew, peak = rise * (z * z - 1), rise * z * (z * z - 3)
        for k, column in enumerate((rise * z * c, rise * z * d, skew, skew * c, skew * d, peak)):
            J[:, UNKNOWNS + k] = column
    return light * shade - samples.grey * samples.counts, J


def _fitted(state: Floats, samples: _Samples, iterations: int) -> Floats:
    """The unknowns after damped Gauss-Newton steps (Levenberg and Marquardt), each disc with its own damping."""
    damping = np.full(len(state), 1e-3)
    r, J = _model(state, samples)
    cost, (A, b) = (r * r).sum(axis=1), _normal(r, J)
    for _ in range(iterations):
        trial = state - _solved(A, b, damping)
        trial[:, 5] = np.clip(trial[:, 5], LEAST_BLUR_PX, MOST_BLUR_PX)
        sane = _sane(trial)
        trial = np.where(sane[:, None], trial, state)
        r, J = _model(trial, samples)
        trial_cost, (trial_A, trial_b) = (r * r).sum(axis=1), _normal(r, J)
        better = sane & (trial_cost < cost)
        moved = np.abs(trial - state)[:, :2].max(axis=1)
        state, cost = np.where(better[:, None], trial, state), np.where(better, trial_cost, cost)
        A, b = np.where(better[:, None, None], trial_A, A), np.where(better[:, None], trial_b, b)
        damping = np.clip(np.where(better, 0.1 * damping, 10.0 * damping), 1e-9, 1e3)
        if (moved[sane] < 1e-3).all():
            break
    return state


def _sane(state: Floats) -> Bools:
    """Which unknowns describe an ellipse at all, of a size that can be computed with."""
    trace, determinant = state[:, 2] + state[:, 4], state[:, 2] * state[:, 4] - state[:, 3] ** 2
    return np.asarray((trace > 0.0) & (trace < 10.0) & (determinant > 1e-9) & (np.abs(state) < 1e6).all(axis=1))


def _normal(r: Singles, J: Singles) -> tuple[Floats, Floats]:
    """J Jᵀ ``(N, K, K)`` and J r ``(N, K)``."""
    A, b = J @ np.swapaxes(J, 1, 2), (J @ r[..., None])[..., 0]
    return A.astype(np.float64), b.astype(np.float64)


def _solved(A: Floats, b: Floats, damping: Floats) -> Floats:
    """``(N, K)`` solutions, each unknown damped by its own scale."""
    scale = np.sqrt(np.maximum(np.diagonal(A, axis1=1, axis2=2), 1e-9))
    scaled = A / (scale[:, :, None] * scale[:, None, :]) + damping[:, None, None] * np.eye(A.shape[1])
    return np.asarray(np.linalg.solve(scaled, (b / scale)[..., None])[..., 0] / scale)


def _last_step(state: Floats, samples: _Samples) -> tuple[Floats, Floats, Floats]:
    """Last steps ``(N, 2)`` of the middles, their covariances ``(N, 2, 2)``, and misfits ``(N,)`` in steps of grey.

    The covariance is that of White (1980) with residuals divided by what their own influence on the fit leaves of
    them (HC2): it need not know that bright pixels are noisier than dark ones.
    """
    r, J = _model(state, samples, UNKNOWNS + ALIKE)
    A, b = _normal(r, J)
    steps = -_solved(A, b, np.full(len(A), 1e-6))
    r += (np.swapaxes(J, 1, 2) @ steps[..., None].astype(np.float32))[..., 0]
    scale = np.sqrt(np.maximum(np.diagonal(A, axis1=1, axis2=2), 1e-9))
    outer = scale[:, :, None] * scale[:, None, :]
    AJ = (np.linalg.inv(A / outer + 1e-6 * np.eye(UNKNOWNS + ALIKE)) / outer).astype(np.float32) @ J
    r /= np.sqrt(np.maximum(1.0 - (AJ * J).sum(axis=1), 0.1))
    L = AJ[:, :2] * r[:, None]
    covariances = (L @ np.swapaxes(L, 1, 2)).astype(np.float64)
    misfits = np.sqrt((r * r).sum(axis=1) / np.maximum(samples.counts.sum(axis=1), 1.0))
    misfits = np.where(state[:, 7] >= LEAST_STEP, misfits / np.maximum(state[:, 7], LEAST_STEP), np.inf)
    trusted = misfits < MOST_MISFIT
    if trusted.any():
        covariances *= _together(r[trusted], J[trusted])
        # What is wrong with one disc alone, dirt or glare, is no noise and does not average out.
        unusual = misfits[trusted] / (2.0 * np.median(misfits[trusted]))
        covariances[trusted] *= np.maximum(unusual, 1.0)[:, None, None] ** 2
    return steps[:, :2], covariances, misfits.astype(np.float64)


def _together(r: Singles, J: Singles) -> float:
    """How much larger the variance of a middle is because neighbouring pixels err together: at least 1.

    Were they independent, every wave around the rim would get the same power from the residuals.
    """
    gx, gy = J[:, 0], J[:, 1]
    g = np.hypot(gx, gy)
    turn = (gx + 1j * gy) / np.maximum(g, 1e-6)
    pull = g * r
    alone = np.maximum((pull * pull).sum(axis=1), 1e-12)
    power = [np.abs((pull * turn**m).sum(axis=1)) ** 2 / alone for m in ODD_HARMONICS]
    return max(1.0, float(np.mean(power)))
