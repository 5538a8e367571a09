"""How does light become pixels, and back?

The pinhole model with radial-tangential distortion (Brown 1971), and where a lens asks for them the rational and
thin-prism terms (Claus and Fitzgibbon 2005; Weng, Cohen and Herniou 1992), as OpenCV names and orders them. With x, y
the undistorted position and r² = x² + y²,

    q = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
    x' = x q + 2 p1 x y + p2 (r² + 2 x²) + s1 r² + s2 r⁴
    y' = y q + p1 (r² + 2 y²) + 2 p2 x y + s3 r² + s4 r⁴

A fisheye is told by angles (Kannala and Brandt 2006, as in OpenCV's fisheye module and Kalibr's equidistant model):
with θ = arctan r, in front of the camera,

    q = θ / r (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸),   x' = x q,   y' = y q

The centre of the first pixel is (0, 0). A camera looks along its +z axis, x to the right of the image, y down.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sixthlink.camera.radial import fisheye_by_terms, fisheye_factor, pinhole_by_terms, pinhole_factor
from sixthlink.geometry import Floats, frozen_floats

__all__ = [
    "FISHEYE",
    "FISHEYE_TERMS",
    "LENS_MODELS",
    "LENS_NAMES",
    "PINHOLE",
    "PLAIN_TERMS",
    "Camera",
    "camera_with_lens",
    "lens_vector",
    "pixel_jacobian",
    "pixels_from_points",
    "rays_from_pixels",
]

LENS_NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
"""Order of the intrinsics wherever they are a vector."""

TERMS = len(LENS_NAMES) - 4
PLAIN_TERMS = 5
"""Terms of distortion that every pinhole lens may have; the others are zero unless a lens asks for them."""

PINHOLE, FISHEYE = LENS_MODELS = ("pinhole", "fisheye")

FISHEYE_TERMS = ("k1", "k2", "k3", "k4")
"""Terms of distortion that a fisheye has."""

NEWTON_STEPS = 30
WIDEST_START_RAD = np.deg2rad(80.0)

_RADIAL = [LENS_NAMES.index(name) - 4 for name in ("k1", "k2", "k3", "k4", "k5", "k6")]
_OF_FISHEYE = [LENS_NAMES.index(name) - 4 for name in FISHEYE_TERMS]


@dataclass(frozen=True, eq=False)
class Camera:
    """Intrinsics of one camera.

    Attributes:
        width_px: Image width [pixel].
        height_px: Image height [pixel].
        focal_px: ``(2,)`` focal lengths fx, fy [pixel].
        centre_px: ``(2,)`` principal point cx, cy [pixel].
        distortion: ``(12,)`` k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 [-]; the first 4, 5 or 8 may be given
            alone, for a fisheye its four k1, k2, k3, k4.
        model: ``pinhole`` or ``fisheye``.
    """

    width_px: int
    height_px: int
    focal_px: Floats
    centre_px: Floats
    distortion: Floats
    model: str = PINHOLE

    def __post_init__(self) -> None:
        object.__setattr__(self, "focal_px", frozen_floats(self.focal_px, (2,), "focal_px"))
        object.__setattr__(self, "centre_px", frozen_floats(self.centre_px, (2,), "centre_px"))
        if self.model not in LENS_MODELS:
            raise ValueError(f"lens model is {self.model!r}, expected one of {', '.join(LENS_MODELS)}")
        terms = _whole_distortion(np.asarray(self.distortion, dtype=np.float64).ravel(), self.model)
        object.__setattr__(self, "distortion", frozen_floats(terms, (TERMS,), "distortion"))
        if self.width_px < 1 or self.height_px < 1:
            raise ValueError(f"image size is {self.width_px} x {self.height_px} pixel, expected at least 1 x 1")
        if (self.focal_px <= 0).any():
            raise ValueError(f"focal lengths are {tuple(self.focal_px)} pixel, expected both above 0")

    @property
    def written_distortion(self) -> tuple[float, ...]:
        """Terms as files write them.

        k1, k2, p1, p2, k3, and the others where one of them is not zero; of a fisheye k1, k2, k3, k4.
        """
        if self.model == FISHEYE:
            return tuple(self.distortion[_OF_FISHEYE].tolist())
        terms = self.distortion.tolist()
        return tuple(terms if any(terms[PLAIN_TERMS:]) else terms[:PLAIN_TERMS])

    @property
    def matrix(self) -> Floats:
        """``(3, 3)`` camera matrix K [pixel]."""
        (fx, fy), (cx, cy) = self.focal_px, self.centre_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _whole_distortion(given: Floats, model: str) -> Floats:
    """Terms ``(12,)`` from those that were given."""
    if model == FISHEYE:
        whole = np.zeros(TERMS)
        if len(given) == len(FISHEYE_TERMS):
            whole[_OF_FISHEYE] = given
        elif len(given) == TERMS and not np.delete(given, _OF_FISHEYE).any():
            whole = given
        else:
            raise ValueError(f"distortion of a fisheye is {given.tolist()}, expected {', '.join(FISHEYE_TERMS)}")
        return whole
    if len(given) not in {4, PLAIN_TERMS, 8, TERMS}:
        raise ValueError(f"distortion has {len(given)} terms, expected 4, {PLAIN_TERMS}, 8 or {TERMS}")
    return np.pad(given, (0, TERMS - len(given)))


def lens_vector(camera: Camera) -> Floats:
    """Intrinsics ``(16,)`` in the order of ``LENS_NAMES`` [pixel, -]."""
    return np.concatenate([camera.focal_px, camera.centre_px, camera.distortion])


def camera_with_lens(camera: Camera, lens: Floats) -> Camera:
    """The same camera with other intrinsics ``(16,)``: the inverse of :func:`lens_vector`."""
    return replace(camera, focal_px=lens[:2], centre_px=lens[2:4], distortion=lens[4:])


def pixels_from_points(camera: Camera, points_camera: npt.ArrayLike) -> Floats:
    """Pixels ``(..., 2)`` of points ``(..., 3)`` in camera coordinates [m].

    Raises:
        ValueError: A point is not in front of the camera.
    """
    normal = _normal(points_camera)
    radial, _ = _radial(camera, np.sum(normal * normal, axis=-1))
    return _distorted(camera, normal, radial) * camera.focal_px + camera.centre_px


def pixel_jacobian(camera: Camera, points_camera: npt.ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Pixels, and how they follow the points and the intrinsics.

    Args:
        camera: The camera.
        points_camera: ``(..., 3)`` points in camera coordinates [m].

    Returns:
        ``(..., 2)`` pixels; ``(..., 2, 3)`` derivative by the point [pixel/m]; ``(..., 2, 16)`` derivative by
        the intrinsics of ``LENS_NAMES``.

    Raises:
        ValueError: A point is not in front of the camera.
    """
    normal = _normal(points_camera)
    x, y = normal[..., 0], normal[..., 1]
    r2 = x * x + y * y
    _, _, p1, p2, _, _, _, _, s1, s2, s3, s4 = camera.distortion
    fx, fy = camera.focal_px
    radial, slope = _radial(camera, r2)
    distorted = _distorted(camera, normal, radial)
    # d(radial) = 2 slope (x dx + y dy), d(r²) = 2 (x dx + y dy)
    prism_x, prism_y = 2.0 * (s1 + 2.0 * s2 * r2), 2.0 * (s3 + 2.0 * s4 * r2)
    xx = radial + 2.0 * slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x + prism_x * x
    xy = 2.0 * slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    yy = radial + 2.0 * slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x + prism_y * y
    up, left = xy + prism_x * y, xy + prism_y * x
    depth = np.asarray(points_camera, dtype=np.float64)[..., 2]
    by_point = np.empty((*x.shape, 2, 3))
    by_point[..., 0, 0], by_point[..., 0, 1] = fx * xx / depth, fx * up / depth
    by_point[..., 1, 0], by_point[..., 1, 1] = fy * left / depth, fy * yy / depth
    by_point[..., 0, 2] = -fx * (xx * x + up * y) / depth
    by_point[..., 1, 2] = -fy * (left * x + yy * y) / depth
    by_lens = np.zeros((*x.shape, 2, len(LENS_NAMES)))
    by_lens[..., 0, 0], by_lens[..., 1, 1] = distorted[..., 0], distorted[..., 1]
    by_lens[..., 0, 2] = by_lens[..., 1, 3] = 1.0
    for place, by_term in _radial_by_terms(camera, r2, radial):
        by_lens[..., 0, 4 + place], by_lens[..., 1, 4 + place] = fx * x * by_term, fy * y * by_term
    by_lens[..., 0, 6], by_lens[..., 1, 6] = fx * 2.0 * x * y, fy * (r2 + 2.0 * y * y)
    by_lens[..., 0, 7], by_lens[..., 1, 7] = fx * (r2 + 2.0 * x * x), fy * 2.0 * x * y
    by_lens[..., 0, 12], by_lens[..., 0, 13] = fx * r2, fx * r2 * r2
    by_lens[..., 1, 14], by_lens[..., 1, 15] = fy * r2, fy * r2 * r2
    return distorted * camera.focal_px + camera.centre_px, by_point, by_lens


