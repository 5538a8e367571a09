"""How is the calibration of an arm from touches kept, so that it reads back bit for bit?

``result.json`` as for a head (``result_file``), with the keys that apply; beside them the touches, from which a later
reading of a gauge begins.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sixthlink.calibrate import Gate
from sixthlink.calibrate.touches import ArmCalibration, FixedPoint, HeldOutTouches, TouchEvidence
from sixthlink.files.joint_section import arm_as_dict, arm_from_dict, evidence_as_dict, joint_from_dict
from sixthlink.files.result_object import made_from, result_object, write_object
from sixthlink.recording import Rejection
from sixthlink.target import LengthStandard

__all__ = ["ARM_RESULT_SCHEMA", "arm_result_as_dict", "arm_result_from_dict", "read_arm_result", "write_arm_result"]

ARM_RESULT_SCHEMA = "sixthlink-arm-result/1"


def write_arm_result(path: Path, calibration: ArmCalibration) -> None:
    """Write a calibration; an older file stays whole until the new one is complete."""
    write_object(path, arm_result_as_dict(calibration))


def read_arm_result(path: Path) -> ArmCalibration:
    """Read a calibration back.

    Raises:
        InputError: The file is missing, too large, not JSON, of another schema or incomplete.
    """
    return made_from(path, result_object(path, ARM_RESULT_SCHEMA), arm_result_from_dict)


def arm_result_as_dict(calibration: ArmCalibration) -> dict[str, Any]:
    """The JSON object of a calibration: metres and radians."""
    c = calibration
    return {
        "schema": ARM_RESULT_SCHEMA,
        "recording": c.recording,
        "solver": "joint",
        "accepted": c.accepted,
        "arm": arm_as_dict(c.arm, c.joint),
        "nominal": arm_as_dict(c.nominal, None),
        "tool_m": c.tool_m.tolist(),
        "standard": None if c.standard is None else asdict(c.standard),
        "points": [asdict(p) for p in c.points],
        "residuals": {"rms_before_m": c.rms_before_m, "rms_translation_m": c.rms_after_m},
        "touches": [
            {
                "shot": t.shot,
                "placement": t.placement,
                "mark": t.mark,
                "before_m": t.before_m,
                "after_m": t.after_m,
                "joints": t.joints.tolist(),
            }
            for t in c.touches
        ],
        "smoothness_rad": c.smoothness_rad,
        "rejected": [asdict(r) for r in c.rejections],
        **evidence_as_dict(c.joint),
        "heldout": None if c.heldout is None else asdict(c.heldout),
        "gates": [asdict(g) for g in c.gates],
        "inputs": dict(c.inputs),
        "versions": dict(c.versions),
    }


def arm_result_from_dict(data: Mapping[str, Any]) -> ArmCalibration:
    """A calibration from its JSON object: the inverse of :func:`arm_result_as_dict`.

    Raises:
        KeyError, TypeError, ValueError: Something is missing or of the wrong shape.
    """
    joint, standard = joint_from_dict(data), data["standard"]
    if joint is None:
        raise ValueError("joint")
    return ArmCalibration(
        recording=data["recording"],
        arm=arm_from_dict(data["arm"]),
        nominal=arm_from_dict(data["nominal"]),
        tool_m=np.array(data["tool_m"]),
        standard=None if standard is None else LengthStandard(**(standard | {"marks": tuple(standard["marks"])})),
        points=tuple(FixedPoint(p["placement"], p["mark"], tuple(p["position_m"])) for p in data["points"]),
        touches=tuple(TouchEvidence(**(t | {"joints": np.array(t["joints"])})) for t in data["touches"]),
        smoothness_rad=data["smoothness_rad"],
        joint=joint,
        rejections=tuple(Rejection(**r) for r in data["rejected"]),
        gates=tuple(Gate(**g) for g in data["gates"]),
        heldout=None if data["heldout"] is None else HeldOutTouches(**data["heldout"]),
        inputs=dict(data["inputs"]),
        versions=dict(data["versions"]),
    )
