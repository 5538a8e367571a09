"""What does a camera of the simulated cell record in one shot?

Every pixel's ray meets the painted plane; pixels whose area an edge crosses are averaged over rays spread
over their whole area, the others need one. Then come lens blur, vignetting, shot noise, read noise and 8
bits. Nothing here knows how the calibrator projects.
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

FULL_SCALE = 255.0
_RAYS, _LATTICE_STEP = 144, 89
"""Rays per edge pixel and the step of their lattice: neighbouring Fibonacci numbers spread points evenly."""
_PIXELS_AT_ONCE = 2048
"""Edge pixels that are averaged together: their rays stay in the processor's cache."""


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
    shade = _blurred(_shade(PaintedSurface(drawing), T_camera_target, rays), exposure.blur_px)
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
    shade = _blurred(_shade(_surface(cell, shot), T_camera_target, rays), cell.scenario.blur_px)
    shade *= rays.light
    shade *= FULL_SCALE
    scenario, random = cell.scenario, stream(cell.seed, "image", [shot, camera])
    return _recorded(scenario.electrons_per_grey, scenario.read_noise_grey, shade, random)


def _surface(cell: SimulatedCell, shot: int) -> Surface:
    if cell.recording.marks[shot]:
        return RulerSurface(cell.truth.standard_length_m, cell.scenario.mark_diameter_m)
    offsets = (cell.truth.points_m - cell.target.points_m)[:, :2] / cell.target.square_m
    return ChessSurface(cell.target.square_m, offsets.reshape(cell.target.rows, cell.target.columns, 2))


def _shade(surface: Surface, T_camera_target: Floats, rays: RayMap) -> Singles:
    """Mean reflectance over the area of each pixel."""
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
    for start in range(0, len(rows), _PIXELS_AT_ONCE):
        block = slice(start, start + _PIXELS_AT_ONCE)
        shade[rows[block], columns[block]] = _area_means(surface, a, b, rows[block], columns[block])
    return shade


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


def _area_means(
    surface: Surface, a: Singles, b: Singles, rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp]
) -> Singles:
    """Mean reflectance ``(M,)`` of pixels over a lattice of rays that covers each pixel's area evenly."""
    h, w = a.shape
    left, right = np.maximum(columns - 1, 0), np.minimum(columns + 1, w - 1)
    above, below = np.maximum(rows - 1, 0), np.minimum(rows + 1, h - 1)
    du = (np.arange(_RAYS, dtype=np.float32) + 0.5) / _RAYS - 0.5
    dv = ((np.arange(_RAYS) * _LATTICE_STEP % _RAYS) + np.float32(0.5)) / _RAYS - np.float32(0.5)
    shifts = surface.shifts(a[rows, columns], b[rows, columns])
    places = []
    for plane, shift in zip((a, b), shifts, strict=True):
        by_column = (plane[rows, right] - plane[rows, left]) / (right - left).astype(np.float32)
        by_row = (plane[below, columns] - plane[above, columns]) / (below - above).astype(np.float32)
        centre = plane[rows, columns] - shift
        places.append(centre[:, None] + by_column[:, None] * du + by_row[:, None] * dv.astype(np.float32))
    means: Singles = REFLECTANCE[surface.labels(*places)].mean(axis=1, dtype=np.float32)
    return means


def _blurred(shade: Singles, sigma_px: float) -> Singles:
    from scipy.ndimage import gaussian_filter

    blurred: Singles = gaussian_filter(shade, sigma_px, mode="nearest", truncate=4.5)
    return blurred


def _recorded(
    electrons_per_grey: float, read_noise_grey: float, grey: Singles, random: np.random.Generator
) -> npt.NDArray[np.uint8]:
    """Grey values with the noise of counted photons and of the electronics, in 8 bits."""
    variance = grey / np.float32(electrons_per_grey) + np.float32(read_noise_grey**2)
    noisy = random.standard_normal(grey.shape, dtype=np.float32)
    noisy *= np.sqrt(variance)
    noisy += grey
    return np.clip(np.rint(noisy), 0.0, FULL_SCALE).astype(np.uint8)
