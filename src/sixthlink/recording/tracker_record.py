"""What did the laser tracker measure while the arm moved?

One flat table of points in the tracker's frame: which sweep each belongs to, which reflector it is of, and where the
joints stood if that was recorded. Points of reflectors that stand on the ground are kept apart: they say whether the
tracker itself moved.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, Ints, frozen_floats, frozen_ints
from sixthlink.robot import Arm

__all__ = ["GROUND", "ReferencePoints", "Reflector", "Sweep", "TrackerRecord", "points_of_sweep"]

Bools = npt.NDArray[np.bool_]

GROUND = 0
"""Link of a reflector that stands still: it shows whether the tracker drifts."""

ROTATION_TOLERANCE = 1e-9
"""Largest entry of RᵀR - I; whoever makes the record has put the rotations on the group."""


@dataclass(frozen=True)
class Reflector:
    """A reflector and where it sits.

    Attributes:
        name: Its name.
        link: Number of the link that carries it: link k is moved by joint k counted from 1, the last link is the
            flange, ``GROUND`` (0) stands still.
    """

    name: str
    link: int


@dataclass(frozen=True)
class Sweep:
    """Points that belong together because of how the arm moved.

    Attributes:
        name: Its name.
        joint: Index of the only joint that moved, from 0; None for free measurements at many joint positions.
    """

    name: str
    joint: int | None


@dataclass(frozen=True, eq=False)
class ReferencePoints:
    """K measurements of reflectors on the ground.

    Attributes:
        reflectors: ``(K,)`` index of the reflector in the record.
        points: ``(K, 3)`` where it was measured [m], in the tracker's frame.
        after: ``(K,)`` how many of the record's points had been measured before, in increasing order.
        covariances: ``(K, 3, 3)`` covariance of each point [m²], or None when the record does not say.
        times_s: ``(K,)`` time of the measurement [s] on the record's clock, or None.
    """

    reflectors: Ints
    points: Floats
    after: Ints
    covariances: Floats | None = None
    times_s: Floats | None = None

    def __post_init__(self) -> None:
        K = len(self.points)
        object.__setattr__(self, "reflectors", frozen_ints(self.reflectors, (K,), "reference reflectors"))
        object.__setattr__(self, "points", frozen_floats(self.points, (K, 3), "reference points"))
        object.__setattr__(self, "after", frozen_ints(self.after, (K,), "after"))
        if (np.diff(self.after) < 0).any():
            raise ValueError("reference points must be in the order in which they were measured")
        if self.covariances is not None:
            _freeze(self, "covariances", (K, 3, 3))
            _check_covariances(self.covariances)
        if self.times_s is not None:
            _freeze(self, "times_s", (K,))

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True, eq=False)
class TrackerRecord:
    """M points of J joints' sweeps and of free measurements, in the order in which they were measured.

    Attributes:
        name: Name for people.
        instrument: Name of the instrument for people.
        robot: Name of the robot for people.
        arm: Its kinematics as far as known beforehand, or None.
        sweeps: What moved; every point belongs to one of them.
        reflectors: What was measured; every point is of one of them.
        points: ``(M, 3)`` position of the reflector [m] in the tracker's frame.
        names: Name of each point, as the instrument wrote it; may be empty or repeated.
        sweep_of: ``(M,)`` index of the sweep.
        reflector_of: ``(M,)`` index of the reflector; never one on the ground.
        joints: ``(M, J)`` joint values [rad or m]; 0 where they were not recorded.
        joints_known: ``(M, J)`` whether the value was recorded.
        covariances: ``(M, 3, 3)`` covariance of each point [m²], or None when the record does not say.
        rotations: ``(M, 3, 3)`` orientation of the reflector (a 6-D probe) in the tracker's frame, the identity where
            it was not measured; None when it never was.
        oriented: ``(M,)`` whether the orientation was measured.
        rotation_sigma_rad: Standard deviation of each component of a measured orientation [rad], or None.
        times_s: ``(M,)`` time of each measurement [s], or None.
        references: Reflectors on the ground, or None when none was measured.
        inputs: SHA-256 per input file, by name within the record.
    """

    name: str
    instrument: str
    robot: str
    arm: Arm | None
    sweeps: tuple[Sweep, ...]
    reflectors: tuple[Reflector, ...]
    points: Floats
    names: tuple[str, ...]
    sweep_of: Ints
    reflector_of: Ints
    joints: Floats
    joints_known: Bools
    covariances: Floats | None = None
    rotations: Floats | None = None
    oriented: Bools | None = None
    rotation_sigma_rad: float | None = None
    times_s: Floats | None = None
    references: ReferencePoints | None = None
    inputs: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        M, J = len(self.points), np.shape(self.joints)[-1]
        if self.arm is not None and len(self.arm.joints) != J:
            raise ValueError(f"joints has {J} columns, but {self.arm.name} has {len(self.arm.joints)} joints")
        if len(self.names) != M:
            raise ValueError(f"names: {len(self.names)} entries for {M} points")
        places = [*(s.name for s in self.sweeps), *(r.name for r in self.reflectors)]
        if any(name != name.strip() or "\n" in name or "\r" in name for name in (*self.names, *places)):
            raise ValueError("names must be of one line, without blanks around them")
        if not all(places):
            raise ValueError("sweeps and reflectors must have names")
        _freeze(self, "points", (M, 3))
        _freeze(self, "joints", (M, J))
        for name, count in (("sweep_of", len(self.sweeps)), ("reflector_of", len(self.reflectors))):
            indices = frozen_ints(getattr(self, name), (M,), name)
            if M and not (indices.min() >= 0 and indices.max() < count):
                raise ValueError(f"{name} must be from 0 to {count - 1}")
            object.__setattr__(self, name, indices)
        _freeze_mask(self, "joints_known", (M, J), everywhere=False)
        if self.joints[~self.joints_known].any():
            raise ValueError("joints that were not recorded must be 0")
        _freeze_mask(self, "oriented", (M,), everywhere=self.rotations is not None)
        if self.rotations is not None:
            _freeze(self, "rotations", (M, 3, 3))
            _check_rotations(self.rotations)
        if self.covariances is not None:
            _freeze(self, "covariances", (M, 3, 3))
            _check_covariances(self.covariances)
        if self.rotation_sigma_rad is not None and self.rotation_sigma_rad <= 0:
            raise ValueError("rotation_sigma_rad must be above 0")
        if self.times_s is not None:
            _freeze(self, "times_s", (M,))
        _check_places(self, J)

    def __len__(self) -> int:
        return len(self.points)


def points_of_sweep(record: TrackerRecord, sweep: str, reflector: str | None = None) -> Ints:
    """Indices ``(N,)`` of the points of one sweep, and of one reflector where that is given, in measured order."""
    mask = record.sweep_of == [s.name for s in record.sweeps].index(sweep)
    if reflector is not None:
        mask &= record.reflector_of == [r.name for r in record.reflectors].index(reflector)
    return np.flatnonzero(mask)


def _freeze(record: TrackerRecord | ReferencePoints, name: str, shape: tuple[int, ...]) -> None:
    object.__setattr__(record, name, frozen_floats(getattr(record, name), shape, name))


def _freeze_mask(record: TrackerRecord, name: str, shape: tuple[int, ...], *, everywhere: bool) -> None:
    given = getattr(record, name)
    mask = np.full(shape, everywhere) if given is None else np.array(given, dtype=np.bool_)
    if mask.shape != shape:
        raise ValueError(f"{name} has shape {mask.shape}, expected {shape}")
    mask.flags.writeable = False
    object.__setattr__(record, name, mask)


def _check_rotations(rotations: Floats) -> None:
    miss = np.abs(rotations.swapaxes(1, 2) @ rotations - np.eye(3)).max(initial=0.0)
    if miss > ROTATION_TOLERANCE or (np.linalg.det(rotations) < 0).any():
        raise ValueError(f"rotations are not rotations: they miss orthonormality by {miss:.3g}, or are mirrored")


def _check_covariances(covariances: Floats) -> None:
    if not np.allclose(covariances, covariances.swapaxes(1, 2), rtol=1e-9, atol=0.0):
        raise ValueError("covariances must be symmetric")
    if len(covariances) and np.linalg.eigvalsh(covariances).min() <= 0:
        raise ValueError("covariances must be positive definite")


def _check_places(record: TrackerRecord, J: int) -> None:
    """Names are unique, links and joints exist, and what was measured moved with the joint."""
    for what, names in (("sweep", [s.name for s in record.sweeps]), ("reflector", [r.name for r in record.reflectors])):
        if len(set(names)) != len(names):
            raise ValueError(f"{what} names must all be different")
    joints = np.array([-1 if s.joint is None else s.joint for s in record.sweeps], dtype=np.int64)
    links = np.array([r.link for r in record.reflectors], dtype=np.int64)
    if (joints >= J).any() or (joints < -1).any() or (links > J).any() or (links < GROUND).any():
        raise ValueError(f"joints of sweeps must be from 0 to {J - 1}, links of reflectors from 0 to {J}")
    if len(record) and (links[record.reflector_of] <= np.maximum(joints[record.sweep_of], 0)).any():
        raise ValueError("a point's reflector must sit on a link that the joint of its sweep moves")
    if record.references is not None:
        if (links[record.references.reflectors] != GROUND).any():
            raise ValueError("reference points must be of reflectors on the ground")
        for name in ("times_s", "covariances"):
            if (getattr(record, name) is None) != (getattr(record.references, name) is None):
                raise ValueError(f"{name}: either all measurements have them or none")
        if len(record.references) and not 0 <= record.references.after[0] <= record.references.after[-1] <= len(record):
            raise ValueError(f"after must be from 0 to {len(record)}, the number of points")
