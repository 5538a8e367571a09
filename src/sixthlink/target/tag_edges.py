"""Where exactly do the outer edges of a printed tag meet?

The corner of a tag is no saddle, but the two edges that meet in it are known along their whole length. Each is fitted
to the grey values themselves, as a step that lens and pixel have blurred:

    grey = light · (dark + (bright - dark) · (Φ(z) + D · Φ(-z - room))),     z = distance / blur

D are the white cells behind the border, known once the tag has been read: a small tag is seen through their glow. Where
the edge is, its slope and bend, the blur, both greys and the light's change along the edge, to second order, and across
it are free: taken as even along the edge, light that a lens takes from the image's corners would look like a bend. A
lens bends straight edges, but little, and the prior on the bend says so; so do those on the light. The residuals give
each edge's covariance, and two edges a corner's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.clipping import largest_grey
from sixthlink.target.edge_strips import EdgeFrames, Strips, edge_frames, edge_strips, meeting_points
from sixthlink.target.target import GreyImage

__all__ = ["RefinedQuads", "refine_quads"]

Bools = npt.NDArray[np.bool_]

UNKNOWNS = 9
"""Of an edge."""

BEND = 0.04
"""Standard deviation of the curvature of a straight edge's image, in units of one over the image width."""

LIGHT_SLOPE, LIGHT_CURVATURE = 2.0, 4.0
"""Standard deviation of the light's relative change per image width, across an edge, and of its second derivative,
along an edge: a wide lens leaves half of the light in the image's corners."""

FIRST_BLUR_PX, LEAST_BLUR_PX, MOST_BLUR_PX = 1.0, 0.3, 8.0

WIDEST_PX = 8.0
"""Half the width of a strip at most: what is farther says nothing about where the edge is."""

ROUNDS, STEPS = 2, 8
"""Strips that are laid for each edge, and Gauss-Newton steps in each."""

CLEAN_STEP, DIRT = 3, 3.0
"""Before this step columns of pixels are dropped that misfit by so many times the middle one of their edge: something
lies across the edge there."""

LEAST_PIXELS = 40
"""Fewer pixels in a strip do not carry the nine unknowns of an edge."""

MOST_NOISE = 0.15
"""Residual, in units of the step, above which the strip shows something else."""

REACH = 0.15
"""A corner that moves farther than this from its first estimate, in tag sides, was drawn to something else."""

TAGS_AT_ONCE = 16
"""Their strips stay in the processor's cache."""


@dataclass(frozen=True, eq=False)
class RefinedQuads:
    """Corners of tags.

    Attributes:
        corners: ``(T, 4, 2)`` where they are [pixel].
        sigmas_px: ``(T, 4)`` standard deviation of each coordinate, by the image itself [pixel].
        good: ``(T, 4)`` whether each can be trusted: both edges are seen and the corner stayed within reach.
    """

    corners: Floats
    sigmas_px: Floats
    good: Bools


@dataclass(frozen=True, eq=False)
class _Fit:
    """Fitted edges: curves ``(E, 3)`` in their frames, covariances ``(E, 3, 3)``, blurs and whether each is seen."""

    line: Floats
    covariance: Floats
    blur_px: Floats
    seen: Bools


@dataclass(frozen=True, eq=False)
class _Glow:
    """Data cells behind each edge.

    Attributes:
        white: ``(E, K)`` 1 where a cell is white.
        ends_px: ``(E, K + 1)`` where the cells end, along the edge from its middle [pixel].
        room: ``(E, 2)`` the border's width at the edge's middle, and how it grows with x [pixel].
    """

    white: Floats
    ends_px: Floats
    room: Floats


def refine_quads(image: GreyImage, quads: Floats, cells: Bools, border: int, gap: float) -> RefinedQuads:
    """Corners of tags, refined to hundredths of a pixel.

    Args:
        image: ``(height, width)`` grey image.
        quads: ``(T, 4, 2)`` first estimates, clockwise in the image [pixel].
        cells: ``(T, 4, K)`` whether each data cell along each side is white; side i goes from corner i to the next.
        border: Width of the black border [cells].
        gap: White space around each tag, in tag sides.
    """
    starts = range(0, len(quads), TAGS_AT_ONCE)
    blocks = [slice(start, start + TAGS_AT_ONCE) for start in starts]
    parts = [_refined(image, quads[b], cells[b].reshape(-1, cells.shape[2]), border, gap) for b in blocks]
    corners, sigmas_px, good = (np.concatenate(part) for part in zip(*parts, strict=True))
    return RefinedQuads(corners, sigmas_px, good)


