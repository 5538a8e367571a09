"""Which named point was seen at which pixel, by which camera, in which shot?

One flat table of columns, never nested lists, so that masks, residuals and reports all index the same way.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints, frozen_floats, frozen_ints

__all__ = ["Detections", "Rejection", "joined", "renumbered", "selected"]

_NO_INDICES: Ints = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Detections:
    """M observed points.

    Attributes:
        shots: ``(M,)`` index of the shot in the recording.
        cameras: ``(M,)`` index of the camera in the recording's head.
        points: ``(M,)`` index of the point on the target, or of the mark on the length standard.
        pixels: ``(M, 2)`` u to the right, v down [pixel]; the centre of the first pixel is (0, 0).
        sigmas_px: ``(M,)`` standard deviation of each coordinate [pixel].
    """

    shots: Ints
    cameras: Ints
    points: Ints
    pixels: Floats
    sigmas_px: Floats

    def __post_init__(self) -> None:
        M = len(self.shots)
        for name in ("shots", "cameras", "points"):
            object.__setattr__(self, name, frozen_ints(getattr(self, name), (M,), name))
        object.__setattr__(self, "pixels", frozen_floats(self.pixels, (M, 2), "pixels"))
        object.__setattr__(self, "sigmas_px", frozen_floats(self.sigmas_px, (M,), "sigmas_px"))
        if (self.sigmas_px <= 0).any():
            raise ValueError("sigmas_px must all be above 0 pixel")

    def __len__(self) -> int:
        return len(self.shots)


@dataclass(frozen=True)
class Rejection:
    """One image or shot that was not used, and why.

    Attributes:
        shot: Id of the shot.
        camera: Name of the camera, empty when the whole shot is meant.
        reason: What was wrong, in words that a user can act on.
    """

    shot: str
    camera: str
    reason: str

    def __str__(self) -> str:
        return f"{self.shot} {self.camera}".rstrip() + f": {self.reason}"


def selected(detections: Detections, mask: npt.NDArray[np.bool_]) -> Detections:
    """The rows where ``mask`` ``(M,)`` is true."""
    return Detections(
        detections.shots[mask],
        detections.cameras[mask],
        detections.points[mask],
        detections.pixels[mask],
        detections.sigmas_px[mask],
    )


def joined(tables: Iterable[Detections]) -> Detections:
    """All rows of several tables, in order."""
    parts = list(tables)
    return Detections(
        np.concatenate([p.shots for p in parts] or [_NO_INDICES]),
        np.concatenate([p.cameras for p in parts] or [_NO_INDICES]),
        np.concatenate([p.points for p in parts] or [_NO_INDICES]),
        np.concatenate([p.pixels for p in parts] or [np.empty((0, 2))]),
        np.concatenate([p.sigmas_px for p in parts] or [np.empty(0)]),
    )


def renumbered(detections: Detections, shots: Ints) -> Detections:
    """The rows of the ``(M,)`` shots with these indices; shot ``shots[k]`` becomes shot k."""
    number = {int(shot): k for k, shot in enumerate(shots)}
    part = selected(detections, np.isin(detections.shots, shots))
    return replace(part, shots=np.array([number[int(s)] for s in part.shots], dtype=np.int64))
