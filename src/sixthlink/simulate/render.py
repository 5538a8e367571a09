"""What does a camera of the simulated cell record in one shot?

Every pixel's ray meets the painted plane; pixels whose area an edge crosses are looked at along many rays spread
over their whole area, the others need one. The lens blurs before the pixels add up: what each of these rays brings is
spread from where it is, not from the middle of its pixel. Then come vignetting, shot noise, read noise and 8 bits.
Nothing here knows how the calibrator projects.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.camera import Camera
from sixthlink.geometry import Floats
from sixthlink.simulate.optics import RayMap, ray_map
from sixthlink.simulate.scenario import stream
from sixthlink.simulate.sightings import target_poses
from sixthlink.simulate.surfaces import REFLECTANCE, ChessSurface, PaintedSurface, RulerSurface, Surface
from sixthlink.simulate.truth import SimulatedCell
from sixthlink.target import Drawing

__all__ = ["Exposure", "render_image", "render_target"]

Singles = npt.NDArray[np.float32]
Indices = npt.NDArray[np.intp]

FULL_SCALE = 255.0
_RAYS, _LATTICE_STEPS = 144, (113, 79, 65, 31, 89, 55, 131, 101)
"""Rays per edge pixel and the steps of their lattices, those that spread points most evenly. Every lattice has
directions in which its points are in line, and edges along them are badly measured: neighbours use different ones."""
_PIXELS_AT_ONCE = 2048
"""Edge pixels whose rays are looked at together: they stay in the processor's cache."""
_MOST_SPREAD_PX, _SPREAD_PX = 1.0, 0.7
"""Blur up to which every ray is spread by all of it, and by how much if there is more: what is left after that blurs
the sampled image, which has no detail any more that sampling could have changed."""


@dataclass(frozen=True)
class Exposure:
    """How a still image is taken.

    Attributes:
        blur_px: Gaussian blur of the lens [pixel].
        light: Factor on the light; 1 leaves white paper at 80 % of the sensor's range.
        electrons_per_grey: Photoelectrons per grey value: they set the shot noise.
        read_noise_grey: Noise of the camera in the dark [grey value].
    """

    blur_px: float = 0.7
    light: float = 1.0
    electrons_per_grey: float = 40.0
    read_noise_grey: float = 0.3


def render_target(
    drawing: Drawing, camera: Camera, T_camera_target: Floats, exposure: Exposure, random: np.random.Generator
) -> npt.NDArray[np.uint8]:
    """Image ``(h, w)`` of one printed target by one camera, before a plain grey background.

    Args:
        drawing: What is printed on the target.
        camera: The camera.
        T_camera_target: ``(4, 4)`` where the target stands; z of the target points away from the camera.
        exposure: How the image is taken.
        random: Random numbers of the noise.
    """
    rays = ray_map(camera)
    shade = _shade(PaintedSurface(drawing), T_camera_target, rays, exposure.blur_px)
    shade *= rays.light
    shade *= FULL_SCALE * exposure.light
    return _recorded(exposure.electrons_per_grey, exposure.read_noise_grey, shade, random)


def render_image(cell: SimulatedCell, shot: int, camera: int) -> npt.NDArray[np.uint8]:
    """Image ``(h, w)`` of one shot by one camera, the same whenever and in whatever order it is rendered.

    Args:
        cell: The simulated cell.
        shot: Index of the shot in the recording.
        camera: Index of the camera in the head.
    """
    truth = cell.truth
    (T_head_target,) = target_poses(truth, cell.recording.placements, [shot])
    T_camera_target = truth.rig.Ts_camera_head[camera] @ T_head_target
    rays = ray_map(truth.rig.cameras[camera])
    shade = _shade(_surface(cell, shot), T_camera_target, rays, cell.scenario.blur_px)
    shade *= rays.light
    shade *= FULL_SCALE
    scenario, random = cell.scenario, stream(cell.seed, "image", [shot, camera])
    return _recorded(scenario.electrons_per_grey, scenario.read_noise_grey, shade, random)


def _surface(cell: SimulatedCell, shot: int) -> Surface:
    if cell.recording.marks[shot]:
        return RulerSurface(cell.truth.standard_length_m, cell.scenario.mark_diameter_m)
    offsets = (cell.truth.points_m - cell.target.points_m)[:, :2] / cell.target.square_m
    return ChessSurface(cell.target.square_m, offsets.reshape(cell.target.rows, cell.target.columns, 2))


