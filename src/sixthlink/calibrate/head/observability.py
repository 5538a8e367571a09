"""Which directions of the head did the motion make visible, and which not?

The factor's Jacobian by the head's six motions says how much the shots' target poses move against each other per
unit of each motion. Its singular values, as root mean squares over pairs of shots, are excitations: the sine of the
turn by which the robot has made a direction visible. What lies below the limit is named, not estimated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.head.factor import Objective
from sixthlink.geometry import Floats, hat

__all__ = ["MINIMUM_EXCITATION", "MINIMUM_SHARE", "Observability", "head_jacobian", "observability"]

MINIMUM_EXCITATION = 0.035
"""Excitation below which a direction counts as unseen: about a turn of 2° between the shots."""

MINIMUM_SHARE = 0.03
"""Share of the largest excitation below which a direction counts as unseen: axes parallel within about 2°."""


@dataclass(frozen=True, eq=False)
class Observability:
    """What a recording can say about the head.

    Attributes:
        excitations: ``(6,)`` singular values, largest first [-].
        directions: ``(6, 6)`` one row per singular value: motion (position, turn) of the head in the frame that
            carries it; a turn counts with the recording's own lever.
        unseen: ``(6,)`` whether a direction is below the limits.
        words: One sentence per unseen direction, or per pair or triple of them that belong together.
    """

    excitations: Floats
    directions: Floats
    unseen: np.ndarray[tuple[int], np.dtype[np.bool_]]
    words: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether the whole head can be seen."""
        return not self.unseen.any()


def observability(objective: Objective, rotation: Floats, *, carrier: str) -> Observability:
    """Directions of the head that eq. (11) can see near a rotation ``(3, 3)``.

    Args:
        objective: Eq. (11).
        rotation: Rotation of the head at the answer.
        carrier: Name of the frame that carries the head, for the words: ``flange`` or ``base``.
    """
    J = head_jacobian(objective, rotation) / np.sqrt(objective.pairs)
    lever_m = max(float(np.sqrt(np.mean(np.sum(J[:, 3:] ** 2, axis=0)))), 1e-12)
    # Where nothing turned, a turn of the head has no lever of its own to be measured by: one metre then.
    scale = np.array([1.0, 1.0, 1.0, *[1.0 / max(lever_m, 1.0)] * 3])
    values, directions = np.linalg.svd(J * scale, full_matrices=False)[1:]
    unseen = (values < MINIMUM_EXCITATION) | (values < MINIMUM_SHARE * values[0])
    return Observability(values, directions * scale, unseen, _words(directions[unseen], carrier))


def head_jacobian(objective: Objective, rotation: Floats) -> Floats:
    """Derivative ``(13, 6)`` of U θ by the head's motion (δt [m], turn about the carrier's axes [rad])."""
    turns = (hat(np.eye(3)) @ rotation).reshape(3, 9).T
    return np.column_stack([objective.factor[:, :3], objective.factor[:, 3:12] @ turns])


def _words(null_directions: Floats, carrier: str) -> tuple[str, ...]:
    """Unseen directions in words: the position's first, then the orientation's, then what is left mixed."""
    if len(null_directions) == 0:
        return ()
    positions = _pure(null_directions, slice(0, 3))
    turns = _pure(null_directions, slice(3, 6))
    words = []
    if len(positions) == 3:
        words.append(f"the head's position in the {carrier} frame, all three directions: the robot hardly turned")
    elif len(positions) == 2:
        words.append(f"the head's position in the plane across {_axis(np.cross(*positions))} of the {carrier}")
    elif len(positions) == 1:
        words.append(f"the head's position along the common axis {_axis(positions[0])} of the {carrier}")
    if len(turns) == 3:
        words.append(f"the head's orientation in the {carrier} frame, all three angles: the robot hardly moved")
    else:
        words += [f"the head's orientation about {_axis(turn)} of the {carrier}" for turn in turns]
    mixed = len(null_directions) - len(positions) - len(turns)
    if mixed > 0:
        words.append(f"{mixed} combinations of the head's position and orientation in the {carrier} frame")
    return tuple(words)


def _pure(null_directions: Floats, part: slice) -> Floats:
    """Orthonormal directions ``(k, 3)`` of pure position or pure turn inside the unseen space."""
    # A unit vector e of the part lies in the unseen space where its projection onto that space keeps its length.
    values, vectors = np.linalg.eigh(null_directions[:, part].T @ null_directions[:, part])
    return vectors.T[values > 0.9]


def _axis(direction: Floats) -> str:
    unit = direction / np.linalg.norm(direction)
    unit = unit * (np.sign(unit[np.argmax(np.abs(unit))]) or 1.0)
    return "(" + ", ".join(f"{v + 0.0:.2f}" for v in unit) + ")"
