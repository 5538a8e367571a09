"""From detections to a calibrated head on an arm, with the evidence for every number."""

from sixthlink.calibrate.calibration import (
    BoardEvidence,
    Calibration,
    CameraEvidence,
    Gate,
    ShotEvidence,
    head_link_of,
    observed_positions,
    paper_numbers_of,
    unobserved_names,
    unobserved_of,
)
from sixthlink.calibrate.cameras import calibrate_rig
from sixthlink.calibrate.disc_centres import boards_with_disc_centres
from sixthlink.calibrate.head import Certificate, SearchBox, SearchReport, SolverScore, compare_solvers
from sixthlink.calibrate.heldout_error import HeldOut
from sixthlink.calibrate.joint import ArmEvidence, BlockVerdict, Budget, Correlation, JointEvidence, NoiseEvidence
from sixthlink.calibrate.joint_recipe import calibrate_jointly
from sixthlink.calibrate.marks import MarkPoint, mark_points
from sixthlink.calibrate.named_cameras import calibrate_cameras
from sixthlink.calibrate.recipe import calibrate_head, problem_of_recording
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.stereo_check import StereoCheck, given_rig, stereo_checks
from sixthlink.calibrate.target_poses import TargetPoses, locate_targets
from sixthlink.calibrate.unobserved import Unobserved, changing
from sixthlink.calibrate.usable import SolveOptions

__all__ = [
    "ArmEvidence",
    "BlockVerdict",
    "BoardEvidence",
    "Budget",
    "Calibration",
    "CameraEvidence",
    "Certificate",
    "Correlation",
    "Gate",
    "HeldOut",
    "JointEvidence",
    "MarkPoint",
    "NoiseEvidence",
    "RigCalibration",
    "SearchBox",
    "SearchReport",
    "ShotEvidence",
    "SolveOptions",
    "SolverScore",
    "StereoCheck",
    "TargetPoses",
    "Unobserved",
    "boards_with_disc_centres",
    "calibrate_cameras",
    "calibrate_head",
    "calibrate_jointly",
    "calibrate_rig",
    "changing",
    "compare_solvers",
    "given_rig",
    "head_link_of",
    "locate_targets",
    "mark_points",
    "observed_positions",
    "paper_numbers_of",
    "problem_of_recording",
    "stereo_checks",
    "unobserved_names",
    "unobserved_of",
]