def _refined(image: GreyImage, quads: Floats, cells: Bools, border: int, gap: float) -> tuple[Floats, Floats, Bools]:
    """What :class:`RefinedQuads` holds, for a few tags."""
    share = border / (cells.shape[1] + 2 * border)
    frames = edge_frames(quads)
    smallest = np.repeat(frames.lengths.reshape(-1, 4).min(axis=1), 4)
    room, free = share * smallest, gap * smallest
    line = _steepest(image, frames, room)
    corners, _ = meeting_points(frames, line, np.zeros((len(line), 3, 3)))
    frames = edge_frames(corners)
    fit = _Fit(
        _chords(frames), np.zeros((len(line), 3, 3)), np.full(len(line), FIRST_BLUR_PX), np.zeros(len(line), bool)
    )
    for _ in range(ROUNDS):
        fit = _fitted(image, frames, fit, free, _glow(frames, fit.line, corners, cells, share))
        corners, variances = meeting_points(frames, fit.line, fit.covariance)
    moved = np.linalg.norm(corners - quads, axis=2) <= np.maximum(REACH * smallest.reshape(-1, 4), 1.5)
    seen = (fit.seen & (fit.blur_px < np.maximum(room, 1.0))).reshape(-1, 4)
    good = seen & np.roll(seen, 1, axis=1) & moved
    return corners, np.sqrt(variances), good


def _chords(frames: EdgeFrames) -> Floats:
    """The straight lines ``(E, 3)`` from corner to corner."""
    return np.stack([frames.middle[:, 1], frames.slope, np.zeros(len(frames.slope))], axis=1)


def _steepest(image: GreyImage, frames: EdgeFrames, room_px: Floats) -> Floats:
    """Lines ``(E, 3)`` along the steepest rise from dark inside to bright outside, within the border's width."""
    line = _chords(frames)
    for _ in range(3):
        strips = edge_strips(image, frames, line, 2.0 * room_px, np.full(len(room_px), 2.0))
        rise = np.zeros_like(strips.grey)
        rise[:, :, 1:-1] = strips.grey[:, :, 2:] - strips.grey[:, :, :-2]
        # What falls outwards are edges of the data cells and of the next tag.
        rise = np.maximum(rise * np.sign(frames.outward)[:, None, None], 0.0)
        near = np.exp(-2.0 * (strips.outside / room_px[:, None, None]) ** 2)
        w = rise**2 * near * strips.valid
        columns, x = w.sum(axis=2), strips.x
        m0, m1, m2 = (np.sum(columns * x**k, axis=1) for k in range(3))
        y0, y1 = (np.sum((w * strips.t).sum(axis=2) * x**k, axis=1) for k in range(2))
        determinant = m0 * m2 - m1 * m1
        found = determinant > 1e-6 * m0 * m0
        safe = np.where(found, determinant, 1.0)
        line[:, 0] = np.where(found, (m2 * y0 - m1 * y1) / safe, line[:, 0])
        line[:, 1] = np.where(found, (m0 * y1 - m1 * y0) / safe, line[:, 1])
    return line


