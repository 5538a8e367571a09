"""Which pixels lie along the edges of a quadrangle, and where do two fitted edges meet?

Each edge gets a frame of its own: s counts pixels along the image axis that the edge follows more closely, t along the
other one. An edge is a curve t = a + b x + c x², with x from -1 to 1 along it, so that strips are whole pixels of whole
columns of s and nothing is interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats
from sixthlink.target.target import GreyImage

__all__ = ["EdgeFrames", "Strips", "edge_frames", "edge_strips", "meeting_points"]

Bools = npt.NDArray[np.bool_]

ENOUGH_COLUMNS = 40
"""Of a long edge not every column is taken, but at least so many on each side of its middle."""


@dataclass(frozen=True, eq=False)
class EdgeFrames:
    """Frames of the edges of some quadrangles: edge 4 k + i goes from corner i of quadrangle k to the next one.

    Attributes:
        upright: ``(E,)`` whether s is v and t is u; otherwise s is u and t is v.
        middle: ``(E, 2)`` s and t halfway between the corners [pixel].
        half: ``(E,)`` half the edge's length along s [pixel].
        slope: ``(E,)`` dt/dx of the line from corner to corner [pixel].
        along: ``(E, 2)`` unit vector along the edge, in s and t.
        outward: ``(E,)`` cosine between t and the edge's outward normal: 1 or -1 where the edge follows s exactly.
    """

    upright: Bools
    middle: Floats
    half: Floats
    slope: Floats
    along: Floats
    outward: Floats

    @property
    def lengths(self) -> Floats:
        """``(E,)`` lengths of the edges [pixel]."""
        return np.asarray(2.0 * self.half / np.abs(self.along[:, 0]))

    def own(self, pixels: Floats) -> Floats:
        """Coordinates s and t ``(E, ..., 2)`` of pixels ``(E, ..., 2)``."""
        upright = self.upright.reshape(-1, *[1] * (pixels.ndim - 1))
        return np.where(upright, pixels[..., ::-1], pixels)

    def height(self, line: Floats, x: Floats) -> Floats:
        """Coordinate t ``(E, N)`` of the curves ``(E, 3)`` at x ``(E, N)``."""
        a, b, c = line.T[:, :, None]
        return np.asarray(a + x * (b + x * c))


@dataclass(frozen=True, eq=False)
class Strips:
    """Pixels along edges.

    Attributes:
        x: ``(E, N)`` position of each column along the edge.
        t: ``(E, N, M)`` of each pixel.
        along: ``(E, N, M)`` way along the edge from its middle [pixel].
        outside: ``(E, N, M)`` distance from the edge, positive outside the quadrangle [pixel].
        grey: ``(E, N, M)`` grey values.
        valid: ``(E, N, M)`` whether the pixel is in the image and beside the edge, clear of its ends.
    """

    x: Floats
    t: Floats
    along: Floats
    outside: Floats
    grey: Floats
    valid: Bools


def edge_frames(quads: Floats) -> EdgeFrames:
    """Frames of the edges of quadrangles ``(T, 4, 2)``, whose corners go round clockwise in the image [pixel]."""
    start, end = quads.reshape(-1, 2), np.roll(quads, -1, axis=1).reshape(-1, 2)
    way = end - start
    upright = np.abs(way[:, 1]) > np.abs(way[:, 0])
    ds, dt = np.where(upright[:, None], way[:, ::-1], way).T
    length = np.maximum(np.hypot(ds, dt), 1e-6)
    middle = 0.5 * (start + end)
    return EdgeFrames(
        upright,
        np.where(upright[:, None], middle[:, ::-1], middle),
        np.maximum(0.5 * np.abs(ds), 1e-6),
        0.5 * dt * np.sign(ds),
        np.stack([ds, dt], axis=1) / length[:, None],
        np.where(upright, ds, -ds) / length,
    )


def edge_strips(image: GreyImage, frames: EdgeFrames, line: Floats, half_width_px: Floats, clear_px: Floats) -> Strips:
    """Pixels within ``half_width_px (E,)`` of the curves ``(E, 3)``, ``clear_px (E,)`` away from the edges' ends."""
    columns = int(np.ceil(frames.half.max()))
    rows = int(np.ceil((half_width_px / np.abs(frames.outward)).max())) + 1
    every = max(1, columns // ENOUGH_COLUMNS)
    s = np.rint(frames.middle[:, 0])[:, None] + np.arange(-columns, columns + 1, every)
    x = (s - frames.middle[:, 0, None]) / frames.half[:, None]
    height = frames.height(line, x)
    t = np.asarray(np.rint(height)[:, :, None] + np.arange(-rows, rows + 1), dtype=np.float64)
    outside = (t - height[:, :, None]) * frames.outward[:, None, None]
    ds, dt = (frames.along[:, k, None, None] for k in (0, 1))
    along = (s - frames.middle[:, 0, None])[:, :, None] * ds + (t - frames.middle[:, 1, None, None]) * dt
    s3, upright = np.broadcast_to(s[:, :, None], t.shape), frames.upright[:, None, None]
    u, v = np.where(upright, t, s3).astype(np.int64), np.where(upright, s3, t).astype(np.int64)
    inside = (u >= 0) & (v >= 0) & (u < image.shape[1]) & (v < image.shape[0])
    grey = image[np.where(inside, v, 0), np.where(inside, u, 0)].astype(np.float64)
    beside = np.abs(along) <= (0.5 * frames.lengths - clear_px)[:, None, None]
    near = np.abs(outside) <= half_width_px[:, None, None]
    return Strips(x, t, along, outside, grey, inside & beside & near)


def meeting_points(frames: EdgeFrames, line: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Where the edges of each quadrangle meet.

    Args:
        frames: Frames of the edges.
        line: ``(E, 3)`` their curves.
        covariance: ``(E, 3, 3)`` of each curve [pixel²].

    Returns:
        ``(T, 4, 2)`` corner i, where edge i - 1 meets edge i [pixel]; ``(T, 4)`` variance of each coordinate [pixel²].
    """
    each = np.arange(len(line))
    before = 4 * (each // 4) + (each - 1) % 4
    points = np.where(frames.upright[:, None], frames.middle[:, ::-1], frames.middle)
    for _ in range(4):  # the curves are almost straight
        misses, gradients, variances = zip(
            *(_misses(frames, line, covariance, e, points) for e in (before, each)), strict=True
        )
        J = np.stack(gradients, axis=1)
        # Edges that were not found may come out parallel; their corners are refused by whoever fitted them.
        J[np.abs(np.linalg.det(J)) < 1e-3] = np.eye(2)
        inverse = np.linalg.inv(J)
        points = points - (inverse @ np.stack(misses, axis=1)[:, :, None])[:, :, 0]
    spread = (inverse**2).sum(axis=1)
    variance = 0.5 * (spread * np.stack(variances, axis=1)).sum(axis=1)
    return points.reshape(-1, 4, 2), variance.reshape(-1, 4)


def _misses(
    frames: EdgeFrames, line: Floats, covariance: Floats, e: npt.NDArray[np.int64], points: Floats
) -> tuple[Floats, Floats, Floats]:
    """By how much points ``(E, 2)`` miss edges e along t; the gradient by u and v; the variance of the edge there."""
    s, t = np.where(frames.upright[e, None], points[:, ::-1], points).T
    # A wild point would make the curve wilder still.
    x = np.clip((s - frames.middle[e, 0]) / frames.half[e], -2.0, 2.0)
    powers = np.stack([np.ones_like(x), x, x * x], axis=1)
    miss = t - (powers * line[e]).sum(axis=1)
    fall = -(line[e, 1] + 2.0 * line[e, 2] * x) / frames.half[e]
    gradient = np.where(
        frames.upright[e, None], np.stack([np.ones_like(x), fall], 1), np.stack([fall, np.ones_like(x)], 1)
    )
    return miss, gradient, np.einsum("ei,eij,ej->e", powers, covariance[e], powers)
