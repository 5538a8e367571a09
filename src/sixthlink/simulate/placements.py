"""Where does the operator put the board and the ruler, and from where is each seen?

Placements are drawn over the workspace, spread evenly over directions and inclinations and at random
otherwise, and thrown away until the arm reaches every view and both cameras see what they need in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, exp_rotation, transform
from sixthlink.simulate.scenario import Scenario
from sixthlink.simulate.views import Cell, board_views, gaze, mark_views, reached_views, seen_inside
from sixthlink.target import Chessboard

__all__ = ["Placement", "board_outline", "board_placement", "ruler_placement"]

AZIMUTH_RAD = math.radians(55.0)
"""Boards and rulers lie within this angle to both sides of the arm's forward direction."""
BOARD_RADII_M, BOARD_HEIGHTS_M, BOARD_INCLINATION_RAD = (0.75, 1.15), (0.05, 0.75), math.radians(50.0)
RULER_RADII_M, RULER_CLEARANCES_M, RULER_ELEVATION_RAD = (0.7, 1.3), (0.05, 0.7), math.radians(80.0)
LOOKOUT_M = np.array([0.4, 0.0, 1.0])
"""The ruler's face is turned roughly towards this point above the arm's foot."""
ATTEMPTS = 300
"""Placements that are tried before the arm counts as unable to reach any."""
CANDIDATES = 96
"""Views of a board that are drawn per wanted view."""
TRIED_BY_ARM = 6
"""Views per wanted view that the inverse kinematics tries at once."""


@dataclass(frozen=True, eq=False)
class Placement:
    """One placement and the joint values of its V shots.

    Attributes:
        T_base_placement: ``(4, 4)`` pose of the board frame or of the ruler frame.
        joints: ``(V, J)`` joint values that the controller is told [rad or m].
    """

    T_base_placement: Floats
    joints: Floats


def board_placement(
    scenario: Scenario, cell: Cell, board: Chessboard, number: int, random: np.random.Generator
) -> Placement:
    """A placement of the board with ``scenario.poses`` shots, all inner corners inside both images in each.

    Args:
        scenario: The numbers of the cell.
        cell: The arm and the head.
        board: The chessboard.
        number: Number of the placement: successive numbers spread over the workspace.
        random: Random numbers of this placement.

    Raises:
        ValueError: The arm cannot reach enough views of any placement.
    """
    for _ in range(ATTEMPTS):
        T_base_board = _board_pose(number, random)
        joints = _board_joints(scenario, cell, board, T_base_board, random)
        if joints is not None:
            return Placement(T_base_board, joints)
    raise _unreachable("chessboard", scenario)


def ruler_placement(
    scenario: Scenario, cell: Cell, number: int, random: np.random.Generator, *, views: int = 1
) -> Placement:
    """A placement of the ruler: shots of mark A, then of mark B, each near the middle of both images.

    Args:
        scenario: The numbers of the cell.
        cell: The arm and the head.
        number: Number of the placement: successive numbers spread over the workspace.
        random: Random numbers of this placement.
        views: Shots per mark.

    Raises:
        ValueError: The arm cannot reach both ends of any placement.
    """
    for _ in range(ATTEMPTS):
        T_base_ruler = _ruler_pose(scenario.standard_length_m, number, random)
        joints = _ruler_joints(scenario, cell, T_base_ruler, random, views)
        if joints is not None:
            return Placement(T_base_ruler, joints)
    raise _unreachable("ruler", scenario)


def board_outline(board: Chessboard, around_squares: float) -> Floats:
    """Corners ``(4, 3)`` in the board frame [m] of what lies within some squares around the inner corners."""
    near = -around_squares * board.square_m
    across = (board.columns - 1) * board.square_m - near
    down = (board.rows - 1) * board.square_m - near
    return np.array([[near, near, 0.0], [across, near, 0.0], [across, down, 0.0], [near, down, 0.0]])


def _board_joints(
    scenario: Scenario, cell: Cell, board: Chessboard, T_base_board: Floats, random: np.random.Generator
) -> Floats | None:
    """Joint values ``(V, J)`` of all views, or None when the arm cannot reach enough of them."""
    V, outline = scenario.poses, board_outline(board, scenario.outline_squares)
    T_middle_board = transform(np.eye(3), -outline.mean(axis=0))
    azimuths = 2.0 * np.pi * (np.arange(V)[:, None] + random.uniform(size=(V, CANDIDATES))) / V
    tilts = scenario.view_tilt_rad * random.uniform(0.3, 1.0, (V, CANDIDATES))
    depths = (scenario.nearest_m - scenario.convergence_m, scenario.farthest_m - scenario.convergence_m)
    # The image favours rolls of 0° and 180°; wanting an even spread brings in others as far as they fit.
    rolls = random.uniform(-np.pi, np.pi, (V, CANDIDATES))
    wanted_rolls = 2.0 * np.pi * random.permutation(V)[:, None] / V + random.uniform(-np.pi, np.pi)
    Ts_gaze_middle = board_views(random, tilts.ravel(), azimuths.ravel(), rolls.ravel(), depths)
    Ts_head_board = gaze(scenario.baseline_m, scenario.convergence_m) @ Ts_gaze_middle @ T_middle_board
    fits = seen_inside(cell.rig, Ts_head_board, outline, scenario.margin_px).reshape(V, CANDIDATES)
    off = np.abs(np.angle(np.exp(1j * (rolls - wanted_rolls))))
    order = np.argsort(np.where(fits, off, np.inf), axis=1)[:, :TRIED_BY_ARM]
    chosen = [v * CANDIDATES + order[v, : np.count_nonzero(fits[v])] for v in range(V)]
    joints, usable = reached_views(
        cell,
        T_base_board,
        Ts_head_board[np.concatenate(chosen)],
        lambda Ts: seen_inside(cell.rig, Ts, outline, scenario.margin_px),
        random,
    )
    return _first_of_each(joints, usable, [len(c) for c in chosen])


