"""Where did everything stand?

One picture for the eye, not for measuring: the base frame, the flange and the camera of every shot, the
target and the length standard at their placements, seen from the side and above in parallel projection.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from sixthlink.calibrate import Calibration, ShotEvidence, mark_points
from sixthlink.geometry import Floats, transform_points
from sixthlink.measure import base_points
from sixthlink.recording import BOARD_KINDS, EYE_IN_HAND, Detections, Recording, flange_poses_of, selected
from sixthlink.report.eye import WIDTH, Eye, base_triad, floor_grid, grid_note
from sixthlink.report.svg import drawing, element, outline, shortened, text
from sixthlink.units import MM

__all__ = ["Cell", "cell_of", "cell_plot"]

COLOURS = 6
"""Placements that have their own colour in the style sheet before colours repeat."""


@dataclass(frozen=True, eq=False)
class Cell:
    """What stood where, in the base frame [m].

    Attributes:
        moving: Whether the head rides on the flange; otherwise it stands still and the target rides.
        Ts_base_flange: ``(N, 4, 4)`` flange of every used shot.
        Ts_base_head: ``(N, 4, 4)`` head of every used shot; ``(1, 4, 4)`` for a fixed head.
        groups: ``(N,)`` number of the target's placement per shot.
        targets: ``(Q, 4, 3)`` corners of the target per placement, or per shot for a fixed head.
        target_groups: ``(Q,)`` number of the placement of each.
        names: Names of the placements.
        rulers: ``(R, 2, 3)`` marks of the length standard per placement.
    """

    moving: bool
    Ts_base_flange: Floats
    Ts_base_head: Floats
    groups: tuple[int, ...]
    targets: Floats
    target_groups: tuple[int, ...]
    names: tuple[str, ...]
    rulers: Floats

    @property
    def points(self) -> Floats:
        """``(M, 3)`` everything that must fit into the picture, the base included."""
        parts = [np.zeros((1, 3)), self.Ts_base_flange[:, :3, 3], self.Ts_base_head[:, :3, 3]]
        return np.concatenate([*parts, self.targets.reshape(-1, 3), self.rulers.reshape(-1, 3)])


def cell_of(
    calibration: Calibration,
    recording: Recording,
    shots: Sequence[tuple[int, ShotEvidence]],
    detections: Detections | None,
) -> Cell:
    """Everything that stood in the cell.

    Args:
        calibration: The calibration.
        recording: The recording that its shots belong to.
        shots: Index in the recording and evidence of every used shot, at least one.
        detections: What the cameras saw, the marks of the length standard among it; None shows no standard.
    """
    used = [index for index, _ in shots]
    flanges = flange_poses_of(recording, arm=calibration.arm)
    groups = tuple(calibration.placements.index(s.placement) for _, s in shots)
    moving = calibration.mount == EYE_IN_HAND
    heads = flanges[used] @ calibration.X if moving else calibration.X[None]
    of_placement = calibration.Ts_base_target
    Ts_base_target = of_placement if moving else flanges[used] @ of_placement[list(groups)]
    return Cell(
        moving=moving,
        Ts_base_flange=flanges[used],
        Ts_base_head=heads,
        groups=groups,
        targets=transform_points(Ts_base_target[:, None], _target_corners(recording)[None]),
        target_groups=tuple(range(len(of_placement))) if moving else groups,
        names=calibration.placements,
        rulers=_rulers(calibration, recording, flanges, detections),
    )


def cell_plot(cell: Cell) -> Markup:
    """The cell in parallel projection, with a floor grid in round millimetres."""
    eye = Eye.looking_at(cell.points)
    parts = floor_grid(eye) + _drops(cell, eye)
    parts += [
        outline(eye(target), f"target g{group % COLOURS}")
        for target, group in zip(cell.targets, cell.target_groups, strict=True)
    ]
    for ruler in eye(cell.rulers):
        parts.append(outline(ruler, "ruler", closed=False))
        parts += [element("circle", cx=float(u), cy=float(v), r=3, class_="ruler-end") for u, v in ruler]
    parts += _heads(cell, eye)
    parts += base_triad(eye, 0.16 * float(np.ptp(cell.points, axis=0).max()))
    parts += _names(cell, eye)
    return drawing(
        WIDTH,
        eye.height,
        parts,
        label="The cell: base frame, flange and camera poses, targets, length standard",
    )


def _target_corners(recording: Recording) -> Floats:
    """Outline ``(4, 3)`` of the target; a square of 100 mm stands for one that was recorded as poses only."""
    low, high = np.full(2, -50 * MM), np.full(2, 50 * MM)
    if recording.target is not None:
        points = recording.target.points_m[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
    return np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]])


def _rulers(calibration: Calibration, recording: Recording, flanges: Floats, detections: Detections | None) -> Floats:
    """Marks ``(R, 2, 3)`` of the length standard at every placement where both were seen."""
    none = np.zeros((0, 2, 3))
    if detections is None or calibration.rig is None or calibration.mount != EYE_IN_HAND:
        return none
    standing = np.array([kind not in BOARD_KINDS for kind in recording.kinds])
    marks, _ = mark_points(calibration.rig, selected(detections, standing[detections.shots]), recording.ids)
    at = base_points(marks, flanges, calibration.X)
    ends: dict[str, dict[int, Floats]] = {}
    for mark, point in zip(marks, at, strict=True):
        ends.setdefault(recording.placements[mark.shot], {})[mark.mark] = point
    both = [[e[0], e[1]] for e in ends.values() if 0 in e and 1 in e]
    return np.array(both) if both else none


def _drops(cell: Cell, eye: Eye) -> list[Markup]:
    """What stands above the floor, as thin lines down to it."""
    standing = cell.targets.mean(axis=1) if cell.moving else cell.targets[:0, 0]
    drops = np.stack([standing, standing * [1.0, 1.0, 0.0]], axis=1)
    return [outline(eye(drop), "drop", closed=False) for drop in drops]


def _heads(cell: Cell, eye: Eye) -> list[Markup]:
    """Flanges as dots, cameras as small pyramids that open along the view, a thin link between the two."""
    depth = (0.04 if cell.moving else 0.11) * float(np.ptp(cell.points, axis=0).max())
    pyramid = np.array([[0, 0, 0], [-0.4, -0.3, 1], [0.4, -0.3, 1], [0.4, 0.3, 1], [-0.4, 0.3, 1]]) * depth
    parts: list[Markup] = []
    for k, flange in enumerate(cell.Ts_base_flange):
        u, v = eye(flange[:3, 3])
        if cell.moving:
            link = np.stack([flange[:3, 3], cell.Ts_base_head[k, :3, 3]])
            parts.append(outline(eye(link), "link", closed=False))
        parts.append(element("circle", cx=float(u), cy=float(v), r=2, class_="flange"))
    for k, head in enumerate(cell.Ts_base_head):
        corners = eye(transform_points(head, pyramid))
        role = f"camera g{cell.groups[k] % COLOURS}" if cell.moving else "camera"
        parts.append(outline(corners[1:], role))
        parts += [outline(corners[[0, c]], role, closed=False) for c in range(1, 5)]
        if not cell.moving:
            parts.append(text(float(corners[0, 0]) + 8, float(corners[0, 1]), "camera", "label"))
    return parts


def _names(cell: Cell, eye: Eye) -> list[Markup]:
    """Names of the placements, moved apart where they would lie on each other, and the step of the grid."""
    parts = [grid_note(eye)]
    if not cell.moving or len(cell.names) > 12:
        return parts
    taken: list[tuple[float, float]] = []
    corners = eye(cell.targets)
    for k in np.argsort(corners[:, :, 1].max(axis=1)):
        u, v = float(corners[k, :, 0].mean()), float(corners[k, :, 1].max()) + 14.0
        while any(abs(u - a) < 90.0 and abs(v - b) < 14.0 for a, b in taken):
            v += 2.0
        taken.append((u, v))
        parts.append(text(u, v, shortened(cell.names[k], 130.0), f"label g{k % COLOURS}", anchor="middle"))
    return parts
