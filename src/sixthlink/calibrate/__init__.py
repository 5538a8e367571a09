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
from sixthlink.calibrate.head import Certificate, SearchBox, SearchReport, SolverScore, compare_solvers
from sixthlink.calibrate.marks import MarkPoint, mark_points
from sixthlink.calibrate.recipe import SolveOptions, calibrate_head, problem_of_recording
from sixthlink.calibrate.target_poses import TargetPoses, locate_targets

__all__ = [
    "Calibration",
    "CameraEvidence",
    "Certificate",
    "Gate",
    "MarkPoint",
    "RigCalibration",
    "SearchBox",
    "SearchReport",
    "ShotEvidence",
    "SolveOptions",
    "SolverScore",
    "TargetPoses",
    "calibrate_head",
    "calibrate_rig",
    "compare_solvers",
    "head_link_of",
    "locate_targets",
    "mark_points",
    "paper_numbers_of",
    "problem_of_recording",
]
