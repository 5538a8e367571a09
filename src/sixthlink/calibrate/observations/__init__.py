"""Kinds of observation, one a file: residual, derivative and noise by origin. They combine freely in one problem."""

from sixthlink.calibrate.observations.fixed_points import FixedPointTouches, SocketDistances
from sixthlink.calibrate.observations.known_lengths import KnownLengths
from sixthlink.calibrate.observations.linearised import (
    Linearised,
    Observations,
    Posed,
    covariances,
    mahalanobis,
    whitened,
)
from sixthlink.calibrate.observations.mark_sightings import MarkSightings
from sixthlink.calibrate.observations.measured_points import MeasuredPoints, MeasuredPoses, carrier_poses
from sixthlink.calibrate.observations.state import Columns, JointState, moved
from sixthlink.calibrate.observations.target_poses import TargetPoseShots, carried

__all__ = [
    "Columns",
    "FixedPointTouches",
    "JointState",
    "KnownLengths",
    "Linearised",
    "MarkSightings",
    "MeasuredPoints",
    "MeasuredPoses",
    "Observations",
    "Posed",
    "SocketDistances",
    "TargetPoseShots",
    "carried",
    "carrier_poses",
    "covariances",
    "mahalanobis",
    "moved",
    "whitened",
]