def rays_from_pixels(camera: Camera, pixels: npt.ArrayLike) -> Floats:
    """Undistorted directions ``(..., 3)`` with z = 1 through ``(..., 2)`` pixels: Newton on the lens model.

    Raises:
        ValueError: The lens model folds at a pixel, so that no direction exists.
    """
    observed = (np.asarray(pixels, dtype=np.float64) - camera.centre_px) / camera.focal_px
    unit = replace(camera, focal_px=np.ones(2), centre_px=np.zeros(2))
    rays = np.concatenate([_first_rays(camera, observed), np.ones((*observed.shape[:-1], 1))], axis=-1)
    for _ in range(NEWTON_STEPS):
        predicted, by_point, _ = pixel_jacobian(unit, rays)
        miss = observed - predicted
        if np.abs(miss).max(initial=0.0) < 1e-14:
            break
        rays[..., :2] += np.linalg.solve(by_point[..., :2], miss[..., None])[..., 0]
    miss_px = np.abs((observed - pixels_from_points(unit, rays)) * camera.focal_px).max(initial=0.0)
    if not miss_px < 1e-6:
        raise ValueError(f"the lens model folds: no ray for some pixels (best miss {miss_px:.3g} pixel)")
    return rays


def _first_rays(camera: Camera, observed: Floats) -> Floats:
    """Undistorted positions from which Newton's method begins."""
    if camera.model == PINHOLE:
        return observed
    theta = np.linalg.norm(observed, axis=-1, keepdims=True)
    return np.asarray(observed * np.tan(np.minimum(theta, WIDEST_START_RAD)) / np.maximum(theta, 1e-12))