def _ruler_joints(
    scenario: Scenario, cell: Cell, T_base_ruler: Floats, random: np.random.Generator, views: int
) -> Floats | None:
    """Joint values ``(2 views, J)`` that look at mark A, then at mark B; None when the arm cannot reach both."""
    ends = []
    disc = scenario.mark_diameter_m * np.array([[1.0, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]])
    for x_m in (0.0, scenario.standard_length_m):
        T_ruler_mark = transform(np.eye(3), [x_m, 0.0, 0.0])
        Ts_gaze_mark = mark_views(random, views * TRIED_BY_ARM, scenario.ruler_tilt_rad)
        joints, usable = reached_views(
            cell,
            T_base_ruler @ T_ruler_mark,
            gaze(scenario.baseline_m, scenario.convergence_m) @ Ts_gaze_mark,
            lambda Ts: seen_inside(cell.rig, Ts, disc, 0.25 * scenario.height_px),
            random,
        )
        end = _first_of_each(joints, usable, [TRIED_BY_ARM] * views)
        if end is None:
            return None
        ends.append(end)
    return np.concatenate(ends)


def _first_of_each(joints: Floats, usable: npt.NDArray[np.bool_], sizes: list[int]) -> Floats | None:
    """The first usable row of each group of rows, or None when a group has none."""
    rows, start = [], 0
    for size in sizes:
        good = np.flatnonzero(usable[start : start + size])
        if len(good) == 0:
            return None
        rows.append(start + int(good[0]))
        start += size
    return joints[rows]


def _board_pose(number: int, random: np.random.Generator) -> Floats:
    """A board that lies or leans towards the arm, anyhow turned in its own plane."""
    u, v = _spread(number, random)
    azimuth = AZIMUTH_RAD * (2.0 * u - 1.0)
    leaning = azimuth + random.uniform(-0.6, 0.6)
    inclination = BOARD_INCLINATION_RAD * v
    front = np.array(
        [-np.sin(inclination) * np.cos(leaning), -np.sin(inclination) * np.sin(leaning), np.cos(inclination)]
    )
    R = _facing(front, np.array([-np.sin(leaning), np.cos(leaning), 0.0]))
    in_plane = exp_rotation(np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)]))
    return transform(R @ in_plane, _somewhere(azimuth, BOARD_RADII_M, BOARD_HEIGHTS_M, random))


def _ruler_pose(length_m: float, number: int, random: np.random.Generator) -> Floats:
    """A ruler from lying to nearly upright, its face turned towards the arm; the origin is mark A."""
    u, v = _spread(number, random)
    elevation = RULER_ELEVATION_RAD * v * random.choice([-1.0, 1.0])
    lift = 0.5 * length_m * abs(np.sin(elevation))
    heights = (lift + RULER_CLEARANCES_M[0], lift + RULER_CLEARANCES_M[1])
    middle = _somewhere(AZIMUTH_RAD * (2.0 * u - 1.0), RULER_RADII_M, heights, random)
    heading = random.uniform(-np.pi, np.pi)
    along = np.array([np.cos(elevation) * np.cos(heading), np.cos(elevation) * np.sin(heading), np.sin(elevation)])
    R = _facing(LOOKOUT_M + random.uniform(-0.2, 0.2, 3) - middle, along)
    return transform(R, middle - 0.5 * length_m * along)


def _spread(number: int, random: np.random.Generator) -> tuple[float, float]:
    """A point of the unit square; successive numbers fill it evenly (Roberts' R2 sequence), blurred a bit."""
    ratio = 1.32471795724474602596
    u, v = (np.array([1.0 / ratio, 1.0 / ratio**2]) * (number + 1) + random.uniform(-0.1, 0.1, 2)) % 1.0
    return float(u), float(v)


def _somewhere(
    azimuth_rad: float,
    radii_m: tuple[float, float],
    heights_m: tuple[float, float],
    random: np.random.Generator,
) -> Floats:
    """A point ``(3,)`` in the base frame in a given direction."""
    radius = random.uniform(*radii_m)
    return np.array([radius * np.cos(azimuth_rad), radius * np.sin(azimuth_rad), random.uniform(*heights_m)])


def _facing(front: Floats, along: Floats) -> Floats:
    """Rotation whose x is ``along`` and whose z points away from ``front``, as far as x allows."""
    z = -(front - (front @ along) * along)
    z = z / np.linalg.norm(z)
    return np.column_stack([along, np.cross(z, along), z])


def _unreachable(what: str, scenario: Scenario) -> ValueError:
    return ValueError(
        f"after {ATTEMPTS} attempts the arm reaches no placement of the {what} in scenario "
        f"{scenario.name!r}, whose distances suit an arm of about 1.4 m reach; simulate such an arm"
    )
