"""Which numbers of an arm can a calibration change, and how does each move the flange?

Every parameter adds to one elementary step, or to one joint, a multiple of a known function of the joints: 1 for a DH
length or angle, a joint's value for its scale or for a coupling, a sine for a periodic error, the load's lever for a
joint that yields. So one rule gives every derivative: that of the step or joint, times the function.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sixthlink.geometry import Floats
from sixthlink.robot import HARMONICS, Arm, flange_jacobian, gravity_levers, harmonic_values, true_joints

__all__ = [
    "BLOCKS",
    "ArmParameter",
    "arm_motions",
    "arm_with_steps",
    "link_parameters",
    "optional_parameters",
    "parameter_values",
]

UNSTATED_LENGTH_M, UNSTATED_ANGLE_RAD = 2e-3, np.deg2rad(0.2)
"""Prior standard deviations of an arm whose file states no tolerances."""

SCALE_SIGMA, HARMONIC_SIGMA_RAD, COMPLIANCE_SIGMA_RAD_M = 1e-3, 5e-4, 1e-3
"""Prior standard deviations of scales and couplings [-], of periodic errors and of yielding joints."""

BLOCKS = ("coupling", "scale", "harmonics", "compliance")
"""Parameters that a maker's sheet takes as exact; they enter where held-out shots ask for them."""


@dataclass(frozen=True)
class ArmParameter:
    """One number of an arm.

    Attributes:
        name: For example ``alpha2``, ``scale_q3``, ``coupling_q3_q2`` or ``sin2_q4``.
        unit: ``m``, ``rad``, ``-`` or ``rad/m``.
        kind: ``link``, or one of ``BLOCKS``.
        step: Index of the elementary step that it changes; -1 where it changes a joint.
        joint: Index of the joint that it changes or whose value it multiplies; -1 for a constant.
        sigma: Prior standard deviation about the nominal value, in its unit.
        harmonic: Index in ``HARMONICS`` of a periodic error; -1 otherwise.
    """

    name: str
    unit: str
    kind: str
    step: int
    joint: int
    sigma: float
    harmonic: int = -1


def link_parameters(arm: Arm) -> tuple[ArmParameter, ...]:
    """Every constant of the arm; a fixed flange behind the last link belongs to the head and is left out."""
    length_m = arm.length_tolerance_m or UNSTATED_LENGTH_M
    angle_rad = arm.angle_tolerance_rad or UNSTATED_ANGLE_RAD
    return tuple(
        ArmParameter(name, "rad" if turn else "m", "link", k, -1, angle_rad if turn else length_m)
        for k, (name, turn) in enumerate(zip(arm.parameters, arm.turns, strict=True))
        if not name.startswith("flange_")
    )


def optional_parameters(arm: Arm, block: str) -> tuple[ArmParameter, ...]:
    """The parameters of one of ``BLOCKS``.

    Raises:
        KeyError: There is no such block.
    """
    turning = [j for j, step in enumerate(arm.own_steps) if arm.turns[step]]
    return {
        "coupling": lambda: _couplings(arm),
        "scale": lambda: tuple(
            ArmParameter(f"scale_{name}", "-", "scale", arm.own_steps[j], j, SCALE_SIGMA)
            for j, name in enumerate(arm.joints)
        ),
        "harmonics": lambda: tuple(
            ArmParameter(f"{wave}_{arm.joints[j]}", "rad", "harmonics", -1, j, HARMONIC_SIGMA_RAD, h)
            for j in turning
            for h, wave in enumerate(HARMONICS)
        ),
        "compliance": lambda: tuple(
            ArmParameter(f"compliance_{arm.joints[j]}", "rad/m", "compliance", -1, j, COMPLIANCE_SIGMA_RAD_M)
            for j in turning
        ),
    }[block]()


def parameter_values(arm: Arm, parameters: Sequence[ArmParameter]) -> Floats:
    """Value ``(A,)`` of each parameter in this arm [its unit]."""
    return np.array([_value(arm, p) for p in parameters])


def arm_with_steps(arm: Arm, parameters: Sequence[ArmParameter], steps: Floats) -> Arm:
    """The arm with ``(A,)`` added to its parameters."""
    values, joint_map = arm.values.copy(), arm.joint_map.copy()
    harmonics, compliance = arm.harmonics.copy(), arm.compliance.copy()
    for p, step in zip(parameters, steps, strict=True):
        if p.kind == "harmonics":
            harmonics[p.joint, p.harmonic] += step
        elif p.kind == "compliance":
            compliance[p.joint] += step
        elif p.kind == "link":
            values[p.step] += step
        else:
            joint_map[p.step, p.joint] += step
    return replace(arm, values=values, joint_map=joint_map, harmonics=harmonics, compliance=compliance)


def arm_motions(
    arm: Arm, joints: Floats, parameters: Sequence[ArmParameter], *, link: int | None = None
) -> tuple[Floats, Floats, Floats]:
    """Flange poses, or those of another link, and how parameters and joints move them.

    Args:
        arm: The arm.
        joints: ``(N, J)`` joint values that the controller reports [rad or m].
        parameters: A parameters.
        link: Number of the link from 1; the flange by default.

    Returns:
        ``(N, 4, 4)`` poses ``T_base_flange``; motions (δp [m], δθ [rad]) in base axes: ``(N, 6, A)`` per unit of each
        parameter and ``(N, 6, J)`` per unit of each joint.
    """
    poses, per_step = flange_jacobian(arm, joints, link=link)
    per_joint: Floats = per_step @ arm.joint_map
    by_parameter = np.empty((len(joints), 6, len(parameters)))
    kinds = {p.kind for p in parameters}
    waves = harmonic_values(joints) if "harmonics" in kinds else None
    levers = gravity_levers(arm, joints) if "compliance" in kinds else None
    turned = true_joints(arm, joints) if kinds & {"scale", "coupling"} else joints
    for a, p in enumerate(parameters):
        if waves is not None and p.kind == "harmonics":
            by_parameter[:, :, a] = per_joint[:, :, p.joint] * waves[:, None, p.joint, p.harmonic]
        elif levers is not None and p.kind == "compliance":
            by_parameter[:, :, a] = per_joint[:, :, p.joint] * levers[:, None, p.joint]
        elif p.kind == "link":
            by_parameter[:, :, a] = per_step[:, :, p.step]
        else:
            by_parameter[:, :, a] = per_step[:, :, p.step] * turned[:, None, p.joint]
    return poses, by_parameter, per_joint


def _value(arm: Arm, p: ArmParameter) -> float:
    if p.kind == "harmonics":
        return float(arm.harmonics[p.joint, p.harmonic])
    if p.kind == "compliance":
        return float(arm.compliance[p.joint])
    return float(arm.values[p.step] if p.kind == "link" else arm.joint_map[p.step, p.joint])


def _couplings(arm: Arm) -> tuple[ArmParameter, ...]:
    found: list[ArmParameter] = []
    for k in range(len(arm.kinds)):
        drivers = np.flatnonzero(arm.joint_map[k])
        if len(drivers) < 2:
            continue
        # The step's own joint moves nothing else; a driver also moves its own step.
        own = int(drivers[np.argmin(np.count_nonzero(arm.joint_map[:, drivers], axis=0))])
        found += [
            ArmParameter(f"coupling_{arm.joints[own]}_{arm.joints[j]}", "-", "coupling", k, j, SCALE_SIGMA)
            for j in drivers[drivers != own].tolist()
        ]
    return tuple(found)
