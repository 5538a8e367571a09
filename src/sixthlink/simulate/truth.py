"""What is simulated, and what is true in it?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sixthlink.camera import CameraRig
from sixthlink.geometry import Floats, frozen_floats
from sixthlink.recording import Detections, Recording
from sixthlink.robot import Arm
from sixthlink.simulate.scenario import Scenario
from sixthlink.target import Chessboard

__all__ = ["GroundTruth", "SimulatedCell"]


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """What a calibration of the simulated recording should find.

    Attributes:
        arm: The arm as it was built.
        joints: ``(N, J)`` joint values at which the shots were really taken [rad or m].
        rig: The cameras as they were built.
        T_flange_head: ``(4, 4)`` the head as it was mounted.
        Ts_base_placement: ``(4, 4)`` pose per placement, of the board frame or of the ruler frame: mark A is
            its origin, x points towards mark B and z into the bar.
        points_m: ``(P, 3)`` points of the board as they were printed [m].
        standard_length_m: Length of the ruler as it was made [m].
        pixels: Where the points fall, without noise; its sigmas are those of the noisy pixels.
    """

    arm: Arm
    joints: Floats
    rig: CameraRig
    T_flange_head: Floats
    Ts_base_placement: Mapping[str, Floats]
    points_m: Floats
    standard_length_m: float
    pixels: Detections

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", frozen_floats(self.joints, (None, len(self.arm.joints)), "joints"))
        object.__setattr__(self, "T_flange_head", frozen_floats(self.T_flange_head, (4, 4), "T_flange_head"))
        object.__setattr__(self, "points_m", frozen_floats(self.points_m, (None, 3), "points_m"))


@dataclass(frozen=True, eq=False)
class SimulatedCell:
    """A recording with its truth, and what is needed to render its images.

    Attributes:
        scenario: The numbers of the cell.
        seed: Seed of everything random in it.
        target: The chessboard.
        recording: What a user would have recorded.
        truth: What is true.
    """

    scenario: Scenario
    seed: int
    target: Chessboard
    recording: Recording
    truth: GroundTruth
