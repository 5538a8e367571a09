"""How is the rest of the head solved when some of it cannot be seen?

What is unseen is held: the position's component along an unseen direction at zero, an unseen turn at the smallest
that agrees with what is seen of the orientation. Eq. (11) with these held is again one small matrix, so that swarms,
polish and certificate need not know. Held values are conventions; none is ever reported.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sixthlink.calibrate.head.factor import Objective
from sixthlink.geometry import Floats, exp_rotation, frozen_floats, transform

__all__ = ["Held", "held_objective", "held_turns"]

HOLD = 0.035
"""Strength by which an unseen turn is held, beside what shows the turns: that of a turn which is just seen."""


@dataclass(frozen=True, eq=False)
class Held:
    """Motions of the head that are not solved for, in the frame that carries it.

    Attributes:
        positions: ``(k, 3)`` orthonormal directions along which the position is held.
        turns: ``(m, 3)`` axes about which the orientation is held, m = 0, 1 or 3.
        rotation: ``(3, 3)`` the orientation at which those turns are held.
        offset_m: ``(3,)`` position whose components along ``positions`` are kept [m].
    """

    positions: Floats
    turns: Floats
    rotation: Floats
    offset_m: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        shapes = {"positions": (None, 3), "turns": (None, 3), "rotation": (3, 3), "offset_m": (3,)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen_floats(getattr(self, name), shape, name))

    def head(self, X: Floats) -> Floats:
        """A head ``(4, 4)`` with its position's unseen components at their held values."""
        unseen = self.positions.T @ self.positions
        return transform(X[:3, :3], X[:3, 3] + unseen @ (self.offset_m - X[:3, 3]))

    def seen_from(self, T_outer_carrier: Floats) -> Held:
        """The same for a head that is solved for in another frame, ``T_outer_carrier`` ``(4, 4)`` @ X."""
        R, t = T_outer_carrier[:3, :3], T_outer_carrier[:3, 3]
        return Held(self.positions @ R.T, self.turns @ R.T, R @ self.rotation, R @ self.offset_m + t)


def held_turns(rotation: Floats, turns: Floats) -> Floats:
    """Orientation ``(3, 3)`` with unseen turns ``(m, 3)`` undone: the smallest that keeps what is seen."""
    if len(turns) == 0:
        return rotation
    if len(turns) == 3:
        return np.eye(3)
    seen, wanted = rotation.T @ turns[0], turns[0]
    across = np.cross(seen, wanted)
    if np.linalg.norm(across) < 1e-12:
        across = np.cross(np.eye(3)[np.argmin(np.abs(wanted))], wanted) if seen @ wanted < 0.0 else np.zeros(3)
    angle = np.arctan2(np.linalg.norm(np.cross(seen, wanted)), seen @ wanted)
    return exp_rotation(across / max(float(np.linalg.norm(across)), 1e-300) * angle)


def held_objective(objective: Objective, held: Held) -> Objective:
    """Eq. (11) that no longer asks for what is held.

    Its value does not change along the held positions, so that :meth:`Held.head` may set them after any solver.
    """
    across = np.linalg.svd(held.positions, full_matrices=True)[2][len(held.positions) :]
    U = objective.factor
    fixed = U[:, :3] @ (held.positions.T @ (held.positions @ held.offset_m))
    columns = np.column_stack([U[:, :3] @ across.T, U[:, 3:12], U[:, 12] + fixed])
    turning = _turning_rows(U, held, len(across))
    rows = np.concatenate([columns, turning, np.zeros((13, columns.shape[1]))])
    R: Floats = np.asarray(np.linalg.qr(rows, mode="r"))
    factor, k = np.zeros((13, 13)), len(across)
    factor[:k, :3], factor[:k, 3:], factor[3:, 3:] = R[:k, :k] @ across, R[:k, k:], R[k : k + 10, k:]
    return Objective(factor, objective.rotation_length_m, objective.pairs)


def _turning_rows(U: Floats, held: Held, position_columns: int) -> Floats:
    """Rows on (position, vec R, 1) that keep directions across each held axis where they are."""
    strength = HOLD * float(np.linalg.norm(U[:, 3:12])) / 3.0
    rows = []
    for axis in held.turns:
        kept = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        kept = kept / np.linalg.norm(kept)
        in_head = held.rotation.T @ kept
        block = np.zeros((3, position_columns + 10))
        block[:, position_columns:-1] = np.kron(np.eye(3), in_head)
        block[:, -1] = -kept
        rows.append(strength * block)
    return np.concatenate([np.zeros((0, position_columns + 10)), *rows])
