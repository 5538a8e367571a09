"""Arm, head, placements, noise and verdicts in one estimate, with its covariance."""

from sixthlink.calibrate.joint.data import HeadShots, JointData, observations_of, repeatability_of
from sixthlink.calibrate.joint.estimate import Estimate, estimate
from sixthlink.calibrate.joint.noise import fitted_covariances, shared_covariance
from sixthlink.calibrate.joint.problem import Fit, JointProblem, solve

__all__ = [
    "Estimate",
    "Fit",
    "HeadShots",
    "JointData",
    "JointProblem",
    "estimate",
    "fitted_covariances",
    "observations_of",
    "repeatability_of",
    "shared_covariance",
    "solve",
]
