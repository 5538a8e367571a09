"""Which cameras make the head, and how do they stand to each other?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.camera.camera import Camera
from sixthlink.geometry import Floats, frozen_floats

__all__ = ["CameraRig"]


@dataclass(frozen=True, eq=False)
class CameraRig:
    """One camera or several on one body. The first camera is the reference: its frame is the head frame.

    Attributes:
        names: Names of the C cameras, the reference first (the paper: the right one).
        cameras: Their intrinsics.
        Ts_camera_head: ``(C, 4, 4)`` poses of the head frame in each camera; the first is the identity.
    """

    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    Ts_camera_head: Floats

    def __post_init__(self) -> None:
        C = len(self.names)
        if C < 1 or len(set(self.names)) != C or len(self.cameras) != C:
            raise ValueError(f"a rig needs one differently named camera per entry, got {self.names}")
        object.__setattr__(self, "Ts_camera_head", frozen_floats(self.Ts_camera_head, (C, 4, 4), "Ts_camera_head"))
        if np.abs(self.Ts_camera_head[0] - np.eye(4)).max() > 0.0:
            raise ValueError("the first camera is the reference: its T_camera_head must be the identity")

    @property
    def reference(self) -> str:
        """Name of the reference camera."""
        return self.names[0]
