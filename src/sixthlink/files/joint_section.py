"""How does a result keep the proof of a joint estimate, so that it reads back bit for bit?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from sixthlink.calibrate import (
    ArmEvidence,
    BlockVerdict,
    Budget,
    Calibration,
    Correlation,
    JointEvidence,
    NoiseEvidence,
)
from sixthlink.robot import Arm

__all__ = ["arm_as_dict", "arm_from_dict", "evidence_as_dict", "joint_as_dict", "joint_from_dict"]

TAKEN_AS_EXACT = "taken as exact: the head alone was estimated"


def joint_as_dict(c: Calibration) -> dict[str, Any]:
    """Keys that a joint estimate adds to the result; none for the head alone."""
    joint = c.joint
    if joint is None:
        return {"chi2_per_dof": None, "budget": None, "joint": None}
    return evidence_as_dict(joint)


def evidence_as_dict(joint: JointEvidence) -> dict[str, Any]:
    """The proof of a joint estimate, without the arm's parameters, which stand with the arm."""
    return {
        "chi2_per_dof": joint.chi2_per_dof,
        "budget": None if joint.budget is None else asdict(joint.budget),
        "joint": {
            "dof": joint.dof,
            "noise": [asdict(n) for n in joint.noise],
            "blocks": [asdict(b) for b in joint.blocks],
            "correlations": [asdict(k) for k in joint.correlations],
            "placement_std": joint.placement_std.tolist(),
            "unknowns": list(joint.unknowns),
            "covariance": joint.covariance.tolist(),
        },
    }


def joint_from_dict(data: Mapping[str, Any]) -> JointEvidence | None:
    """The proof of a joint estimate, or None for the head alone."""
    joint = data.get("joint")
    if joint is None:
        return None
    return JointEvidence(
        unknowns=tuple(joint["unknowns"]),
        covariance=np.array(joint["covariance"]),
        arm=tuple(ArmEvidence(**p) for p in data["arm"]["parameters"]),
        blocks=tuple(BlockVerdict(**b) for b in joint["blocks"]),
        noise=tuple(NoiseEvidence(**n) for n in joint["noise"]),
        chi2_per_dof=data["chi2_per_dof"],
        dof=joint["dof"],
        correlations=tuple(Correlation(**k) for k in joint["correlations"]),
        placement_std=np.array(joint["placement_std"]).reshape(-1, 6),
        budget=None if data["budget"] is None else Budget(**data["budget"]),
    )


def arm_as_dict(arm: Arm, joint: JointEvidence | None) -> dict[str, Any]:
    """An arm with every step, and with what is known of each of its parameters."""
    if joint is None:
        units = ["rad" if turn else "m" for turn in arm.turns]
        named = zip(arm.parameters, units, arm.values.tolist(), strict=True)
        parameters = [
            asdict(ArmEvidence(name, unit, value, value, 0.0, free=False, reason=TAKEN_AS_EXACT))
            for name, unit, value in named
        ]
    else:
        parameters = [asdict(p) for p in joint.arm]
    return {
        "name": arm.name,
        "source": arm.source,
        "dialect": arm.dialect,
        "parameters": parameters,
        "steps": [
            {"kind": kind, "parameter": name, "value": value, "joints": row}
            for kind, name, value, row in zip(
                arm.kinds, arm.parameters, arm.values.tolist(), arm.joint_map.tolist(), strict=True
            )
        ],
        "joints": list(arm.joints),
        "limits": arm.limits.tolist(),
        "harmonics": arm.harmonics.tolist(),
        "compliance": arm.compliance.tolist(),
        "length_tolerance_m": arm.length_tolerance_m,
        "angle_tolerance_rad": arm.angle_tolerance_rad,
        "joint_repeatability_rad": arm.joint_repeatability_rad,
    }


def arm_from_dict(data: Mapping[str, Any]) -> Arm:
    """The inverse of :func:`arm_as_dict`."""
    steps = data["steps"]
    return Arm(
        name=data["name"],
        source=data["source"],
        dialect=data["dialect"],
        kinds=tuple(s["kind"] for s in steps),
        parameters=tuple(s["parameter"] for s in steps),
        values=np.array([s["value"] for s in steps]),
        joint_map=np.array([s["joints"] for s in steps]),
        joints=tuple(data["joints"]),
        limits=np.array(data["limits"]),
        length_tolerance_m=data["length_tolerance_m"],
        angle_tolerance_rad=data["angle_tolerance_rad"],
        joint_repeatability_rad=data["joint_repeatability_rad"],
        harmonics=np.array(data["harmonics"]),
        compliance=np.array(data["compliance"]),
    )