def _normal(points_camera: npt.ArrayLike) -> Floats:
    """Undistorted positions ``(..., 2)`` at z = 1."""
    P = np.asarray(points_camera, dtype=np.float64)
    if (P[..., 2] <= 0.0).any():
        raise ValueError(f"{np.count_nonzero(P[..., 2] <= 0.0)} points are not in front of the camera")
    return np.asarray(P[..., :2] / P[..., 2:], dtype=np.float64)


def _radial(camera: Camera, r2: Floats) -> tuple[Floats, Floats]:
    """Radial factor and its derivative by r²."""
    if camera.model == FISHEYE:
        return fisheye_factor(camera.distortion[_OF_FISHEYE], r2)
    return pinhole_factor(camera.distortion[_RADIAL], r2)


def _radial_by_terms(camera: Camera, r2: Floats, radial: Floats) -> Iterator[tuple[int, Floats]]:
    """Place of each term in the distortion, and derivative of the radial factor by it."""
    if camera.model == FISHEYE:
        return zip(_OF_FISHEYE, fisheye_by_terms(r2), strict=True)
    return zip(_RADIAL, pinhole_by_terms(camera.distortion[_RADIAL], r2, radial), strict=True)


def _distorted(camera: Camera, normal: Floats, radial: Floats) -> Floats:
    """Distorted positions ``(..., 2)``."""
    x, y = normal[..., 0], normal[..., 1]
    _, _, p1, p2, _, _, _, _, s1, s2, s3, s4 = camera.distortion
    r2 = x * x + y * y
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4),
        ],
        axis=-1,
    )
