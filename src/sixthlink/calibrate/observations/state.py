"""What is estimated together, and in which column of the Jacobian does it stand?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sixthlink.calibrate.arm import ArmParameter, arm_with_steps
from sixthlink.geometry import Floats, apply_motion, exp_rotation
from sixthlink.robot import Arm

__all__ = ["HEAD", "Columns", "JointState", "moved"]

HEAD = 6
"""Unknowns of the head: a motion (δp [m], δθ [rad]) in the axes of the frame that carries it."""


@dataclass(frozen=True)
class Columns:
    """Where each kind of shared unknown stands: the head first, then points on the links, lenses and arm.

    Attributes:
        head: Whether a head is estimated.
        tool: Whether a point on the flange is estimated.
        reflectors: Names of the reflectors whose place on their link is estimated.
        turned: Indices of those whose orientation on their link is estimated too.
        lens: Number of free unknowns of the cameras.
        arm: The arm's free parameters.
    """

    head: bool = True
    tool: bool = False
    reflectors: tuple[str, ...] = ()
    turned: tuple[int, ...] = ()
    lens: int = 0
    arm: tuple[ArmParameter, ...] = ()

    @property
    def head_slice(self) -> slice:
        """Columns of the head."""
        return slice(0, HEAD * self.head)

    @property
    def tool_slice(self) -> slice:
        """Columns of the tool's point."""
        start = self.head_slice.stop
        return slice(start, start + 3 * self.tool)

    @property
    def reflectors_slice(self) -> slice:
        """Columns of the reflectors, one after the other."""
        start = self.tool_slice.stop
        return slice(start, start + 3 * len(self.reflectors))

    @property
    def turned_slice(self) -> slice:
        """Columns of the reflectors' orientations, one after the other."""
        start = self.reflectors_slice.stop
        return slice(start, start + 3 * len(self.turned))

    @property
    def lens_slice(self) -> slice:
        """Columns of the cameras."""
        start = self.turned_slice.stop
        return slice(start, start + self.lens)

    @property
    def arm_slice(self) -> slice:
        """Columns of the arm."""
        start = self.lens_slice.stop
        return slice(start, start + len(self.arm))

    @property
    def size(self) -> int:
        """Number of shared unknowns."""
        return self.arm_slice.stop


@dataclass(frozen=True, eq=False)
class JointState:
    """Everything that is estimated, at one moment.

    Attributes:
        arm: The arm.
        X: ``(4, 4)`` the head, or None.
        tool_m: ``(3,)`` a point carried by the flange, in its frame [m], or None.
        lens_step: ``(g,)`` change of the cameras' free unknowns since they were linearised.
        arm_step: ``(A,)`` change of the arm's parameters since the nominal arm.
        Ts_stand_target: ``(P, 4, 4)`` target placements: in the base frame, or in the flange's for a fixed head.
        points_m: ``(B, m, 3)`` touched points, m to a place [m].
        marks_m: ``(B, m, 3)`` marks that the head saw, m to a place, in the frame in which they stand still [m].
        reflectors_m: ``(r, 3)`` reflectors in the frame of the link that carries each [m].
        Rs_link_reflector: ``(r, 3, 3)`` their orientations there; the identity where none was measured.
        Ts_base_instrument: ``(B, 4, 4)`` where an instrument stands, station by station.
    """

    arm: Arm
    X: Floats | None = None
    tool_m: Floats | None = None
    lens_step: Floats = field(default_factory=lambda: np.zeros(0))
    arm_step: Floats = field(default_factory=lambda: np.zeros(0))
    Ts_stand_target: Floats = field(default_factory=lambda: np.zeros((0, 4, 4)))
    points_m: Floats = field(default_factory=lambda: np.zeros((0, 1, 3)))
    marks_m: Floats = field(default_factory=lambda: np.zeros((0, 1, 3)))
    reflectors_m: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    Rs_link_reflector: Floats = field(default_factory=lambda: np.zeros((0, 3, 3)))
    Ts_base_instrument: Floats = field(default_factory=lambda: np.zeros((0, 4, 4)))


def moved(state: JointState, columns: Columns, shared: Floats, own: Sequence[tuple[str, Floats]]) -> JointState:
    """The state after a shared step ``(G,)`` and the own steps of the named blocks."""
    changes: dict[str, object] = {
        "arm": arm_with_steps(state.arm, columns.arm, shared[columns.arm_slice]),
        "arm_step": state.arm_step + shared[columns.arm_slice],
        "lens_step": state.lens_step + shared[columns.lens_slice],
        "reflectors_m": state.reflectors_m + shared[columns.reflectors_slice].reshape(-1, 3),
    }
    if columns.turned:
        Rs = state.Rs_link_reflector.copy()
        turns = shared[columns.turned_slice].reshape(-1, 3)
        Rs[list(columns.turned)] = exp_rotation(turns) @ Rs[list(columns.turned)]
        changes["Rs_link_reflector"] = Rs
    if state.X is not None:
        changes["X"] = apply_motion(state.X, shared[columns.head_slice])
    if state.tool_m is not None:
        changes["tool_m"] = state.tool_m + shared[columns.tool_slice]
    for name, steps in own:
        if name == "placements":
            changes["Ts_stand_target"] = apply_motion(state.Ts_stand_target, steps)
        elif name == "points":
            changes["points_m"] = state.points_m + steps.reshape(state.points_m.shape)
        elif name == "marks":
            changes["marks_m"] = state.marks_m + steps.reshape(state.marks_m.shape)
        elif name == "instruments":
            changes["Ts_base_instrument"] = apply_motion(state.Ts_base_instrument, steps)
    return replace(state, **changes)  # type: ignore[arg-type]
