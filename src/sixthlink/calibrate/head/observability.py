"""Which directions of the head did the motion make visible, and which not?

Three questions, in this order, each with a length or a sine that says how much there was to see:

- *Which positions?* A shift e of the head along the carrier's axes moves the target of shot i by R_i e. Only what
  differs between the shots of a placement is seen, so the excitation of e is the RMS of (R_i - mean R) e: the sine
  of the flange's turn about the axes across e. Axes that are all parallel leave the shift along them unseen; a flange
  that does not turn leaves all three.
- *Which turns?* A turn about an axis whose shift is seen shows in the target's orientation by just the same sine.
  About the common axis of all motions, or with a flange that does not turn, only the target's position tells: by how
  far the target moved against the head, beside its distance.
- *More than noise?* A robot's own angular noise turns the flange as well. What robot and head disagree about bounds
  it: an excitation counts only where it is twice what this disagreement could have made of nothing.

Reasons, and how often it errs: docs/theory/degenerate_motion.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.certificate import solve_certified
from sixthlink.calibrate.head.factor import objective
from sixthlink.calibrate.head.held import Held, held_objective
from sixthlink.calibrate.head.placement_sums import centred
from sixthlink.calibrate.head.problem import MINIMUM_MOTIONS, HeadProblem
from sixthlink.geometry import Floats, Ints, frozen_floats

__all__ = ["MINIMUM_EXCITATION", "NOISE_SAFETY", "Observability", "observability"]

MINIMUM_EXCITATION = 0.035
"""Excitation below which a direction counts as unseen: turns of 2° (RMS) about the placement's mean.

The head's position is then 30 times less certain than the target's."""

MINIMUM_PARALLAX = 0.01
"""Share of the target's distance that it must have moved against the head to show a turn that nothing else shows."""

NOISE_SAFETY = 2.0
"""Times the most that noise can fake by which a direction must stand out."""

SAME_AXIS = 1e-3
"""Sine below which an axis of the carrier counts as across the unseen one, where its noise says no more."""


OUTLIER = 4.0
"""Times the median disagreement beyond which a shot has no say: with Gaussian noise hardly ever."""

ROUNDS = 4
"""Times that such shots are looked for."""


@dataclass(frozen=True, eq=False)
class Observability:
    """What a recording can say about the head.

    Attributes:
        excitations: ``(3,)`` sine of the flange's turn that shows each direction of the head's position, smallest
            first, RMS over the shots [-].
        axes: ``(3, 3)`` one row per excitation: the direction, in the frame that carries the head.
        limit: Excitation that a direction needs; above ``MINIMUM_EXCITATION`` where noise sets it.
        disagreement_rad: RMS turn by which robot and head disagree, per axis [rad].
        positions: ``(k, 3)`` unseen directions of the position, k = 0, 1 or 3.
        turns: ``(m, 3)`` axes about which the orientation is unseen, m = 0, 1 or 3.
        shifts: ``(m, 3)`` position [m/rad] that goes unseen with each of those turns.
        axis_noise: Sine by which noise may have turned the unseen direction, or what counts as none.
        words: One sentence per unseen direction, or per three of them that belong together.
    """

    excitations: Floats
    axes: Floats
    limit: float
    disagreement_rad: float
    positions: Floats
    turns: Floats
    shifts: Floats
    axis_noise: float
    words: tuple[str, ...]

    def __post_init__(self) -> None:
        for name, shape in (("positions", (None, 3)), ("turns", (None, 3)), ("shifts", (None, 3))):
            object.__setattr__(self, name, frozen_floats(getattr(self, name), shape, name))

    @property
    def complete(self) -> bool:
        """Whether the whole head can be seen."""
        return len(self.positions) == 0

    @property
    def noise_decides(self) -> bool:
        """Whether an unseen direction did turn enough, but no more than the disagreement alone might fake."""
        return not self.complete and bool(self.excitations[len(self.positions) - 1] >= MINIMUM_EXCITATION)


def observability(problem: HeadProblem, *, carrier: str) -> Observability:
    """Directions of the head that eq. (10) can see.

    Args:
        problem: The shots.
        carrier: Name of the frame that carries the head, for the words: ``flange`` or ``base``.
    """
    found = _judged(problem, carrier)
    for _ in range(ROUNDS):
        kept = _agreeing(problem) if found.noise_decides else np.arange(len(problem.placements))
        names, placements = np.unique(problem.placements[kept], return_inverse=True)
        if len(kept) == len(problem.placements) or len(kept) - len(names) < MINIMUM_MOTIONS:
            break
        problem = HeadProblem(problem.Ts_outer[kept], problem.Ts_inner[kept], placements)
        found = _judged(problem, carrier)
    return found


def _judged(problem: HeadProblem, carrier: str) -> Observability:
    """The verdict on all of the given shots."""
    motions = len(problem.placements) - int(problem.placements.max()) - 1
    R_outer = problem.Ts_outer[:, :3, :3]
    squares, vectors = np.linalg.eigh(_mean_square(centred(R_outer, problem.placements), motions))
    excitations = np.sqrt(np.maximum(squares, 0.0))
    eq11 = objective(problem, 1.0)
    X = solve_certified(eq11)[0]
    noise_rad = _noise(R_outer @ X[:3, :3] @ problem.Ts_inner[:, :3, :3], problem, motions) / np.sqrt(2.0)
    limit = max(MINIMUM_EXCITATION, _fake(noise_rad, motions))
    positions = _unseen(excitations, vectors, limit)
    axis_noise = max(SAME_AXIS, 3.0 * noise_rad / (float(excitations[1]) * np.sqrt(motions) + 1e-12))
    turns, shifts = np.zeros((0, 3)), np.zeros((0, 3))
    if len(positions):
        held = Held(positions, np.zeros((0, 3)), np.eye(3))
        X = held.head(solve_certified(held_objective(eq11, held))[0])
        turns, shifts = _unseen_turns(problem, X, positions, motions)
    turned = bool(excitations[-1] >= MINIMUM_EXCITATION)
    words = _words(positions, turns, shifts, carrier, turned=turned)
    noise = axis_noise if len(positions) == 1 else SAME_AXIS
    return Observability(excitations, vectors.T, limit, noise_rad, positions, turns, shifts, noise, words)


