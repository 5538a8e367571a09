"""How does light become pixels, and back?

The pinhole model with radial-tangential distortion (Brown 1971), and where a lens asks for them the rational and
thin-prism terms (Claus and Fitzgibbon 2005; Weng, Cohen and Herniou 1992), as OpenCV names and orders them. With x, y
the undistorted position and r² = x² + y²,

    q = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
    x' = x q + 2 p1 x y + p2 (r² + 2 x²) + s1 r² + s2 r⁴
    y' = y q + p1 (r² + 2 y²) + 2 p2 x y + s3 r² + s4 r⁴

The centre of the first pixel is (0, 0). A camera looks along its +z axis, x to the right of the image, y down.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, frozen_floats

__all__ = [
    "LENS_NAMES",
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
"""Terms of distortion that every lens may have; the others are zero unless a lens asks for them."""


@dataclass(frozen=True, eq=False)
class Camera:
    """Intrinsics of one camera.

    Attributes:
        width_px: Image width [pixel].
        height_px: Image height [pixel].
        focal_px: ``(2,)`` focal lengths fx, fy [pixel].
        centre_px: ``(2,)`` principal point cx, cy [pixel].
        distortion: ``(12,)`` k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 [-]; the first 4, 5 or 8 may be given
            alone.
    """

    width_px: int
    height_px: int
    focal_px: Floats
    centre_px: Floats
    distortion: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "focal_px", frozen_floats(self.focal_px, (2,), "focal_px"))
        object.__setattr__(self, "centre_px", frozen_floats(self.centre_px, (2,), "centre_px"))
        given = np.asarray(self.distortion, dtype=np.float64).ravel()
        if len(given) not in {4, PLAIN_TERMS, 8, TERMS}:
            raise ValueError(f"distortion has {len(given)} terms, expected 4, {PLAIN_TERMS}, 8 or {TERMS}")
        whole = np.pad(given, (0, TERMS - len(given)))
        object.__setattr__(self, "distortion", frozen_floats(whole, (TERMS,), "distortion"))
        if self.width_px < 1 or self.height_px < 1:
            raise ValueError(f"image size is {self.width_px} x {self.height_px} pixel, expected at least 1 x 1")
        if (self.focal_px <= 0).any():
            raise ValueError(f"focal lengths are {tuple(self.focal_px)} pixel, expected both above 0")

    @property
    def written_distortion(self) -> tuple[float, ...]:
        """Terms as files write them: k1, k2, p1, p2, k3, and the others where one of them is not zero."""
        terms = self.distortion.tolist()
        return tuple(terms if any(terms[PLAIN_TERMS:]) else terms[:PLAIN_TERMS])

    @property
    def matrix(self) -> Floats:
        """``(3, 3)`` camera matrix K [pixel]."""
        (fx, fy), (cx, cy) = self.focal_px, self.centre_px
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


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
    return _project(camera, points_camera)[0]


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
    pixels, normal, distorted = _project(camera, points_camera)
    x, y = normal[..., 0], normal[..., 1]
    _, _, p1, p2, _, _, _, _, s1, s2, s3, s4 = camera.distortion
    fx, fy = camera.focal_px
    r2 = x * x + y * y
    top, bottom, slope = _radial(camera.distortion, r2)
    radial = top / bottom
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
    for column, power in ((4, r2), (5, r2 * r2), (8, r2**3)):
        by_lens[..., 0, column], by_lens[..., 1, column] = fx * x * power / bottom, fy * y * power / bottom
    for column, power in ((9, r2), (10, r2 * r2), (11, r2**3)):
        shrunk = -radial / bottom * power
        by_lens[..., 0, column], by_lens[..., 1, column] = fx * x * shrunk, fy * y * shrunk
    by_lens[..., 0, 6], by_lens[..., 1, 6] = fx * 2.0 * x * y, fy * (r2 + 2.0 * y * y)
    by_lens[..., 0, 7], by_lens[..., 1, 7] = fx * (r2 + 2.0 * x * x), fy * 2.0 * x * y
    by_lens[..., 0, 12], by_lens[..., 0, 13] = fx * r2, fx * r2 * r2
    by_lens[..., 1, 14], by_lens[..., 1, 15] = fy * r2, fy * r2 * r2
    return pixels, by_point, by_lens


def _radial(distortion: Floats, r2: Floats) -> tuple[Floats, Floats, Floats]:
    """Top and bottom of the radial factor, and its derivative by r²."""
    k1, k2, _, _, k3, k4, k5, k6 = distortion[:8]
    top, bottom = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)), 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    rising, falling = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3), k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6)
    return top, bottom, (rising - top / bottom * falling) / bottom


def rays_from_pixels(camera: Camera, pixels: npt.ArrayLike) -> Floats:
    """Undistorted directions ``(..., 3)`` with z = 1 through ``(..., 2)`` pixels: Newton on the lens model.

    Raises:
        ValueError: The lens model folds at a pixel, so that no direction exists.
    """
    observed = (np.asarray(pixels, dtype=np.float64) - camera.centre_px) / camera.focal_px
    unit = Camera(camera.width_px, camera.height_px, np.ones(2), np.zeros(2), camera.distortion)
    rays = np.concatenate([observed, np.ones((*observed.shape[:-1], 1))], axis=-1)
    for _ in range(20):
        predicted, by_point, _ = pixel_jacobian(unit, rays)
        miss = observed - predicted
        if np.abs(miss).max(initial=0.0) < 1e-14:
            break
        rays[..., :2] += np.linalg.solve(by_point[..., :2], miss[..., None])[..., 0]
    miss_px = np.abs((observed - _project(unit, rays)[0]) * camera.focal_px).max(initial=0.0)
    if not miss_px < 1e-6:
        raise ValueError(f"the lens model folds: no ray for some pixels (best miss {miss_px:.3g} pixel)")
    return rays


def _project(camera: Camera, points_camera: npt.ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Pixels, undistorted and distorted normalised coordinates."""
    P = np.asarray(points_camera, dtype=np.float64)
    if (P[..., 2] <= 0.0).any():
        raise ValueError(f"{np.count_nonzero(P[..., 2] <= 0.0)} points are not in front of the camera")
    normal = P[..., :2] / P[..., 2:]
    x, y = normal[..., 0], normal[..., 1]
    _, _, p1, p2, _, _, _, _, s1, s2, s3, s4 = camera.distortion
    r2 = x * x + y * y
    top, bottom, _ = _radial(camera.distortion, r2)
    radial = top / bottom
    distorted = np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4),
        ],
        axis=-1,
    )
    return distorted * camera.focal_px + camera.centre_px, normal, distorted
