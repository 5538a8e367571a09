"""What would a user have recorded in a simulated cell, and what is true in it?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sixthlink.geometry import Floats
from sixthlink.recording import EYE_IN_HAND, CameraDescription, Detections, Head, Recording, joined
from sixthlink.robot import Arm
from sixthlink.simulate.kinematics import chain_of_arm
from sixthlink.simulate.manufacture import (
    CAMERA_NAMES,
    built_arm,
    built_rig,
    drawn_head,
    mounted_head,
    printed_points,
)
from sixthlink.simulate.placements import Placement, board_placement, ruler_placement
from sixthlink.simulate.scenario import Scenario, stream
from sixthlink.simulate.sightings import true_pixels
from sixthlink.simulate.truth import GroundTruth, SimulatedCell
from sixthlink.simulate.views import Cell
from sixthlink.target import Chessboard, LengthStandard

__all__ = ["simulate_cell"]

Placements = dict[tuple[str, str], Placement]
"""Placements by (kind, name), in recorded order."""


def simulate_cell(
    scenario: Scenario,
    nominal_arm: Arm,
    target: Chessboard,
    *,
    seed: int,
    scale_placements: int = 0,
    images: bool = True,
) -> SimulatedCell:
    """Simulate a recording and its truth.

    The same seed gives the same cell; ``scale_placements`` and ``images`` change nothing in the rest of it.

    Args:
        scenario: The numbers of the cell.
        nominal_arm: The arm as its maker draws it, written as a DH table.
        target: The chessboard.
        seed: Seed of everything random.
        scale_placements: Further placements of the ruler that a calibration may use as scale bar.
        images: Whether the recording names images (:func:`render_image` paints them) or carries noisy pixels.

    Returns:
        The recording, its truth and what is needed to render the images.

    Raises:
        ValueError: The arm is no DH table, it does not reach the placements, or the target is not the
            scenario's.
    """
    wanted = (scenario.columns, scenario.rows, scenario.square_m)
    if (target.columns, target.rows, target.square_m) != wanted:
        raise ValueError(
            f"target has {target.columns} x {target.rows} corners of {target.square_m} m, but scenario "
            f"{scenario.name!r} has {wanted[0]} x {wanted[1]} of {wanted[2]} m; change one of them"
        )
    if images and scenario.board_sag_m:
        raise ValueError("a bent board is not rendered: simulate it without images")
    arm = built_arm(scenario, nominal_arm, stream(seed, "arm"))
    T_flange_drawing = drawn_head(scenario, nominal_arm)
    T_flange_head = mounted_head(scenario, T_flange_drawing, stream(seed, "head"))
    rig = built_rig(scenario, stream(seed, "rig"))
    cell = Cell(chain_of_arm(nominal_arm), T_flange_drawing, chain_of_arm(arm), T_flange_head, rig)
    placements = _placements(scenario, cell, target, seed, scale_placements)
    joints = np.concatenate([p.joints for p in placements.values()])
    recording = _recording(scenario, nominal_arm, target, T_flange_drawing, tuple(placements), seed=seed, joints=joints)
    joint_errors = stream(seed, "joints").standard_normal(joints.shape)
    length_error_m = scenario.standard_uncertainty_m * float(stream(seed, "standard").standard_normal())
    truth = GroundTruth(
        arm=arm,
        joints=joints + scenario.joint_repeatability_rad * joint_errors,
        rig=rig,
        T_flange_head=T_flange_head,
        Ts_base_placement={name: p.T_base_placement for (_, name), p in placements.items()},
        points_m=printed_points(
            target.points_m, scenario.print_sigma_m, stream(seed, "print"), sag_m=scenario.board_sag_m
        ),
        standard_length_m=scenario.standard_length_m + length_error_m,
        pixels=joined([]),
    )
    truth = replace(truth, pixels=true_pixels(recording, truth, scenario.pixel_noise_px))
    if images:
        names = {c: tuple(f"images/{shot}_{c}.png" for shot in recording.ids) for c in CAMERA_NAMES}
        recording = replace(recording, images=names)
    else:
        recording = replace(recording, pixels=_noisy(truth.pixels, stream(seed, "pixels")))
    return SimulatedCell(scenario, seed, target, recording, truth)


def _placements(scenario: Scenario, cell: Cell, target: Chessboard, seed: int, scale_placements: int) -> Placements:
    """All placements, each from its own random numbers; the scale bar is last and disturbs nothing."""
    placements: Placements = {}
    for k in range(scenario.placements):
        placement = board_placement(scenario, cell, target, k, stream(seed, "calibrate", [k]))
        placements["calibrate", f"p{k + 1}"] = placement
    for kind, letter, count in (("verify", "r", scenario.ruler_placements), ("scale", "s", scale_placements)):
        for k in range(count):
            views = scenario.scale_views if kind == "scale" else 1
            placement = ruler_placement(scenario, cell, k, stream(seed, kind, [k]), views=views)
            placements[kind, f"{letter}{k + 1}"] = placement
    return placements


def _recording(
    scenario: Scenario,
    nominal_arm: Arm,
    target: Chessboard,
    T_flange_drawing: Floats,
    placements: Sequence[tuple[str, str]],
    *,
    seed: int,
    joints: Floats,
) -> Recording:
    """The recording of placements (kind, name) before anything was seen in it."""
    standard = LengthStandard(
        scenario.standard_length_m, scenario.standard_uncertainty_m, "quadrant", scenario.mark_diameter_m
    )
    shots = {
        "calibrate": [(f"{v + 1:02d}", "") for v in range(scenario.poses)],
        "verify": [(mark, mark) for mark in standard.marks],
        "scale": [(f"{mark}{v + 1}", mark) for mark in standard.marks for v in range(scenario.scale_views)],
    }
    rows = [(kind, name, suffix, mark) for kind, name in placements for suffix, mark in shots[kind]]
    cameras = tuple(CameraDescription(name, scenario.width_px, scenario.height_px) for name in CAMERA_NAMES)
    return Recording(
        name=f"simulated cell, scenario {scenario.name}, seed {seed}",
        mount=EYE_IN_HAND,
        robot=nominal_arm.name,
        arm=nominal_arm,
        head=Head(cameras, T_flange_drawing),
        target=target,
        standard=standard,
        ids=tuple(f"{name}_{suffix}" for _, name, suffix, _ in rows),
        placements=tuple(name for _, name, *_ in rows),
        kinds=tuple(kind for kind, *_ in rows),
        marks=tuple(mark for *_, mark in rows),
        joints=joints,
    )


def _noisy(pixels: Detections, random: np.random.Generator) -> Detections:
    errors = pixels.sigmas_px[:, None] * random.standard_normal(pixels.pixels.shape)
    return replace(pixels, pixels=pixels.pixels + errors)