def _unseen_turns(problem: HeadProblem, X: Floats, positions: Floats, motions: int) -> tuple[Floats, Floats]:
    """Axes ``(m, 3)`` about which the orientation is unseen, and the positions that go with each turn [m/rad]."""
    R_outer = problem.Ts_outer[:, :3, :3]
    arms_m = problem.Ts_inner[:, :3, 3] @ X[:3, :3].T
    distance_m = float(np.sqrt(np.mean(np.sum(arms_m**2, axis=1))))
    points_m = (R_outer @ (arms_m + X[:3, 3])[..., None])[..., 0] + problem.Ts_outer[:, :3, 3]
    fake_m = _fake(_noise(points_m, problem, motions), motions)
    limit_m = max(MINIMUM_PARALLAX * distance_m, fake_m, 1e-12)
    moves = np.cross(positions[:, None], arms_m[None])
    moved = centred(np.einsum("nij,knj->nik", R_outer, moves), problem.placements)
    if len(positions) == 3:  # and then they are the frame's own axes
        squares, vectors = np.linalg.eigh(_mean_square(moved, motions))
        turns = _unseen(np.sqrt(np.maximum(squares, 0.0)), vectors, limit_m)
        return turns, np.zeros_like(turns)
    # A shift across the axis may undo the turn, shot by shot, as it does where one joint alone was moved.
    across = np.linalg.svd(positions)[2][1:]
    shifted = centred(R_outer @ across.T, problem.placements).reshape(-1, 2)
    shift = np.linalg.lstsq(shifted, -moved.reshape(-1), rcond=None)[0]
    left = moved.reshape(-1) + shifted @ shift
    if np.sqrt(left @ left / motions) >= limit_m:
        return np.zeros((0, 3)), np.zeros((0, 3))
    return positions, (shift @ across)[None]


def _unseen(excitations: Floats, vectors: Floats, limit: float) -> Floats:
    """Directions ``(k, 3)`` of columns below the limit, smallest first; two of three never are alone: then all are."""
    count = int(np.count_nonzero(excitations < limit))
    return np.eye(3) if count > 1 else vectors.T[:count]


def _agreeing(problem: HeadProblem) -> Ints:
    """Shots without those that disagree far more than most: they excite and disagree alike, and tell nothing."""
    X = solve_certified(objective(problem, 1.0))[0]
    R = problem.Ts_outer[:, :3, :3] @ X[:3, :3] @ problem.Ts_inner[:, :3, :3]
    deviations = np.empty(len(R))
    for p in np.unique(problem.placements):
        members = problem.placements == p
        deviations[members] = np.linalg.norm(R[members] - np.median(R[members], axis=0), axis=(1, 2))
    return np.flatnonzero(deviations <= OUTLIER * np.median(deviations))


def _mean_square(deviations: Floats, motions: int) -> Floats:
    """Mean square ``(3, 3)`` over the motions of columns ``(N, 3, 3)``."""
    return np.einsum("nij,nik->jk", deviations, deviations) / motions


def _noise(values: Floats, problem: HeadProblem, motions: int) -> float:
    """Standard deviation per axis of what should be the same within each placement, three unknowns fitted."""
    left = centred(values, problem.placements)
    return float(np.sqrt(np.sum(left**2) / (3.0 * max(motions - 1, 1))))


def _fake(noise: float, motions: int) -> float:
    """Excitation that a direction must exceed to be more than the noise of the same shots, with its safety.

    Were all noise the robot's, what it excites would be part of what robot and head disagree about: at most √3 times
    the disagreement per axis, reached when all of it lies across the direction. Both are chance where the head is noisy
    too, the more so the fewer the motions.
    """
    return NOISE_SAFETY * noise * float(np.sqrt(3.0 * motions / max(motions - 1, 1)))


def _words(positions: Floats, turns: Floats, shifts: Floats, carrier: str, *, turned: bool) -> tuple[str, ...]:
    """What is unseen, the position first."""
    words = []
    if len(positions) == 3:
        why = "no turn stands out from what robot and head disagree about" if turned else "the robot hardly turned"
        words.append(f"the head's position in the {carrier} frame, all three directions: {why}")
    elif len(positions) == 1:
        words.append(f"the head's position along the common axis {_axis(positions[0])} of the {carrier}")
    if len(turns) == 3:
        words.append(f"the head's orientation in the {carrier} frame, all three angles: the robot hardly moved")
    elif len(turns) == 1:
        words.append(f"the head's orientation about {_axis(turns[0])} of the {carrier}" + _why(positions, shifts[0]))
    return tuple(words)


def _why(positions: Floats, shift: Floats) -> str:
    if len(positions) == 3:
        return ": the robot moved along that line only"
    beside = "" if np.linalg.norm(shift) < SAME_AXIS else ", and with it the position across that axis"
    return f"{beside}: the robot hardly moved but for turning about that axis"


def _axis(direction: Floats) -> str:
    unit = direction / np.linalg.norm(direction)
    unit = unit * (np.sign(unit[np.argmax(np.abs(unit))]) or 1.0)
    return "(" + ", ".join(f"{np.where(abs(v) < 5e-3, 0.0, v):.2f}" for v in unit) + ")"
