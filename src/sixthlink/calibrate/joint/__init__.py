"""Arm, head, placements, noise and verdicts in one estimate, with its covariance."""

from sixthlink.calibrate.joint.blocks import BlockVerdict, estimate_with_blocks
from sixthlink.calibrate.joint.data import HeadShots, JointData, observations_of, repeatability_of, start_of
from sixthlink.calibrate.joint.estimate import Estimate, estimate
from sixthlink.calibrate.joint.evidence import (
    ArmEvidence,
    Budget,
    Correlation,
    JointEvidence,
    NoiseEvidence,
    joint_evidence,
    names_of,
)
from sixthlink.calibrate.joint.noise import fitted_covariances, shared_covariance
from sixthlink.calibrate.joint.problem import Fit, JointProblem, solve
from sixthlink.calibrate.joint.standing import MOST, Standing, standing

__all__ = [
    "MOST",
    "ArmEvidence",
    "BlockVerdict",
    "Budget",
    "Correlation",
    "Estimate",
    "Fit",
    "HeadShots",
    "JointData",
    "JointEvidence",
    "JointProblem",
    "NoiseEvidence",
    "Standing",
    "estimate",
    "estimate_with_blocks",
    "fitted_covariances",
    "joint_evidence",
    "names_of",
    "observations_of",
    "repeatability_of",
    "shared_covariance",
    "solve",
    "standing",
    "start_of",
]
