"""The arm's own numbers: which can change, how they move the flange, and which of them a recording can see."""

from sixthlink.calibrate.arm.identifiability import Visibility, visibility
from sixthlink.calibrate.arm.parameters import (
    BLOCKS,
    ArmParameter,
    arm_motions,
    arm_with_steps,
    link_parameters,
    optional_parameters,
    parameter_values,
)

__all__ = [
    "BLOCKS",
    "ArmParameter",
    "Visibility",
    "arm_motions",
    "arm_with_steps",
    "link_parameters",
    "optional_parameters",
    "parameter_values",
    "visibility",
]
