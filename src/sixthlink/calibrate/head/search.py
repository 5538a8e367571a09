"""How does the paper find the head?

Source: section II.C-D.

QPSO exactly as eq. (6)-(9) on the six numbers (α, β, γ, x, y, z) of eq. (11), several swarms side by side, and a
damped least-squares polish after each. The swarm alone seldom reaches the optimum: rotation and translation are
strongly coupled, the valley is narrow (docs/theory/qpso.md has the rates). It finds the basin; the polish does the
rest; the swarms' agreement is reported.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.factor import Objective, objective_values, rotation_values
from sixthlink.calibrate.head.problem import HeadProblem
from sixthlink.calibrate.head.refine import polished
from sixthlink.geometry import Floats, hat
from sixthlink.progress import Progress
from sixthlink.solvers import Qpso, SwarmBudget

__all__ = ["SearchBox", "SearchReport", "search_box", "search_head"]

AGREEMENT = 1e-6
"""Relative difference of F within which two swarms count as having found the same optimum."""


@dataclass(frozen=True)
class SearchBox:
    """Where the swarm searches: |α|, |γ| ≤ π, |β| ≤ π/2 and |x|, |y|, |z| ≤ ``half_width_m`` [m]."""

    half_width_m: float

    @property
    def walls(self) -> tuple[Floats, Floats]:
        """``(6,)`` lower and upper walls for (α, β, γ, x, y, z) [rad, m]."""
        upper = np.array([np.pi, np.pi / 2, np.pi, *[self.half_width_m] * 3])
        return -upper, upper


@dataclass(frozen=True)
class SearchReport:
    """What the search did.

    Attributes:
        variant: ``paper`` or ``robust``.
        seed: Seed of the generator.
        budget: Number, size and length of the swarms.
        box: Where they searched; the robust variant has no use for its width.
        best_unpolished_m2: Best F of any swarm before the polish [m²].
        value_m2: F after the polish [m²].
        agreeing: Swarms whose polished answer has that F.
    """

    variant: str
    seed: int
    budget: SwarmBudget
    box: SearchBox
    best_unpolished_m2: float
    value_m2: float
    agreeing: int


def search_box(problem: HeadProblem) -> SearchBox:
    """A box that surely holds the head: no farther from the flange than the robot's and target's distances add up."""
    reach = np.linalg.norm(problem.Ts_outer[:, :3, 3], axis=1).max()
    view = np.linalg.norm(problem.Ts_inner[:, :3, 3], axis=1).max()
    return SearchBox(float(reach + view))


def search_head(
    objective: Objective,
    box: SearchBox,
    *,
    seed: int,
    budget: SwarmBudget,
    progress: Progress,
    variant: str = "paper",
) -> tuple[Floats, SearchReport]:
    """Head ``(4, 4)`` with the smallest eq. (11) that any of the swarms, polished, has found.

    Args:
        objective: Eq. (11).
        box: Where the paper's six numbers are sought.
        seed: Seed of the generator.
        budget: Number, size and length of the swarms.
        progress: Listener.
        variant: ``paper`` for eq. (6)-(9) on (α, β, γ, x, y, z), ``robust`` for the same swarm on a quaternion, which
            has no seam and no gimbal lock, with the translation eliminated.
    """
    walls, judge, rotations = (
        _paper_formulation(objective, box) if variant == "paper" else _robust_formulation(objective)
    )
    swarms = Qpso(*walls, budget, np.random.default_rng(seed))
    while not swarms.done:
        swarms.tell(judge(swarms.ask()))
        if swarms.iteration % 50 == 0 or swarms.done:
            progress.step("search the head", min(swarms.iteration, budget.iterations), budget.iterations)
    heads = [polished(objective, R) for R in rotations(swarms.best_positions)]
    values = rotation_values(objective, np.stack([X[:3, :3] for X in heads]))
    best = int(np.argmin(values))
    agreeing = int(np.count_nonzero(values <= values[best] * (1.0 + AGREEMENT) + 1e-30))
    unpolished = float(swarms.best_values.min())
    return heads[best], SearchReport(variant, seed, budget, box, unpolished, float(values[best]), agreeing)


_Formulation = tuple[tuple[Floats, Floats], Callable[[Floats], Floats], Callable[[Floats], Floats]]


def _paper_formulation(objective: Objective, box: SearchBox) -> _Formulation:
    """Walls, judge and rotations of the paper's six numbers."""
    sign = np.array([-1.0, -1.0, 1.0])

    def judge(numbers: Floats) -> Floats:
        return objective_values(objective, paper_rotations(numbers), sign * numbers[..., 3:])

    return box.walls, judge, paper_rotations


def _robust_formulation(objective: Objective) -> _Formulation:
    """Walls, judge and rotations of an unnormalised quaternion."""
    upper = np.ones(4)

    def judge(quaternions: Floats) -> Floats:
        return rotation_values(objective, quaternion_rotations(quaternions))

    return (-upper, upper), judge, quaternion_rotations


def paper_rotations(numbers: Floats) -> Floats:
    """Rotations ``(..., 3, 3)`` = Rx(-α) Ry(β) Rz(γ) of ``(..., 6)`` paper numbers, all at once."""
    (ca, cb, cg), (sa, sb, sg) = (np.moveaxis(f(numbers[..., :3]), -1, 0) for f in (np.cos, np.sin))
    R = np.empty((*numbers.shape[:-1], 3, 3))
    R[..., 0, 0], R[..., 0, 1], R[..., 0, 2] = cb * cg, -cb * sg, sb
    R[..., 1, 0], R[..., 1, 1], R[..., 1, 2] = ca * sg - sa * sb * cg, ca * cg + sa * sb * sg, sa * cb
    R[..., 2, 0], R[..., 2, 1], R[..., 2, 2] = -sa * sg - ca * sb * cg, -sa * cg + ca * sb * sg, ca * cb
    return R


def quaternion_rotations(quaternions: Floats) -> Floats:
    """Rotations ``(..., 3, 3)`` of ``(..., 4)`` quaternions (scalar first) of any length but zero."""
    q = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    w, v = q[..., 0, None, None], q[..., 1:]
    S = hat(v)
    return np.eye(3) + 2.0 * (w * S + S @ S)
