"""A cell with known truth: arm, head and targets with errors, and images by the simulator's own ray path."""

from sixthlink.simulate.cell import simulate_cell
from sixthlink.simulate.render import render_image
from sixthlink.simulate.scenario import SCENARIOS, Scenario
from sixthlink.simulate.truth import GroundTruth, SimulatedCell

__all__ = [
    "SCENARIOS",
    "GroundTruth",
    "Scenario",
    "SimulatedCell",
    "render_image",
    "simulate_cell",
]
