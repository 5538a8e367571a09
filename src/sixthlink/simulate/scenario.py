"""What does a simulated cell consist of, in numbers?

The paper's cell: an IRB 1400, two 5-megapixel cameras that converge at 600 mm, a 12 × 9 chessboard at 5
placements of 10 poses each, and a ruler of 1234.15 mm at 15 placements. What the paper does not print (lens
errors, noise, how true the arm is) is assumed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sixthlink.robot import PaperNumbers
from sixthlink.units import DEG, MM

__all__ = ["SCENARIOS", "Scenario", "stream"]


@dataclass(frozen=True)
class Scenario:
    """Every number of a simulated cell; standard deviations are called sigma.

    Attributes:
        name: Name of the scenario.
        length_sigma_m: Error of every DH length of the arm [m].
        angle_sigma_rad: Error of every DH angle of the arm, θ offsets and Hayati's β included [rad].
        coupling_sigma: Error of every coupling between joints [-].
        joint_repeatability_rad: Error of every joint in every shot [rad].
        head: The drawing's head as the arm's last link.
        head_shift_m: Largest distance between the built head and the drawing [m].
        head_turn_rad: Largest angle between the built head and the drawing [rad].
        width_px: Image width [pixel].
        height_px: Image height [pixel].
        pixel_pitch_m: Distance between neighbouring pixels on the sensor [m].
        focal_length_m: Focal length of the lenses [m].
        focal_sigma: Relative error of the focal length.
        centre_sigma_m: Distance of the principal point from the sensor's middle, per axis [m].
        distortion: k1, k2, p1, p2, k3 of a typical lens.
        distortion_sigma: How lenses of one kind differ in these five.
        baseline_m: Distance between the cameras [m].
        convergence_m: Distance from the reference camera to where the optical axes meet [m].
        rig_shift_sigma_m: Error of the left camera's position, per axis [m].
        rig_turn_sigma_rad: Error of the left camera's direction, per axis [rad].
        pixel_noise_px: Error of a detected pixel, per coordinate, in recordings without images [pixel].
        columns: Inner corners of the chessboard along x.
        rows: Inner corners of the chessboard along y.
        square_m: Size of a square [m].
        print_sigma_m: Print error of every corner, per coordinate [m].
        board_sag_m: How far the middle of the chessboard lies behind its short sides [m]; only without images.
        placements: Placements of the chessboard.
        poses: Shots per placement of the chessboard.
        nearest_m: Shortest distance to the middle of the chessboard [m].
        farthest_m: Longest distance to the middle of the chessboard [m].
        view_tilt_rad: Largest tilt of the chessboard against the line of sight between the two cameras [rad].
        outline_squares: Part of the outermost squares that has to be in both images.
        margin_px: Distance from the image border that this outline keeps [pixel].
        standard_length_m: Certified length of the ruler [m].
        standard_uncertainty_m: Its standard uncertainty [m].
        mark_diameter_m: Diameter of the ruler's marks [m].
        ruler_placements: Placements of the ruler for verification.
        scale_views: Shots per mark of a ruler that a calibration may use as scale bar: the joints' errors of one shot
            would otherwise set the scale.
        ruler_tilt_rad: Largest tilt of the ruler against the line of sight between the two cameras [rad].
        blur_px: Gaussian blur of the lens [pixel].
        electrons_per_grey: Photoelectrons per grey value: they set the shot noise.
        read_noise_grey: Noise of the camera in the dark [grey value].
    """

    name: str = "paper"
    length_sigma_m: float = 0.5 * MM
    angle_sigma_rad: float = 0.03 * DEG
    coupling_sigma: float = 0.0
    joint_repeatability_rad: float = 50e-6
    head: PaperNumbers = PaperNumbers(  # noqa: RUF009 - frozen, so one default can be shared
        0.3516, 0.0901, 0.0727, 42.5612 * MM, 191.3183 * MM, 104.4643 * MM
    )
    head_shift_m: float = 2.0 * MM
    head_turn_rad: float = 0.3 * DEG
    width_px: int = 2452
    height_px: int = 2056
    pixel_pitch_m: float = 3.45e-6
    focal_length_m: float = 17.0 * MM
    focal_sigma: float = 0.003
    centre_sigma_m: float = 50e-6
    distortion: tuple[float, float, float, float, float] = (-0.08, 0.06, 0.0, 0.0, 0.0)
    distortion_sigma: tuple[float, float, float, float, float] = (0.01, 0.01, 2e-4, 2e-4, 0.0)
    baseline_m: float = 0.2
    convergence_m: float = 0.6
    rig_shift_sigma_m: float = 1.0 * MM
    rig_turn_sigma_rad: float = 0.2 * DEG
    pixel_noise_px: float = 0.05
    columns: int = 12
    rows: int = 9
    square_m: float = 20.0 * MM
    print_sigma_m: float = 5e-6
    board_sag_m: float = 0.0
    placements: int = 5
    poses: int = 10
    nearest_m: float = 0.56
    farthest_m: float = 0.64
    view_tilt_rad: float = 25.0 * DEG
    outline_squares: float = 0.25
    margin_px: float = 24.0
    standard_length_m: float = 1234.15 * MM
    standard_uncertainty_m: float = 3e-6
    mark_diameter_m: float = 24.0 * MM
    ruler_placements: int = 15
    scale_views: int = 5
    ruler_tilt_rad: float = 15.0 * DEG
    blur_px: float = 0.7
    electrons_per_grey: float = 40.0
    read_noise_grey: float = 0.3


SCENARIOS: dict[str, Scenario] = {
    "paper": Scenario(),
    "small": replace(
        Scenario(),
        name="small",
        width_px=612,
        height_px=514,
        pixel_pitch_m=13.8e-6,
        margin_px=6.0,
        placements=3,
        poses=6,
        ruler_placements=2,
    ),
}
"""Scenarios by name: the paper's cell, and the same cell with fewer shots and quarter-size images."""

_STREAMS = (
    "arm",
    "head",
    "rig",
    "print",
    "standard",
    "calibrate",
    "verify",
    "scale",
    "joints",
    "pixels",
    "image",
    "tracker",
)
"""Purposes of random numbers; their order is part of what a seed means."""


def stream(seed: int, purpose: str, indices: Sequence[int] = ()) -> np.random.Generator:
    """Random numbers of one purpose, independent of every other purpose and of the order of the calls.

    Args:
        seed: Seed of the cell.
        purpose: What the numbers are for.
        indices: Which placement, shot or camera of that purpose.
    """
    key = (_STREAMS.index(purpose), *(int(i) for i in indices))
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
