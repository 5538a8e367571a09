"""Has the tracker moved between the sweeps?

Reference points on the floor, measured again with every sweep, stand still unless the tracker does not. From one
point a shift is seen, from two also a turn across their line, from three the whole motion. Equation (C14) of
docs/theory/circle_points.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtrc

from sixthlink.calibrate.tracker.findings import CircleFinding, degrees, millimetres
from sixthlink.geometry import Floats, exp_rotation, frozen_floats, hat, inverse, transform

__all__ = ["TrackerMotion", "drift_findings", "tracker_motion"]

FALSE_ALARM = 1e-3
"""Share of sessions with a still tracker that are blamed."""

FEWEST_DOF = 3
"""Degrees of freedom from which the points show their own noise: those of three points."""


@dataclass(frozen=True, eq=False)
class TrackerMotion:
    """How reference points seem to have moved.

    Attributes:
        shift_m: ``(3,)`` motion of the mean of the points [m].
        turn_rad: ``(3,)`` rotation vector of the points about their mean; zero along what they do not show.
        T_before_after: ``(4, 4)`` what carries points measured after the motion back to where they were before.
        covariance: ``(6, 6)`` of shift and turn; zero along turns that are not seen.
        seen_turns: Number of directions of the turn that the points show: 0, 2 or 3.
        times_noise: Length of the motion in units of what noise makes on average.
        chance: Chance of so large a motion if nothing moved.
        rms_m: What the motion leaves, per coordinate [m]; zero for one point.
    """

    shift_m: Floats
    turn_rad: Floats
    T_before_after: Floats
    covariance: Floats
    seen_turns: int
    times_noise: float
    chance: float
    rms_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "shift_m", frozen_floats(self.shift_m, (3,), "shift"))
        object.__setattr__(self, "turn_rad", frozen_floats(self.turn_rad, (3,), "turn"))
        object.__setattr__(self, "T_before_after", frozen_floats(self.T_before_after, (4, 4), "T_before_after"))
        object.__setattr__(self, "covariance", frozen_floats(self.covariance, (6, 6), "covariance"))


def tracker_motion(before_m: Floats, after_m: Floats, noise_m: float | None = None) -> TrackerMotion:
    """The rigid motion that carries reference points to where they were seen again, and its significance (C14).

    Args:
        before_m: ``(K, 3)`` points.
        after_m: ``(K, 3)`` the same points measured again.
        noise_m: Noise of one coordinate of one measurement; None takes it from what the motion leaves, for which three
            points or more are needed.

    Raises:
        ValueError: No point, or the noise is neither given nor to be had.
    """
    before = frozen_floats(before_m, (None, 3), "reference points before")
    after = frozen_floats(after_m, (len(before), 3), "reference points after")
    if len(before) == 0:
        raise ValueError("there is no reference point")
    middle = before.mean(axis=0)
    levers = before - middle
    shift, turn = after.mean(axis=0) - middle, np.zeros(3)
    seen = _seen_turns(levers)
    for _ in range(10):
        R = exp_rotation(turn)
        moved = levers @ R.T
        left = after - middle - shift - moved
        rows = -hat(moved).reshape(-1, 3) @ seen.T
        step = seen.T @ np.linalg.lstsq(rows, left.reshape(-1), rcond=None)[0] if len(seen) else np.zeros(3)
        turn = turn + step
        if np.linalg.norm(step) < 1e-14:
            break
    dof = 3 * len(before) - 3 - len(seen)
    left2 = float(np.sum((after - middle - shift - levers @ exp_rotation(turn).T) ** 2))
    if noise_m is None and dof < FEWEST_DOF:
        raise ValueError("the noise of the reference points is needed: they are too few to show it")
    # Both measurements are noisy: a difference has twice the variance.
    variance = 2.0 * noise_m**2 if noise_m is not None else max(left2 / dof, (1e-13 * np.abs(before).max()) ** 2)
    rows = -hat(levers).reshape(-1, 3) @ seen.T
    inner = rows.T @ rows
    turns = seen.T @ np.linalg.inv(inner) @ seen if len(seen) else np.zeros((3, 3))
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = variance / len(before) * np.eye(3)
    covariance[3:, 3:] = variance * turns
    d2 = (len(before) * float(shift @ shift) + float(np.sum((rows @ (seen @ turn)) ** 2))) / variance
    terms = 3 + len(seen)
    chance = float(chdtrc(terms, d2)) if noise_m is not None else float(fdtrc(terms, dof, d2 / terms))
    rms_m = float(np.sqrt(left2 / dof / 2.0)) if dof > 0 else 0.0
    R = exp_rotation(turn)
    T_before_after = inverse(transform(R, middle + shift - R @ middle))
    return TrackerMotion(shift, turn, T_before_after, covariance, len(seen), float(np.sqrt(d2 / terms)), chance, rms_m)


def _seen_turns(levers: Floats) -> Floats:
    """Unit directions ``(T, 3)`` of turns that the points show: none, across their line, or all."""
    if len(levers) < 2:
        return np.zeros((0, 3))
    _, sizes, directions = np.linalg.svd(levers, full_matrices=True)
    if sizes[0] == 0.0:
        return np.zeros((0, 3))
    return directions if len(levers) > 2 and sizes[1] > 1e-3 * sizes[0] else directions[1:]


def drift_findings(
    names: Sequence[str], references: Sequence[Mapping[str, Floats]], noise_m: float | None = None
) -> tuple[CircleFinding, ...]:
    """Between which sweeps the tracker moved.

    Every sweep is compared with the mean of those before it that agreed with each other, so that a slow drift is found
    as well once it has grown out of the noise.

    Args:
        names: Names of the sweeps in the order in which they were measured.
        references: For each the reference points by name ``(3,)`` [m].
        noise_m: Noise of one coordinate, for example the largest ``noise_m`` of the sweeps' fits.
    """
    found, group = [], [dict(references[0])] if references else []
    compared = 0
    for k in range(1, len(references)):
        common = [n for n in references[k] if any(n in g for g in group)]
        if common:
            means = np.array([np.mean([g[n] for g in group if n in g], axis=0) for n in common])
            after = np.array([references[k][n] for n in common])
            if noise_m is None and 3 * len(common) - 6 < FEWEST_DOF:
                continue
            compared += 1
            motion = tracker_motion(means, after, noise_m)
            if motion.chance < FALSE_ALARM / len(references):
                found.append(_moved(names[k - 1], names[k], motion))
                group = []
        group.append(dict(references[k]))
    if len(references) > 1 and compared == 0:
        why = "no reference point was measured with more than one sweep"
        if any(references):
            why = "too few reference points are common to two sweeps, or their noise is not known"
        words = (
            f"{why}: whether the tracker stood still is not checked; measure three points on the floor with every sweep"
        )
        found.append(CircleFinding("drift not checked", words, {}, grave=False))
    return tuple(found)


def _moved(before: str, after: str, motion: TrackerMotion) -> CircleFinding:
    shift, turn = float(np.linalg.norm(motion.shift_m)), float(np.linalg.norm(motion.turn_rad))
    doubt = float(np.sqrt(np.linalg.eigvalsh(motion.covariance[:3, :3])[-1]))
    turned = f" and turned by {degrees(turn)}" if motion.seen_turns else ""
    words = (
        f"between sweeps {before} and {after} the reference points shifted by {millimetres(shift)} "
        f"(± {millimetres(doubt)}){turned}, {motion.times_noise:.3g} times what noise makes: the tracker or its stand "
        "moved; measure the sweeps after it again, or carry them back by this motion"
    )
    figures = {"shift_m": shift, "turn_rad": turn, "times_noise": motion.times_noise, "chance": motion.chance}
    return CircleFinding("tracker moved", words, figures)
