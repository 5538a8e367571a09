"""What is a robot arm, and where does its flange stand?

Every dialect (DH, modified DH, Hayati, URDF) is the same thing underneath: a product of elementary turns and
shifts along the axes of the moving frame. Step k turns or shifts by ``values[k] + joint_map[k] @ joints``; a
coupled joint is simply a row of ``joint_map`` with two entries. One rule then gives the derivative for every
parameter of every dialect: a turn moves the flange by a × (p_flange - p), a shift moves it along a.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np
import numpy.typing as npt

from sixthlink.geometry import Floats, frozen_floats, inverse
from sixthlink.robot.joint_errors import HARMONICS, harmonic_values, lever_values

__all__ = [
    "Arm",
    "arm_with_values",
    "flange_jacobian",
    "flange_poses",
    "gravity_levers",
    "joint_jacobian",
    "last_link",
    "link5_poses",
    "link_poses",
    "true_joints",
]

_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm as a product of elementary steps, base to flange.

    Attributes:
        name: Name of the robot.
        source: Where its numbers come from.
        dialect: ``dh``, ``mdh`` or ``steps``: how the arm is written in a file.
        kinds: ``rx ry rz`` (turns) or ``tx ty tz`` (shifts), one per step, K in all.
        parameters: Name of each step's value, for example ``alpha2`` or ``d4``; unique.
        values: ``(K,)`` constant part of each step [rad or m].
        joint_map: ``(K, J)`` part that follows the joints: step = values + joint_map @ joints.
        joints: Names of the J joints.
        limits: ``(J, 2)`` range of each joint [rad, or m for a sliding joint].
        length_tolerance_m: Standard deviation that the maker's lengths deserve [m]; 0 when not stated.
        angle_tolerance_rad: The same for the angles [rad]; 0 when not stated.
        joint_repeatability_rad: Standard deviation of a joint's return to a position [rad]; 0 when unknown.
        harmonics: ``(J, 4)`` amplitudes of each joint's error once and twice per turn, in the order of ``HARMONICS``
            [rad]; none by default.
        compliance: ``(J,)`` how far each joint yields per metre of the load's lever [rad/m]; none by default.
    """

    name: str
    source: str
    dialect: str
    kinds: tuple[str, ...]
    parameters: tuple[str, ...]
    values: Floats
    joint_map: Floats
    joints: tuple[str, ...]
    limits: Floats
    length_tolerance_m: float = 0.0
    angle_tolerance_rad: float = 0.0
    joint_repeatability_rad: float = 0.0
    harmonics: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    compliance: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        K, J = len(self.kinds), len(self.joints)
        unknown = [k for k in self.kinds if len(k) != 2 or k[0] not in "rt" or k[1] not in _AXES]
        if unknown:
            raise ValueError(f"arm {self.name}: unknown kinds of step {unknown}, expected rx ry rz tx ty tz")
        if len(self.parameters) != K or len(set(self.parameters)) != K:
            raise ValueError(f"arm {self.name}: needs {K} parameter names, all different")
        object.__setattr__(self, "values", frozen_floats(self.values, (K,), "values"))
        object.__setattr__(self, "joint_map", frozen_floats(self.joint_map, (K, J), "joint_map"))
        object.__setattr__(self, "limits", frozen_floats(self.limits, (J, 2), "limits"))
        harmonics = self.harmonics if np.size(self.harmonics) else np.zeros((J, len(HARMONICS)))
        object.__setattr__(self, "harmonics", frozen_floats(harmonics, (J, len(HARMONICS)), "harmonics"))
        compliance = self.compliance if np.size(self.compliance) else np.zeros(J)
        object.__setattr__(self, "compliance", frozen_floats(compliance, (J,), "compliance"))
        idle = [name for j, name in enumerate(self.joints) if not self.joint_map[:, j].any()]
        if idle:
            raise ValueError(f"arm {self.name}: joints {idle} move nothing")
        if (self.limits[:, 0] >= self.limits[:, 1]).any():
            raise ValueError(f"arm {self.name}: a joint's lower limit is not below its upper limit")

    @property
    def turns(self) -> npt.NDArray[np.bool_]:
        """``(K,)`` whether a step is a turn (its value in radians) rather than a shift (in metres)."""
        return np.array([kind[0] == "r" for kind in self.kinds])

    @property
    def last_joint_step(self) -> int:
        """Index of the step that the last joint drives; the steps before it end in frame link5."""
        return int(np.flatnonzero(self.joint_map[:, -1])[-1])

    @property
    def own_steps(self) -> tuple[int, ...]:
        """Index of the step that each joint drives itself: the first, before any that it drives by a coupling."""
        return tuple(int(np.flatnonzero(column)[0]) for column in self.joint_map.T)

    @property
    def link_ends(self) -> tuple[int, ...]:
        """Number of steps from the base to link 1, 2, ..., J: link k is what joint k carries, the last the flange."""
        return (*self.own_steps[1:], len(self.kinds))


def arm_with_values(arm: Arm, values: npt.ArrayLike, *, source: str | None = None) -> Arm:
    """The same arm with other constant step values ``(K,)`` [rad or m]."""
    return replace(arm, values=np.asarray(values), source=arm.source if source is None else source)


def flange_poses(arm: Arm, joints: npt.ArrayLike) -> Floats:
    """Forward kinematics (eq. 1): where the flange stands.

    Args:
        arm: The arm.
        joints: ``(N, J)`` joint values [rad or m].

    Returns:
        ``(N, 4, 4)`` poses ``T_base_flange``.
    """
    q = true_joints(arm, joints)
    T = np.tile(np.eye(4), (len(q), 1, 1))
    for kind, value in _moves(arm, q):
        _advance(T, kind, value)
    return T


