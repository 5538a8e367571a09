"""Flat things painted into images by brute force: many rays per pixel, a blurred lens, noise. Pixel truth is exact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial.transform import Rotation

BLACK, WHITE, GREY = 30.0, 215.0, 100.0
Paint = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Grey value of the plane at x, y [m]."""


@dataclass(frozen=True)
class View:
    """A pinhole camera without distortion before the plane z = 0."""

    width: int
    height: int
    focal: float
    R: np.ndarray
    t: np.ndarray

    def pixels(self, points_m: np.ndarray) -> np.ndarray:
        P = points_m @ self.R.T + self.t
        centre = np.array([(self.width - 1) / 2, (self.height - 1) / 2])
        return self.focal * P[:, :2] / P[:, 2:] + centre

    def plane(self, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where the rays through pixels meet the plane."""
        x, y = (u - (self.width - 1) / 2) / self.focal, (v - (self.height - 1) / 2) / self.focal
        n = self.R[:, 2]
        depth = (n @ self.t) / (n[0] * x + n[1] * y + n[2])
        P = np.stack([x * depth, y * depth, depth]) - self.t[:, None, None]
        return self.R[:, 0] @ P.reshape(3, -1), self.R[:, 1] @ P.reshape(3, -1)


def view(
    middle_m: tuple[float, float],
    *,
    width: int = 800,
    height: int = 640,
    focal: float = 1600.0,
    distance: float = 0.6,
    angles_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
    aside_m: tuple[float, float] = (0.0, 0.0),
) -> View:
    """A view of a plane whose point ``middle_m`` appears near the image's middle; angles about x, y and the sight."""
    R = Rotation.from_euler("xyz", angles_deg, degrees=True).as_matrix()
    t = np.array([*aside_m, distance]) - R @ np.array([*middle_m, 0.0])
    return View(width, height, focal, R, t)


def painted(paint: Paint, seen: View, *, rays: int = 4, blur: float = 0.7, noise: float = 2.0, seed: int = 0):
    """8-bit image of the plane."""
    u, v = np.meshgrid(np.arange(seen.width, dtype=float), np.arange(seen.height, dtype=float))
    steps = (np.arange(rays) + 0.5) / rays - 0.5
    total = sum(paint(*seen.plane(u + du, v + dv)) for du in steps for dv in steps)
    image = gaussian_filter(total.reshape(u.shape) / rays**2, blur)
    image += np.random.default_rng(seed).normal(0.0, noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def chessboard(columns: int, rows: int, square: float, *, first: float = BLACK) -> Paint:
    """Board with one white square around it; ``first`` is the colour up and left of inner corner 0."""
    second = WHITE if first == BLACK else BLACK

    def paint(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        i, j = np.floor(x / square), np.floor(y / square)
        board = (i >= -1) & (i < columns) & (j >= -1) & (j < rows)
        paper = (i >= -2) & (i <= columns) & (j >= -2) & (j <= rows)
        return np.where(board, np.where((i + j) % 2 == 0, first, second), np.where(paper, WHITE, GREY))

    return paint


def texture(image: np.ndarray, pixel_m: float) -> Paint:
    """A printed image whose upper left corner is the origin, on white paper."""

    def paint(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        at = [y / pixel_m - 0.5, x / pixel_m - 0.5]
        grey = map_coordinates(image.astype(float), at, order=0, mode="constant", cval=255.0)
        return BLACK + (WHITE - BLACK) * grey / 255.0

    return paint


def quadrants(radius: float, *, centres: tuple[tuple[float, float], ...] = ((0.0, 0.0),), turn: float = 0.3) -> Paint:
    """Discs of black and white quarters on a light bar along x."""

    def paint(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        grey = np.where((np.abs(y) < 1.7 * radius) & (x < 2.0 * radius), 180.0, GREY)
        for cx, cy in centres:
            a, b = x - cx, y - cy
            p, q = np.cos(turn) * a + np.sin(turn) * b, np.cos(turn) * b - np.sin(turn) * a
            grey = np.where(a * a + b * b < radius**2, np.where(p * q > 0, BLACK, WHITE), grey)
        return grey

    return paint
