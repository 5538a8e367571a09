"""Lens and camera models, the rig that is the head, and triangulation. Knows nothing of robots."""

from sixthlink.camera.camera import (
    FISHEYE,
    FISHEYE_TERMS,
    LENS_MODELS,
    LENS_NAMES,
    PINHOLE,
    PLAIN_TERMS,
    Camera,
    camera_with_lens,
    lens_vector,
    pixel_jacobian,
    pixels_from_points,
    rays_from_pixels,
)
from sixthlink.camera.rig import CameraRig
from sixthlink.camera.rig_jacobian import RigUnknowns, moved_rig, rig_pixels, unknowns_named
from sixthlink.camera.triangulation import triangulate

__all__ = [
    "FISHEYE",
    "FISHEYE_TERMS",
    "LENS_MODELS",
    "LENS_NAMES",
    "PINHOLE",
    "PLAIN_TERMS",
    "Camera",
    "CameraRig",
    "RigUnknowns",
    "camera_with_lens",
    "lens_vector",
    "moved_rig",
    "pixel_jacobian",
    "pixels_from_points",
    "rays_from_pixels",
    "rig_pixels",
    "triangulate",
    "unknowns_named",
]