def _glow(frames: EdgeFrames, line: Floats, quads: Floats, cells: Bools, share: float) -> _Glow:
    """Where the data cells behind each edge are, seen in perspective; the border's width is ``share`` of the tag."""
    p = np.stack([np.roll(quads, -i, axis=1) for i in range(4)], axis=1).reshape(-1, 4, 2)
    # The unit square on to each quadrangle (Heckbert 1989), its side from (0, 0) to (1, 0) on to the edge.
    d1, d2, d3 = p[:, 1] - p[:, 2], p[:, 3] - p[:, 2], p[:, 0] - p[:, 1] + p[:, 2] - p[:, 3]
    area = _cross(d1, d2)
    g, h = (_cross(*d) / np.where(area == 0.0, 1.0, area) for d in ((d3, d2), (d1, d3)))
    a, b = p[:, 1] - p[:, 0] + g[:, None] * p[:, 1], p[:, 3] - p[:, 0] + h[:, None] * p[:, 3]
    x = np.linspace(share, 1.0 - share, cells.shape[1] + 1)[:, None]
    depth = 1.0 + g[:, None, None] * x + h[:, None, None] * share
    ends = frames.own((p[:, :1] + a[:, None] * x + b[:, None] * share) / depth)
    from_middle = ends - frames.middle[:, None]
    along = (from_middle * frames.along[:, None]).sum(axis=2)
    x_ends = from_middle[:, :, 0] / frames.half[:, None]
    width = (frames.height(line, x_ends) - ends[:, :, 1]) * frames.outward[:, None]
    growth = (width[:, -1] - width[:, 0]) / (x_ends[:, -1] - x_ends[:, 0])
    return _Glow(cells.astype(np.float64), along, np.stack([width[:, 0] - growth * x_ends[:, 0], growth], axis=1))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _fitted(image: GreyImage, frames: EdgeFrames, before: _Fit, free_px: Floats, glow: _Glow) -> _Fit:
    """The edges fitted to the grey values of the strips along them: Gauss-Newton on all edges at once."""
    blur = before.blur_px
    wide = np.minimum(3.0 * blur + 1.0, WIDEST_PX)
    inner = np.minimum(wide, np.maximum(glow.room[:, 0], 1.0))
    # The next tag must not shine in from outside, but a strip without a bright side says nothing.
    outer = np.clip(free_px - 2.5 * blur, np.minimum(wide, 1.5 * blur + 1.0), wide)
    clear = np.clip(3.0 * blur, 2.0, np.maximum(0.15 * frames.lengths, 2.0))
    strips = edge_strips(image, frames, before.line, np.maximum(inner, outer), clear)
    used = strips.valid & (strips.outside <= outer[:, None, None]) & (strips.outside >= -inner[:, None, None])
    w: Floats = used.reshape(len(used), -1).astype(np.float64)
    grey, out = (k.reshape(len(w), -1) for k in (strips.grey, strips.outside))
    p = np.zeros((len(w), UNKNOWNS))
    p[:, :3], p[:, 3] = before.line, np.log(blur)
    for column, side in ((4, out > 0.4 * outer[:, None]), (5, out < -0.4 * inner[:, None])):
        p[:, column] = (w * side * grey).sum(axis=1) / np.maximum((w * side).sum(axis=1), 1.0)
    lit, end_of_range = _lit(strips, glow, blur), largest_grey(image)
    half = frames.half / image.shape[1]
    expected_size = np.full((len(w), UNKNOWNS), np.inf)
    expected_size[:, 2] = 0.5 * BEND * half * frames.half
    expected_size[:, 7], expected_size[:, 8] = 0.5 * LIGHT_CURVATURE * half**2, LIGHT_SLOPE / image.shape[1]
    prior = expected_size**-2.0
    n = w.sum(axis=1)
    for k in range(STEPS):
        expected, J = _model(p, frames, strips, glow, lit)
        # Light beyond the range is recorded as its end, whatever the unknowns.
        J *= (expected < end_of_range)[:, :, None]
        r = w * (grey - np.minimum(expected, end_of_range))
        if k == CLEAN_STEP:
            w = w * _clean(r, w, strips)
            r, n = r * w, w.sum(axis=1)
        J *= w[:, :, None]
        s2 = (r * r).sum(axis=1) / np.maximum(n - UNKNOWNS, 1.0) + 1e-12
        N, gradient = J.transpose(0, 2, 1) @ J, (J.transpose(0, 2, 1) @ r[:, :, None])[:, :, 0]
        gradient -= s2[:, None] * prior * p
        N += s2[:, None, None] * prior[:, :, None] * np.eye(UNKNOWNS)
        step = (_inverted(N) @ gradient[:, :, None])[:, :, 0]
        step[:, :4] = np.clip(step[:, :4], -0.5, 0.5)
        p += step
        p[:, 3] = np.clip(p[:, 3], np.log(LEAST_BLUR_PX), np.log(MOST_BLUR_PX))
        if k > CLEAN_STEP and np.abs(step[:, :3]).max() < 1e-3:
            break
    covariance = _inverted(N)[:, :3, :3] * s2[:, None, None]
    settled = np.abs(step[:, :3]).max(axis=1) < 0.02
    seen = settled & (n >= LEAST_PIXELS) & (np.sqrt(s2) < MOST_NOISE * (p[:, 4] - p[:, 5]))
    return _Fit(p[:, :3], covariance, np.exp(p[:, 3]), seen)


