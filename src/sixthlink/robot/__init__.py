"""The arm as a chain of steps, its derivatives and dialects, and the head as its last link."""

from sixthlink.robot.arm import (
    Arm,
    arm_with_values,
    flange_jacobian,
    flange_poses,
    gravity_levers,
    joint_jacobian,
    last_link,
    link5_poses,
    link_poses,
    true_joints,
)
from sixthlink.robot.compensation import Compensation, compensated_joints
from sixthlink.robot.dialects import (
    Coupling,
    Joint,
    Link,
    LinkTable,
    Tolerances,
    arm_from_links,
    link_table_from_arm,
)
from sixthlink.robot.head_link import (
    HeadLink,
    PaperNumbers,
    head_link_from_transform,
    paper_numbers_from_transform,
    transform_from_head_link,
    transform_from_paper_numbers,
)
from sixthlink.robot.joint_errors import HARMONICS, harmonic_values

__all__ = [
    "HARMONICS",
    "Arm",
    "Compensation",
    "Coupling",
    "HeadLink",
    "Joint",
    "Link",
    "LinkTable",
    "PaperNumbers",
    "Tolerances",
    "arm_from_links",
    "arm_with_values",
    "compensated_joints",
    "flange_jacobian",
    "flange_poses",
    "gravity_levers",
    "harmonic_values",
    "head_link_from_transform",
    "joint_jacobian",
    "last_link",
    "link5_poses",
    "link_poses",
    "link_table_from_arm",
    "paper_numbers_from_transform",
    "transform_from_head_link",
    "transform_from_paper_numbers",
    "true_joints",
]
