"""From detections to a calibrated head on an arm, with the evidence for every number."""

from sixthlink.calibrate.calibration import (
    Calibration,
    CameraEvidence,
    Gate,
    ShotEvidence,
    head_link_of,
    paper_numbers_of,
)
from sixthlink.calibrate.cameras import RigCalibration, calibrate_rig
from sixthlink.calibrate.head import SearchBox, SearchReport
from sixthlink.calibrate.recipe import SolveOptions, calibrate_head
from sixthlink.calibrate.target_poses import TargetPoses, locate_targets

__all__ = [
    "Calibration",
    "CameraEvidence",
    "Gate",
    "RigCalibration",
    "SearchBox",
    "SearchReport",
    "ShotEvidence",
    "SolveOptions",
    "TargetPoses",
    "calibrate_head",
    "calibrate_rig",
    "head_link_of",
    "locate_targets",
    "paper_numbers_of",
]