def _shade(surface: Surface, T_camera_target: Floats, rays: RayMap, blur_px: float) -> Singles:
    """Mean reflectance over the area of each pixel, seen through a lens that blurs."""
    from scipy.ndimage import correlate1d, gaussian_filter

    a, b = _plane_coordinates(T_camera_target, rays, surface.unit_m)
    labels = surface.labels(a, b)
    shade = REFLECTANCE[labels]
    # An edge that touches a pixel's area separates its centre from that of a neighbour in its row or column.
    edge = np.zeros(labels.shape, dtype=bool)
    beside, below = labels[:, 1:] != labels[:, :-1], labels[1:] != labels[:-1]
    edge[:, 1:] |= beside
    edge[:, :-1] |= beside
    edge[1:] |= below
    edge[:-1] |= below
    rows, columns = np.nonzero(edge)
    spread_px = blur_px if blur_px <= _MOST_SPREAD_PX else _SPREAD_PX
    du = ((np.arange(_RAYS) + 0.5) / _RAYS - 0.5).astype(np.float32)
    across = _spread(du, spread_px)
    reach = across.shape[1] // 2
    lattices = [np.arange(_RAYS) * step % _RAYS for step in _LATTICE_STEPS]
    weights = [(across[k, :, None] * across[:, None, :]).reshape(_RAYS, -1) / np.float32(_RAYS) for k in lattices]
    wide = labels.shape[1] + 2 * reach
    uneven = np.zeros((labels.shape[0] + 2 * reach) * wide, dtype=np.float32)
    places = [down * wide + right for down in range(2 * reach + 1) for right in range(2 * reach + 1)]
    for start in range(0, len(rows), len(lattices) * _PIXELS_AT_ONCE):
        some = np.arange(start, min(start + len(lattices) * _PIXELS_AT_ONCE, len(rows)))
        which = (3 * rows[some] + columns[some]) % len(lattices)
        for k, lattice in enumerate(lattices):
            mine = some[which == k]
            v, u = rows[mine], columns[mine]
            seen = _seen_along_rays(surface, a, b, (v, u), (du, du[lattice]))
            shade[v, u] = means = seen.mean(axis=1)
            first = v * wide + u
            for place, brought in zip(places, weights[k].T @ (seen - means[:, None]).T, strict=True):
                uneven[first + place] += brought
    evenly = across.mean(axis=0)
    for axis in (0, 1):
        shade = correlate1d(shade, evenly, axis=axis, mode="nearest")
    shade += uneven.reshape(-1, wide)[reach:-reach, reach:-reach]
    if blur_px > spread_px:
        shade = gaussian_filter(shade, np.sqrt(blur_px**2 - spread_px**2), mode="nearest", truncate=4.5)
    return shade


def _spread(at: Singles, sigma_px: float) -> Singles:
    """Share ``(rays, 2 r + 1)`` of the light that falls ``at (rays,)`` which each pixel from -r to r adds up."""
    from scipy.special import ndtr

    sigma_px = max(sigma_px, 1e-3)
    reach = int(np.ceil(4.0 * sigma_px))
    away = (np.arange(-reach, reach + 1) - at[:, None].astype(np.float64)) / sigma_px
    share = ndtr(away + 0.5 / sigma_px) - ndtr(away - 0.5 / sigma_px)
    return np.asarray(share / share.sum(axis=1, keepdims=True), dtype=np.float32)


def _plane_coordinates(T_camera_target: Floats, rays: RayMap, unit_m: float) -> tuple[Singles, Singles]:
    """Where each pixel's ray meets the target's plane, in units along its x and its y axis."""
    # A plane point is p + a x + b y and its ray that over its depth: one 3 × 3 inverse serves all rays.
    plane = np.column_stack([unit_m * T_camera_target[:3, :2], T_camera_target[:3, 3]])
    H = np.linalg.inv(plane)
    H = (H / H[2, 2]).astype(np.float32)
    a, b, depth = (h[0] * rays.x + h[1] * rays.y + h[2] for h in H)
    a /= depth
    b /= depth
    return a, b


def _seen_along_rays(
    surface: Surface, a: Singles, b: Singles, pixels: tuple[Indices, Indices], offsets: tuple[Singles, Singles]
) -> Singles:
    """Reflectance ``(M, rays)`` of pixels (rows, columns) along rays that are off their middles (along u, along v)."""
    h, w = a.shape
    rows, columns = pixels
    du, dv = offsets
    left, right = np.maximum(columns - 1, 0), np.minimum(columns + 1, w - 1)
    above, below = np.maximum(rows - 1, 0), np.minimum(rows + 1, h - 1)
    shifts = surface.shifts(a[rows, columns], b[rows, columns])
    places = []
    for plane, shift in zip((a, b), shifts, strict=True):
        by_column = (plane[rows, right] - plane[rows, left]) / (right - left).astype(np.float32)
        by_row = (plane[below, columns] - plane[above, columns]) / (below - above).astype(np.float32)
        centre = plane[rows, columns] - shift
        places.append(centre[:, None] + by_column[:, None] * du + by_row[:, None] * dv)
    return REFLECTANCE[surface.labels(*places)]


def _recorded(
    electrons_per_grey: float, read_noise_grey: float, grey: Singles, random: np.random.Generator
) -> npt.NDArray[np.uint8]:
    """Grey values with the noise of counted photons and of the electronics, in 8 bits."""
    variance = grey / np.float32(electrons_per_grey) + np.float32(read_noise_grey**2)
    noisy = random.standard_normal(grey.shape, dtype=np.float32)
    noisy *= np.sqrt(variance)
    noisy += grey
    return np.clip(np.rint(noisy), 0.0, FULL_SCALE).astype(np.uint8)