def true_joints(arm: Arm, joints: npt.ArrayLike) -> Floats:
    """Where the joints stand ``(N, J)`` when the controller reports ``joints`` ``(N, J)`` [rad or m]."""
    q = _checked_joints(arm, joints)
    if not (arm.harmonics.any() or arm.compliance.any()):
        return q
    yielded = gravity_levers(arm, q) * arm.compliance if arm.compliance.any() else 0.0
    return q + np.einsum("njh,jh->nj", harmonic_values(q), arm.harmonics) + yielded


def gravity_levers(arm: Arm, joints: npt.ArrayLike) -> Floats:
    """Levers ``(N, J)`` of a load at the flange about every joint [m]; base z points up."""
    q = _checked_joints(arm, joints)
    own = list(arm.own_steps)
    axes, origins, T = _step_axes(arm, q, len(arm.kinds))
    return lever_values(np.swapaxes(axes[own], 0, 1), np.swapaxes(origins[own], 0, 1), T[:, :3, 3])


def link5_poses(arm: Arm, joints: npt.ArrayLike) -> Floats:
    """Poses of the link that carries the last joint, turned by it: T_base_link5(q) · Rz(q6) of eq. (10).

    Its z axis is the last joint's axis, so that a head calibrated against it is the arm's last link, whatever
    dialect the arm is written in.

    Args:
        arm: The arm.
        joints: ``(N, J)`` joint values [rad or m].

    Returns:
        ``(N, 4, 4)`` poses.
    """
    return flange_poses(arm, joints) @ inverse(last_link(arm))


def last_link(arm: Arm) -> Floats:
    """``T_link5_flange`` ``(4, 4)`` with the last joint at zero: what the head replaces as the sixth link."""
    steps = range(arm.last_joint_step, len(arm.kinds))
    T = np.eye(4)[None]
    for k in steps:
        _advance(T, arm.kinds[k], arm.values[k : k + 1])
    last: Floats = T[0]
    return last


def link_poses(arm: Arm, joints: npt.ArrayLike, link: int) -> Floats:
    """Poses ``T_base_link`` ``(N, 4, 4)`` of a link, each ending where the next joint's own step begins.

    Args:
        arm: The arm.
        joints: ``(N, J)`` joint values [rad or m].
        link: Number of the link: 0 is what stands before the first joint, the last is the flange.
    """
    q = true_joints(arm, joints)
    T = np.tile(np.eye(4), (len(q), 1, 1))
    for kind, value in islice(_moves(arm, q), (arm.own_steps[0], *arm.link_ends)[link]):
        _advance(T, kind, value)
    return T


def flange_jacobian(arm: Arm, joints: npt.ArrayLike, *, link: int | None = None) -> tuple[Floats, Floats]:
    """Flange poses, or those of another link, and how every step's value moves them.

    Args:
        arm: The arm.
        joints: ``(N, J)`` joint values [rad or m].
        link: Number of the link from 1; the flange by default.

    Returns:
        ``(N, 4, 4)`` poses ``T_base_flange`` and ``(N, 6, K)`` motions (δp [m], δθ [rad]) in base axes per
        unit of each step's value.
    """
    steps = arm.link_ends[-1 if link is None else link - 1]
    axes, origins, T = _step_axes(arm, true_joints(arm, joints), steps)
    turns = arm.turns
    turns[steps:] = False
    J = np.zeros((*axes.shape[:2], 6))
    J[turns, :, :3] = np.cross(axes[turns], T[None, :, :3, 3] - origins[turns])
    J[turns, :, 3:] = axes[turns]
    J[~turns, :, :3] = axes[~turns]  # zeros behind the link
    return T, np.ascontiguousarray(J.transpose(1, 2, 0))


def joint_jacobian(arm: Arm, joints: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Flange poses ``(N, 4, 4)`` and the motions ``(N, 6, J)`` per unit of each joint, in base axes."""
    poses, per_step = flange_jacobian(arm, joints)
    return poses, per_step @ arm.joint_map


def _step_axes(arm: Arm, q: Floats, steps: int) -> tuple[Floats, Floats, Floats]:
    """Axis and origin ``(K, N, 3)`` of the first steps in the base frame, zero for the rest, and where they end."""
    K, N = len(arm.kinds), len(q)
    axes, origins = np.zeros((K, N, 3)), np.zeros((K, N, 3))
    T = np.tile(np.eye(4), (N, 1, 1))
    for k, (kind, value) in enumerate(islice(_moves(arm, q), steps)):
        axes[k], origins[k] = T[:, :3, _AXES[kind[1]]], T[:, :3, 3]
        _advance(T, kind, value)
    return axes, origins, T


def _moves(arm: Arm, q: Floats) -> Iterator[tuple[str, Floats]]:
    return zip(arm.kinds, arm.values[:, None] + arm.joint_map @ q.T, strict=True)


def _checked_joints(arm: Arm, joints: npt.ArrayLike) -> Floats:
    q = np.asarray(joints, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != len(arm.joints):
        raise ValueError(f"joints have shape {q.shape}, expected (N, {len(arm.joints)}) for {arm.name}")
    return q


def _advance(T: Floats, kind: str, value: Floats) -> None:
    """Multiply ``(N, 4, 4)`` poses in place by one step of ``(N,)`` values; only moved columns change."""
    axis = _AXES[kind[1]]
    if kind[0] == "t":
        T[:, :3, 3] += T[:, :3, axis] * value[:, None]
        return
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s = np.cos(value)[:, None], np.sin(value)[:, None]
    u, v = T[:, :3, i].copy(), T[:, :3, j].copy()
    T[:, :3, i] = c * u + s * v
    T[:, :3, j] = c * v - s * u
