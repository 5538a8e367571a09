"""What was not observed, what becomes of it, and which numbers depend on it?

Nothing is concluded from formulas: the head is moved along everything that is unseen, and each number that changes
was not observed, whatever its name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate.head import (
    HeadProblem,
    Held,
    Observability,
    held_objective,
    held_turns,
    objective,
    placement_poses,
    solve_certified,
)
from sixthlink.errors import DegenerateMotionError
from sixthlink.geometry import Floats, exp_rotation, frozen_floats, transform
from sixthlink.units import DEG

__all__ = ["REST", "Unobserved", "changing", "degenerate_motion", "what_is_held"]

REST = "--observable-rest"
"""The option of ``sixthlink calibrate`` that solves the observable rest."""

STEPS = (0.1, 0.5, -0.3)
"""Steps [m or rad] along an unseen direction; several, so that no number stands still by accident."""


@dataclass(frozen=True, eq=False)
class Unobserved:
    """What the motion of a recording does not show of the head and of the target's placements.

    Attributes:
        words: One sentence per unseen direction, or per three of them that belong together.
        motions: ``(k, 6)`` the unseen motions (δp, δθ) of the head in the frame that carries it; a position counts in
            metres, a turn in radians, and brings the position along that goes unseen with it.
        tolerance: Change per unit of an unseen motion below which a number counts as observed all the same.
        targets: ``(P, 4, 4)`` entries of the placements' target poses that were not observed.
    """

    words: tuple[str, ...]
    motions: Floats
    tolerance: float
    targets: npt.NDArray[np.bool_]

    def __post_init__(self) -> None:
        object.__setattr__(self, "motions", frozen_floats(self.motions, (None, 6), "motions"))

    @property
    def turns(self) -> bool:
        """Whether any of the orientation is unseen."""
        return bool(self.motions[:, 3:].any())

    @property
    def axes_across(self) -> Floats:
        """``(m, 3)`` unit axes along which the position was observed, as near to the frame's own as can be."""
        turning = self.motions[:, 3:].any(axis=1)
        if (np.linalg.norm(self.motions[turning, :3], axis=1) > self.tolerance).any():
            return np.zeros((0, 3))
        unseen = self.motions[~turning, :3]
        left = np.eye(3) - unseen.T @ unseen
        found: list[Floats] = []
        for k in sorted(np.argsort(-np.diag(left), kind="stable")[: 3 - len(unseen)]):
            axis = left[k] - sum(((axis @ left[k]) * axis for axis in found), np.zeros(3))
            found.append(axis / np.linalg.norm(axis))
        return np.array(found).reshape(-1, 3)


def degenerate_motion(seen: Observability) -> DegenerateMotionError:
    """The refusal of a motion that leaves a direction of the head unseen."""
    hidden, cure = "; ".join(seen.words), f"or solve the observable rest with calibrate {REST}"
    if seen.noise_decides:
        return DegenerateMotionError(
            f"robot and head disagree by {seen.disagreement_rad / DEG:.2g}° (RMS, per axis), which alone might fake "
            f"the turns that would show {hidden}; look for a joint of wrong sign or order, a wrong mount, direction "
            "or orientation convention, shots paired with the wrong pose, a board read from the other end; if none "
            f"of these, turn the flange more, or add shots, {cure}",
            directions=seen.words,
        )
    return DegenerateMotionError(
        f"the robot's motion cannot show {hidden}; add shots that turn the flange by 20° or more about at least two "
        f"different axes, {cure}",
        directions=seen.words,
    )


def what_is_held(problem: HeadProblem, seen: Observability) -> tuple[Held, Unobserved]:
    """Where the unseen directions of a recording are held while the rest is solved, and their record."""
    free = Held(seen.positions, np.zeros((0, 3)), np.eye(3))
    X = solve_certified(held_objective(objective(problem, 1.0), free))[0]
    held = Held(seen.positions, seen.turns, held_turns(X[:3, :3], seen.turns))
    X = held.head(solve_certified(held_objective(objective(problem, 1.0), held))[0])
    motions = np.concatenate(
        [np.pad(seen.positions, ((0, 0), (0, 3))), np.concatenate([seen.shifts, seen.turns], axis=1)]
    )
    record = Unobserved(
        seen.words, motions, seen.axis_noise, np.zeros((len(np.unique(problem.placements)), 4, 4), bool)
    )
    targets = changing(lambda head: placement_poses(problem, head), X, record)
    return held, Unobserved(seen.words, motions, seen.axis_noise, targets)


def changing(values_of: Callable[[Floats], Floats], X: Floats, unobserved: Unobserved) -> npt.NDArray[np.bool_]:
    """Which numbers of a head ``(4, 4)`` change where the head moves along what is unseen, and so were not observed.

    Args:
        values_of: Numbers of a head, an array of any shape [m, rad or -].
        X: The head.
        unobserved: What is unseen.
    """
    here = values_of(X)
    changed = np.zeros(here.shape, dtype=bool)
    for motion in unobserved.motions:
        for step in STEPS:
            R = exp_rotation(step * motion[3:]) @ X[:3, :3]
            there = values_of(transform(R, X[:3, 3] + step * motion[:3]))
            changed |= np.abs(there - here) > unobserved.tolerance * abs(step)
    return changed
