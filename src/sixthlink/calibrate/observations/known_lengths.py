"""A certified length between two marks, each seen from its own pose: what does it say about scale?

The length that head and arm measure, minus the certificate's. A mark seen in several shots counts with its mean.
The same derivative says how well any length is measured, so that verification uses it too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from sixthlink.calibrate.arm import arm_motions
from sixthlink.calibrate.observations.linearised import Linearised
from sixthlink.calibrate.observations.state import Columns, JointState
from sixthlink.calibrate.observations.target_poses import carried
from sixthlink.geometry import Floats, Ints, inverse, transform_points

__all__ = ["KnownLengths", "carried_points"]


@dataclass(frozen=True, eq=False)
class KnownLengths:
    """M sightings of marks that make R lengths.

    Attributes:
        joints: ``(M, J)`` joint values of each sighting [rad or m].
        points_head: ``(M, 3)`` mark in the head frame [m].
        covariances: ``(M, 3, 3)`` of those points, from the pixels [m²].
        lengths: ``(M,)`` number of the length that the sighting belongs to, 0 to R - 1.
        ends: ``(M,)`` 0 for the first mark, 1 for the second.
        length_m: Certified length [m].
        uncertainty_m: Its standard uncertainty [m].
        repeatability_rad: ``(J,)`` standard deviation of every joint that counts as scale 1 [rad or m].
        by_lens: ``(M, 3, g)`` motion of the points per unit of the cameras' free unknowns.
        fixed_head: Whether the head stands still and the standard rides on the flange.
    """

    joints: Floats
    points_head: Floats
    covariances: Floats
    lengths: Ints
    ends: Ints
    length_m: float
    uncertainty_m: float
    repeatability_rad: Floats
    by_lens: Floats = field(default_factory=lambda: np.zeros((0, 3, 0)))
    fixed_head: bool = False
    block: str = ""

    def linearised(self, state: JointState, columns: Columns) -> Linearised:
        """Residuals ``(R, 1)`` [m], and derivatives."""
        assert state.X is not None  # noqa: S101 - marks are only seen by a head
        points, by_shared, by_joint, R_head = carried_points(self, state, columns)
        R = int(self.lengths.max()) + 1
        counts = np.zeros((R, 2))
        np.add.at(counts, (self.lengths, self.ends), 1.0)
        share = np.where(self.ends == 1, 1.0, -1.0) / counts[self.lengths, self.ends]
        between = np.zeros((R, 3))
        np.add.at(between, self.lengths, share[:, None] * points)
        measured = np.linalg.norm(between, axis=1)
        along = (between / measured[:, None])[self.lengths] * share[:, None]
        shared = np.zeros((R, columns.size))
        np.add.at(shared, self.lengths, np.einsum("mi,mig->mg", along, by_shared))
        joints, pixels = np.zeros(R), np.zeros(R)
        by_joint = np.einsum("mi,mij->mj", along, by_joint) * self.repeatability_rad
        np.add.at(joints, self.lengths, np.sum(by_joint**2, axis=1))
        in_head = np.einsum("mi,mij->mj", along, R_head)
        np.add.at(pixels, self.lengths, np.einsum("mi,mij,mj->m", in_head, self.covariances, in_head))
        noises = {"joints": joints, "pixels": pixels, "standard": np.full(R, self.uncertainty_m**2)}
        return Linearised(
            (measured - self.length_m)[:, None],
            shared[:, None],
            np.zeros((R, 1, 0)),
            np.arange(R),
            {name: values[:, None, None] for name, values in noises.items()},
        )


class Seen(Protocol):
    """Points that the head saw, with what their position depends on."""

    @property
    def joints(self) -> Floats:
        """``(M, J)`` joint values [rad or m]."""

    @property
    def points_head(self) -> Floats:
        """``(M, 3)`` points in the head frame [m]."""

    @property
    def by_lens(self) -> Floats:
        """``(M, 3, g)`` motion of the points per unit of the cameras' free unknowns."""

    @property
    def fixed_head(self) -> bool:
        """Whether the head stands still and the points ride on the flange."""


def carried_points(seen: Seen, state: JointState, columns: Columns) -> tuple[Floats, Floats, Floats, Floats]:
    """Points carried by head and arm into the frame in which they stand still.

    Returns:
        ``(M, 3)`` points [m], their derivatives ``(M, 3, G)`` by the shared unknowns and ``(M, 3, J)`` by the joints,
        and ``(M, 3, 3)`` the head's axes in that frame.
    """
    assert state.X is not None  # noqa: S101
    Ts_base_flange, by_arm, by_joint = arm_motions(state.arm, seen.joints, columns.arm)
    M = len(seen.joints)
    by_shared = np.zeros((M, 3, columns.size))
    points_head = seen.points_head + seen.by_lens @ state.lens_step if columns.lens else seen.points_head
    points_carrier = transform_points(state.X, points_head)
    by_head = np.concatenate(
        [np.tile(np.eye(3), (M, 1, 1)), carried(points_carrier - state.X[:3, 3])[:, :3, 3:]], axis=2
    )
    if seen.fixed_head:
        Ts_flange_base = inverse(Ts_base_flange)
        points = transform_points(Ts_flange_base, points_carrier)
        turn = Ts_flange_base[:, :3, :3]
        by_motion = -turn @ carried(points_carrier - Ts_base_flange[:, :3, 3])[:, :3]
    else:
        points = transform_points(Ts_base_flange, points_carrier)
        turn = Ts_base_flange[:, :3, :3]
        by_motion = carried(points - Ts_base_flange[:, :3, 3])[:, :3]
    by_shared[:, :, columns.head_slice] = turn @ by_head
    by_shared[:, :, columns.arm_slice] = by_motion @ by_arm
    R_head = turn @ state.X[:3, :3]
    if columns.lens:
        by_shared[:, :, columns.lens_slice] = R_head @ seen.by_lens
    return points, by_shared, by_motion @ by_joint, R_head
