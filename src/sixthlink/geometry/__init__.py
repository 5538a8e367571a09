"""How space moves and what lies in it: rotations, rigid transforms, the makers' dialects, lines and circles.

Knows nothing of robots or cameras.
"""

from sixthlink.geometry.arrays import Floats, Ints, frozen_floats, frozen_ints
from sixthlink.geometry.circles import (
    Circle,
    across_axes,
    axis_of_circle,
    beside_circle,
    circle_through,
    moved_circle,
    phases_on_circle,
    points_on_circle,
)
from sixthlink.geometry.lines import (
    CommonNormal,
    Line,
    common_normal,
    distances_to_line,
    feet_on_line,
    moved_line,
)
from sixthlink.geometry.orientations import (
    ORIENTATIONS,
    Orientation,
    rotations_from_values,
    values_from_rotations,
)
from sixthlink.geometry.rotations import (
    exp_rotation,
    hat,
    log_rotation,
    nearest_rotation,
    rotation_angle,
)
from sixthlink.geometry.transforms import (
    apply_motion,
    checked_transforms,
    inverse,
    mean_transform,
    motion_between,
    transform,
    transform_points,
)

__all__ = [
    "ORIENTATIONS",
    "Circle",
    "CommonNormal",
    "Floats",
    "Ints",
    "Line",
    "Orientation",
    "across_axes",
    "apply_motion",
    "axis_of_circle",
    "beside_circle",
    "checked_transforms",
    "circle_through",
    "common_normal",
    "distances_to_line",
    "exp_rotation",
    "feet_on_line",
    "frozen_floats",
    "frozen_ints",
    "hat",
    "inverse",
    "log_rotation",
    "mean_transform",
    "motion_between",
    "moved_circle",
    "moved_line",
    "nearest_rotation",
    "phases_on_circle",
    "points_on_circle",
    "rotation_angle",
    "rotations_from_values",
    "transform",
    "transform_points",
    "values_from_rotations",
]
