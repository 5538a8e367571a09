"""What is wrong with a shot that does not belong?

Each explanation is tried on it: a target read from its other end, two shots exchanged, the pose of a shot nearby (a
late or early robot pose), the same robot pose twice, a pose between two shots. An explanation is named when it brings
the shot close to what the others say; otherwise the reason says by how much the shot is off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint import Estimate
from sixthlink.calibrate.turns import turn_transforms
from sixthlink.calibrate.usable import Usable
from sixthlink.geometry import Floats, inverse, motion_between, rotation_angle
from sixthlink.recording import Recording, Rejection
from sixthlink.units import DEG, MM

__all__ = ["wrong_shots"]

CLOSE = 8.0
"""How many times the RMS of the good shots an explained shot may be off."""

ABOUT_HALF_A_TURN_RAD = 0.2
"""An error this near to half a turn looks like a target read from its other end."""

SAME_POSE = np.array([2e-3, 2e-3])
"""Distance [m] and angle [rad] within which two robot poses are the same one."""

SHARE = 0.2
"""An explanation must leave less than this share of the error."""


def wrong_shots(recording: Recording, problem: HeadProblem, usable: Usable, found: Estimate) -> tuple[Rejection, ...]:
    """A rejection with its reason for every shot that the estimate left out.

    Args:
        recording: The recording.
        problem: Its usable shots under the calibrated arm.
        usable: The same shots with their names.
        found: The estimate.
    """
    kept = found.kept[0]
    bad = np.flatnonzero(~kept)
    if len(bad) == 0:
        return ()
    assert found.fit.state.X is not None  # noqa: S101 - shots have a head
    X, Ts_stand_target = found.fit.state.X, found.fit.state.Ts_stand_target[problem.placements]
    Ts_expected = inverse(problem.Ts_outer @ X) @ Ts_stand_target
    errors = _errors(Ts_expected, problem.Ts_inner)
    scale = np.sqrt(np.mean(errors[kept] ** 2, axis=0))
    target = recording.target
    renamed = turn_transforms(target.points_m, target.turn)[1:] if target is not None else np.zeros((0, 4, 4))
    names = [recording.ids[s] for s in usable.shots]
    shots = _Shots(names, problem, Ts_expected, errors, scale, renamed)
    return tuple(Rejection(names[i], "", _reason(i, shots)) for i in bad.tolist())


@dataclass(frozen=True, eq=False)
class _Shots:
    names: Sequence[str]
    problem: HeadProblem
    Ts_expected: Floats
    errors: Floats
    scale: Floats
    renamed: Floats


def _reason(i: int, shots: _Shots) -> str:
    names, problem, Ts_expected, scale = shots.names, shots.problem, shots.Ts_expected, shots.scale
    error = shots.errors[i]
    off = f"{error[0] / MM:.3g} mm and {error[1] / DEG:.3g}° off what the other shots say"

    def explains(observed: Floats, expected: Floats) -> bool:
        left = _errors(expected[None], observed[None])[0]
        return bool((left < np.maximum(CLOSE * scale, 1e-12)).all() and (left < SHARE * error + scale).all())

    here = problem.Ts_inner[i]
    if any(explains(here @ T, Ts_expected[i]) for T in shots.renamed):
        return f"{off}: the target was read from another end; use a target that tells its ends apart"
    mates = np.flatnonzero(problem.placements == problem.placements[i])
    for j in mates[mates != i].tolist():
        if not explains(here, Ts_expected[j]):
            continue
        if explains(problem.Ts_inner[j], Ts_expected[i]):
            return f"{off}: exchanged with shot {names[j]}; check which image belongs to which robot pose"
        order = "late" if j < i else "early"
        return f"{off}: shows what shot {names[j]} should show; the robot pose was recorded {order}, or paired wrongly"
    for j in (i - 1, i + 1):
        if not 0 <= j < len(names):
            continue
        if (_errors(problem.Ts_outer[j : j + 1], problem.Ts_outer[i : i + 1])[0] < SAME_POSE).all():
            when = "before the robot had moved" if j < i else "after the robot had moved on"
            return f"{off}: its robot pose is that of shot {names[j]}; it was read {when}, or written twice"
        if _between(here, Ts_expected[i], Ts_expected[j], scale, error):
            when = "was still moving from" if j < i else "was already moving to"
            return f"{off}: seen on the way; the robot {when} shot {names[j]}. Let it stand still before the image"
    if abs(error[1] - np.pi) < ABOUT_HALF_A_TURN_RAD:
        return f"{off}: turned by half a turn; the target was probably read from its other end"
    return f"{off}; look at its image and its robot pose"


def _between(here: Floats, expected: Floats, other: Floats, scale: Floats, error: Floats) -> bool:
    """Whether a pose lies on the way from where it should be to where another shot is."""
    way, done = motion_between(expected, other), motion_between(expected, here)
    weigh = 1.0 / np.repeat(np.maximum(scale, 1e-12), 3)
    share = float((way * weigh) @ (done * weigh)) / max(float((way * weigh) @ (way * weigh)), 1e-300)
    left = done - share * way
    sizes = np.array([np.linalg.norm(left[:3]), np.linalg.norm(left[3:])])
    return 0.02 < share < 0.98 and bool((sizes < CLOSE * scale).all() and (sizes < SHARE * error + scale).all())


def _errors(Ts_expected: Floats, Ts_observed: Floats) -> Floats:
    """Distance [m] and angle [rad] ``(N, 2)`` between poses."""
    off = inverse(Ts_expected) @ Ts_observed
    return np.column_stack([np.linalg.norm(off[:, :3, 3], axis=1), rotation_angle(off[:, :3, :3])])
