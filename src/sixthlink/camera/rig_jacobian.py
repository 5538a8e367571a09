"""Where do the cameras of a rig see points of the head frame, and how do the pixels follow points, lenses and poses?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.camera.camera import LENS_NAMES, camera_with_lens, lens_vector, pixel_jacobian
from sixthlink.camera.rig import CameraRig
from sixthlink.geometry import Floats, Ints, apply_motion, hat

__all__ = ["RigUnknowns", "moved_rig", "rig_pixels", "unknowns_named"]

_MOTION_NAMES = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")


@dataclass(frozen=True, eq=False)
class RigUnknowns:
    """What of a rig is free: G numbers, the lens terms camera by camera first, then the camera poses' motions.

    Attributes:
        lens: ``(C, 16)`` which intrinsics are free, in the order of ``LENS_NAMES``.
        pose: ``(C,)`` which cameras' poses ``T_camera_head`` are free; never the reference's.
    """

    lens: npt.NDArray[np.bool_]
    pose: npt.NDArray[np.bool_]

    @property
    def size(self) -> int:
        """Number G of free numbers."""
        return int(self.lens.sum() + 6 * self.pose.sum())

    def names(self, cameras: tuple[str, ...]) -> tuple[str, ...]:
        """Names of the free numbers, for example ``right.fx`` and ``left.rotation_z``."""
        lens = [f"{cameras[c]}.{LENS_NAMES[k]}" for c, k in zip(*np.nonzero(self.lens), strict=True)]
        return (*lens, *(f"{cameras[c]}.{m}" for c in np.flatnonzero(self.pose) for m in _MOTION_NAMES))


def unknowns_named(cameras: tuple[str, ...], names: tuple[str, ...]) -> RigUnknowns:
    """The unknowns that carry these names: the inverse of :meth:`RigUnknowns.names`.

    Raises:
        ValueError: The names are not those of a set of unknowns in their order.
    """
    known = set(names)
    lens = np.array([[f"{c}.{term}" in known for term in LENS_NAMES] for c in cameras], dtype=bool)
    pose = np.array([f"{c}.rotation_x" in known for c in cameras], dtype=bool)
    unknowns = RigUnknowns(lens.reshape(len(cameras), len(LENS_NAMES)), pose)
    if unknowns.names(cameras) != names:
        raise ValueError(f"{names} are not the unknowns of the cameras {cameras}")
    return unknowns


def rig_pixels(
    rig: CameraRig, cameras: Ints, points_head: Floats, unknowns: RigUnknowns | None = None
) -> tuple[Floats, Floats, Floats, npt.NDArray[np.bool_]]:
    """Pixels of points in the head frame.

    Args:
        rig: The head.
        cameras: ``(M,)`` index of the camera that sees each point.
        points_head: ``(M, 3)`` points [m].
        unknowns: What of the rig is free, or None.

    Returns:
        ``(M, 2)`` pixels; their derivatives ``(M, 2, 3)`` by the point in head axes [pixel/m] and ``(M, 2, G)`` by
        the rig's unknowns; ``(M,)`` whether the point is in front of its camera (the pixels mean nothing where not).
    """
    M, G = len(cameras), unknowns.size if unknowns else 0
    pixels, by_point, by_rig = np.empty((M, 2)), np.empty((M, 2, 3)), np.zeros((M, 2, G))
    visible = np.ones(M, dtype=bool)
    lens_column, pose_column = 0, int(unknowns.lens.sum()) if unknowns else 0
    for c, camera in enumerate(rig.cameras):
        rows = np.flatnonzero(cameras == c)
        R, t = rig.Ts_camera_head[c, :3, :3], rig.Ts_camera_head[c, :3, 3]
        turned = points_head[rows] @ R.T
        points_camera = turned + t
        behind = points_camera[:, 2] < 1e-6
        visible[rows[behind]] = False
        points_camera[behind] = (0.0, 0.0, 1.0)
        pixels[rows], gradient, by_lens = pixel_jacobian(camera, points_camera)
        by_point[rows] = gradient @ R
        if unknowns is None:
            continue
        free = np.flatnonzero(unknowns.lens[c])
        by_rig[rows, :, lens_column : lens_column + len(free)] = by_lens[:, :, free]
        lens_column += len(free)
        if unknowns.pose[c]:
            by_rig[rows, :, pose_column : pose_column + 3] = gradient
            by_rig[rows, :, pose_column + 3 : pose_column + 6] = -gradient @ hat(turned)
            pose_column += 6
    return pixels, by_point, by_rig, visible


def moved_rig(rig: CameraRig, unknowns: RigUnknowns, step: Floats) -> CameraRig | None:
    """The rig after a step ``(G,)`` of its unknowns, or None when a focal length would not stay positive."""
    cameras, Ts_camera_head = list(rig.cameras), rig.Ts_camera_head.copy()
    used = 0
    for c, camera in enumerate(rig.cameras):
        lens = lens_vector(camera)
        free = np.flatnonzero(unknowns.lens[c])
        lens[free] += step[used : used + len(free)]
        used += len(free)
        if (lens[:2] <= 0.0).any():
            return None
        cameras[c] = camera_with_lens(camera, lens)
    for c in np.flatnonzero(unknowns.pose).tolist():
        Ts_camera_head[c] = apply_motion(Ts_camera_head[c], step[used : used + 6])
        used += 6
    return CameraRig(rig.names, tuple(cameras), Ts_camera_head)
