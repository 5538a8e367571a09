"""What was recorded, in memory: shots, poses, images by name, detections. Opens no file."""

from sixthlink.recording.detections import Detections, Rejection, joined, renumbered, selected
from sixthlink.recording.recording import (
    BOARD_KINDS,
    EYE_IN_HAND,
    EYE_TO_HAND,
    KINDS,
    MOUNTS,
    CameraDescription,
    Head,
    Recording,
    flange_poses_of,
    placement_indices,
    shots_of_kind,
    subset,
    with_arm,
)
from sixthlink.recording.tracker_record import (
    GROUND,
    ReferencePoints,
    Reflector,
    Sweep,
    TrackerRecord,
    points_of_sweep,
)

__all__ = [
    "BOARD_KINDS",
    "EYE_IN_HAND",
    "EYE_TO_HAND",
    "GROUND",
    "KINDS",
    "MOUNTS",
    "CameraDescription",
    "Detections",
    "Head",
    "Recording",
    "ReferencePoints",
    "Reflector",
    "Rejection",
    "Sweep",
    "TrackerRecord",
    "flange_poses_of",
    "joined",
    "placement_indices",
    "points_of_sweep",
    "renumbered",
    "selected",
    "shots_of_kind",
    "subset",
    "with_arm",
]
