"""How space moves: rotations, rigid transforms and the makers' dialects. Knows nothing of robots or cameras."""

from sixthlink.geometry.arrays import Floats, Ints, frozen_floats, frozen_ints
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
    "Floats",
    "Ints",
    "Orientation",
    "apply_motion",
    "checked_transforms",
    "exp_rotation",
    "frozen_floats",
    "frozen_ints",
    "hat",
    "inverse",
    "log_rotation",
    "mean_transform",
    "motion_between",
    "nearest_rotation",
    "rotation_angle",
    "rotations_from_values",
    "transform",
    "transform_points",
    "values_from_rotations",
]
