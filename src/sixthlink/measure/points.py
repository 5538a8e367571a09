"""Where is a marked point in the robot's base frame?"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate import MarkPoint
from sixthlink.geometry import Floats, transform_points

__all__ = ["base_points"]


def base_points(points: tuple[MarkPoint, ...], Ts_outer: Floats, X: Floats) -> Floats:
    """Points ``(M, 3)`` carried by arm and head into the frame in which the standard stands still [m].

    Args:
        points: Marks in the head frame.
        Ts_outer: ``(N, 4, 4)`` T_base_flange (eye-in-hand) or T_flange_base (eye-to-hand) of every shot.
        X: ``(4, 4)`` the head.
    """
    shots = [p.shot for p in points]
    return transform_points(Ts_outer[shots] @ X, np.array([p.point_head for p in points]).reshape(-1, 3))
