"""What does a head solver see, and nothing else?

    T_base_target = T_base_flange(q_i) · X · T_head_target_i          (eq. 10, with the flange in place of link 5)

is the same matrix for every shot of one placement. For a fixed head that watches a target on the flange, the same
product reads T_flange_target = T_flange_base(q_i) · T_base_head · T_head_target_i, so that only ``Ts_outer`` changes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.errors import TooFewShotsError
from sixthlink.geometry import (
    Floats,
    Ints,
    frozen_floats,
    frozen_ints,
    inverse,
    log_rotation,
    mean_transform,
    rotation_angle,
)
from sixthlink.recording import EYE_IN_HAND

__all__ = ["MINIMUM_MOTIONS", "HeadProblem", "Scatter", "head_problem", "placement_poses", "scatter"]

MINIMUM_MOTIONS = 2
"""Motions within placements that a head needs, about different axes: three shots of one, or two of two placements."""

ONE_MOTION_RAD = 0.035
"""Turn below which a single motion has no axis worth naming: 2°."""


@dataclass(frozen=True, eq=False)
class HeadProblem:
    """N shots of eq. (10).

    Attributes:
        Ts_outer: ``(N, 4, 4)`` T_base_flange (eye-in-hand) or T_flange_base (eye-to-hand).
        Ts_inner: ``(N, 4, 4)`` T_head_target.
        placements: ``(N,)`` number of the target's placement, 0 to P - 1.
    """

    Ts_outer: Floats
    Ts_inner: Floats
    placements: Ints

    def __post_init__(self) -> None:
        N = len(self.placements)
        object.__setattr__(self, "Ts_outer", frozen_floats(self.Ts_outer, (N, 4, 4), "Ts_outer"))
        object.__setattr__(self, "Ts_inner", frozen_floats(self.Ts_inner, (N, 4, 4), "Ts_inner"))
        object.__setattr__(self, "placements", frozen_ints(self.placements, (N,), "placements"))
        motions = N - len(np.unique(self.placements))
        if motions < MINIMUM_MOTIONS:
            raise TooFewShotsError(
                f"the head needs at least 3 usable shots of one target placement, or 2 of two placements each; there "
                f"are {N} shots of {N - motions} placements{_hidden_by_one_motion(self)}; record more shots (15 or "
                "more are recommended) or see why shots were rejected",
                needed=N - motions + MINIMUM_MOTIONS,
                usable=N,
            )


@dataclass(frozen=True, eq=False)
class Scatter:
    """How far each shot's target pose is from the mean of its placement.

    Attributes:
        translations_m: ``(N,)`` distance to the placement's mean position [m].
        rotations_rad: ``(N,)`` angle to the placement's mean orientation [rad].
    """

    translations_m: Floats
    rotations_rad: Floats

    @property
    def rms_translation_m(self) -> float:
        """Root mean square of the distances [m]."""
        return float(np.sqrt(np.mean(self.translations_m**2)))

    @property
    def rms_rotation_rad(self) -> float:
        """Root mean square of the angles [rad]."""
        return float(np.sqrt(np.mean(self.rotations_rad**2)))


def head_problem(mount: str, Ts_base_flange: Floats, Ts_head_target: Floats, placements: Ints) -> HeadProblem:
    """The problem of one recording, for either mount."""
    outer = Ts_base_flange if mount == EYE_IN_HAND else inverse(Ts_base_flange)
    return HeadProblem(outer, Ts_head_target, placements)


def placement_poses(problem: HeadProblem, X: Floats) -> Floats:
    """Mean target pose ``(P, 4, 4)`` of each placement under a head ``X`` ``(4, 4)``."""
    Ts_target = problem.Ts_outer @ X @ problem.Ts_inner
    return np.stack(
        [mean_transform(Ts_target[problem.placements == p]) for p in range(int(problem.placements.max()) + 1)]
    )


def scatter(problem: HeadProblem, X: Floats) -> Scatter:
    """Scatter of the target poses under a head ``X`` ``(4, 4)``: the residual of eq. (10), shot by shot."""
    means = placement_poses(problem, X)[problem.placements]
    deviations = inverse(means) @ problem.Ts_outer @ X @ problem.Ts_inner
    return Scatter(np.linalg.norm(deviations[:, :3, 3], axis=1), rotation_angle(deviations[:, :3, :3]))


def _hidden_by_one_motion(problem: HeadProblem) -> str:
    """What a single motion cannot show, in words; empty where there is none."""
    names, counts = np.unique(problem.placements, return_counts=True)
    if len(names) == 0 or counts.max() < 2:
        return ""
    first, second = problem.Ts_outer[problem.placements == names[counts.argmax()], :3, :3]
    turn = log_rotation(first.T @ second)
    angle = float(np.linalg.norm(turn))
    if angle < ONE_MOTION_RAD:
        return ", and one motion without a turn cannot show the head's position"
    axis = turn / angle * (np.sign(turn[np.argmax(np.abs(turn))]) or 1.0)
    words = ", ".join(f"{v + 0.0:.2f}" for v in np.round(axis, 2))
    return (
        f", and one motion cannot show the head's position along its axis ({words}), nor tell its orientation "
        "about that axis from its position across it"
    )
