"""A cell with known truth: arm, head and targets with errors, and images by the simulator's own ray path."""

from sixthlink.simulate.cell import simulate_cell
from sixthlink.simulate.kinematics import chain_link_poses, chain_of_arm, chain_poses
from sixthlink.simulate.manufacture import built_arm, built_rig, mounted_head, printed_points
from sixthlink.simulate.optics import sensor_positions
from sixthlink.simulate.render import Exposure, render_image, render_target
from sixthlink.simulate.scenario import SCENARIOS, Scenario
from sixthlink.simulate.sightings import ruler_marks, true_pixels
from sixthlink.simulate.tracker_session import (
    SimulatedTracking,
    TrackerSession,
    TrackerTruth,
    simulate_tracking,
)
from sixthlink.simulate.truth import GroundTruth, SimulatedCell

__all__ = [
    "SCENARIOS",
    "Exposure",
    "GroundTruth",
    "Scenario",
    "SimulatedCell",
    "SimulatedTracking",
    "TrackerSession",
    "TrackerTruth",
    "built_arm",
    "built_rig",
    "chain_link_poses",
    "chain_of_arm",
    "chain_poses",
    "mounted_head",
    "printed_points",
    "render_image",
    "render_target",
    "ruler_marks",
    "sensor_positions",
    "simulate_cell",
    "simulate_tracking",
    "true_pixels",
]