def _inverted(N: Floats) -> Floats:
    """Inverses ``(E, K, K)``, each unknown by its own scale."""
    scale = np.sqrt(np.diagonal(N, axis1=1, axis2=2) + 1e-9)
    outer = scale[:, :, None] * scale[:, None, :]
    return np.asarray(np.linalg.inv(N / outer + 1e-9 * np.eye(N.shape[1])) / outer)


def _clean(r: Floats, w: Floats, strips: Strips) -> Floats:
    """1 for each pixel ``(E, P)`` in a column that fits its edge as the others do."""
    shape = strips.t.shape
    counts = w.reshape(shape).sum(axis=2)
    squares = np.where(counts > 0, (r**2).reshape(shape).sum(axis=2) / np.maximum(counts, 1.0), np.nan)
    usual = np.nanmedian(np.where((counts > 0).any(axis=1)[:, None], squares, 0.0), axis=1)
    clean = ~(squares > DIRT**2 * usual[:, None])
    return np.repeat(clean, shape[2], axis=1).astype(np.float64)


def _lit(strips: Strips, glow: _Glow, blur_px: Floats) -> Floats:
    """How white ``(E, N * M)`` the cells behind the border are beside each pixel, blurred along the edge."""
    from scipy.special import ndtr

    along = strips.along.reshape(len(blur_px), -1) / blur_px[:, None]
    ends = glow.ends_px / blur_px[:, None]
    steps = [ndtr(along - ends[:, k, None]) for k in range(ends.shape[1])]
    return np.asarray(sum(glow.white[:, k, None] * (steps[k] - steps[k + 1]) for k in range(len(steps) - 1)))


def _model(p: Floats, frames: EdgeFrames, strips: Strips, glow: _Glow, lit: Floats) -> tuple[Floats, Floats]:
    """Expected grey values ``(E, P)`` and their derivatives ``(E, P, 9)`` by the unknowns.

    The unknowns ``p (E, 9)``: three numbers of the curve, the blur's logarithm, bright and dark, and how the light
    changes with x, with x² and with every pixel outwards.
    """
    from scipy.special import ndtr

    E, blur = len(p), np.exp(p[:, 3, None])
    x = np.broadcast_to(strips.x[:, :, None], strips.t.shape).reshape(E, -1)
    per_pixel = frames.outward[:, None] / blur
    z = (strips.t.reshape(E, -1) - p[:, :1] - x * (p[:, 1:2] + x * p[:, 2:3])) * per_pixel
    behind = -(z + (glow.room[:, :1] + glow.room[:, 1:] * x) / blur)
    # The pixel adds up the light over its width: the step is a difference of integrals of Φ.
    wide = 0.5 * np.abs(per_pixel)
    (upper, upper_sum), (lower, lower_sum) = ((ndtr(k), k * ndtr(k) + _bell(k)) for k in (z + wide, z - wide))
    share = (upper_sum - lower_sum) / (2.0 * wide) + lit * ndtr(behind)
    steepness = (upper - lower) / (2.0 * wide) - lit * _bell(behind)
    bright, dark = p[:, 4:5], p[:, 5:6]
    outside = strips.outside.reshape(E, -1)
    light = 1.0 + x * (p[:, 6:7] + x * p[:, 7:8]) + outside * p[:, 8:9]
    rise = light * (bright - dark) * steepness
    shade = dark + (bright - dark) * share
    shift = -rise * per_pixel
    columns = [shift, shift * x, shift * x * x, -rise * z, light * share, light * (1.0 - share)]
    columns += [shade * x, shade * x * x, shade * outside]
    return light * shade, np.stack(columns, axis=2)


def _bell(z: Floats) -> Floats:
    """Normal density."""
    return np.asarray(np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi))
