"""How is the calibration of an arm from a tracker record kept? ``result.json``: metres and radians.

The arm itself goes into ``arm.yaml``, which every command reads; this file is the evidence for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sixthlink.calibrate import ArmEvidence
from sixthlink.calibrate.arm import optional_parameters
from sixthlink.calibrate.tracked_arm import JointSweep, PointErrors, ReflectorPlace, TrackedArm, TrackedAxis
from sixthlink.files.joint_section import arm_as_dict, evidence_as_dict
from sixthlink.files.result_object import write_object
from sixthlink.recording import TrackerRecord
from sixthlink.robot import Arm

__all__ = ["TRACKED_ARM_SCHEMA", "tracked_arm_as_dict", "write_tracked_arm"]

TRACKED_ARM_SCHEMA = "sixthlink-tracked-arm/1"


def write_tracked_arm(path: Path, result: TrackedArm, record: TrackerRecord) -> None:
    """Write a calibration; an older file stays whole until the new one is complete."""
    write_object(path, tracked_arm_as_dict(result, record))


def tracked_arm_as_dict(c: TrackedArm, record: TrackerRecord) -> dict[str, Any]:
    """The JSON object of a calibration.

    Args:
        c: The calibration.
        record: The record that it is of.
    """
    couplings = [_coupling(c.arm, p) for p in c.couplings]
    return {
        "schema": TRACKED_ARM_SCHEMA,
        "record": c.record,
        "instrument": c.instrument,
        "accepted": c.accepted,
        "axes": [_axis(a) for a in c.axes],
        "circles": [circle for sweep in c.sweeps for circle in _circles(sweep, record)],
        "coupling": couplings[0] if couplings else None,
        "couplings": couplings,
        "train": _errors(c.train),
        "heldout": _errors(c.heldout)
        | {"before_rms_m": c.heldout_before.rms_m, "before_max_m": c.heldout_before.max_m},
        "parameters": [asdict(p) for p in c.joint.arm],
        "findings": [
            {
                "where": f.where,
                "kind": f.finding.kind,
                "words": f.finding.words,
                "figures": dict(f.finding.figures),
                "grave": f.finding.grave,
            }
            for f in c.findings
        ],
        "reflectors": [_reflector(r) for r in c.reflectors],
        "T_base_tracker": c.T_base_tracker.tolist(),
        "arm": arm_as_dict(c.arm, c.joint),
        "nominal": arm_as_dict(c.nominal, None),
        "drawn": c.drawn,
        "rejected": [asdict(r) for r in c.rejections],
        **evidence_as_dict(c.joint),
        "gates": [asdict(g) for g in c.gates],
        "inputs": dict(c.inputs),
        "versions": dict(c.versions),
    }


def _axis(a: TrackedAxis) -> dict[str, Any]:
    fit = None if a.sweep is None else a.sweep.fit
    return {
        "joint": a.joint,
        "joints": a.stop.tolist(),
        "direction": a.axis.direction.tolist(),
        "point_m": a.axis.point_m.tolist(),
        "direction_std_rad": a.direction_std_rad,
        "position_std_m": a.position_std_m,
        "sweep": None if a.sweep is None else a.sweep.name,
        "circle_direction": None if fit is None else fit.axis.direction.tolist(),
        "circle_point_m": None if fit is None else fit.axis.point_m.tolist(),
        "circle_direction_std_rad": None if fit is None else fit.direction_uncertainty_rad,
        "circle_position_std_m": None if fit is None else fit.position_uncertainty_m,
    }


def _circles(sweep: JointSweep, record: TrackerRecord) -> Iterator[dict[str, Any]]:
    """One entry per circle of a sweep that shows any."""
    fit = sweep.fit
    if fit is None:
        return
    present = np.unique(record.reflector_of[sweep.rows]).tolist()
    for k, (index, circle) in enumerate(zip(present, fit.circles, strict=True)):
        mine = fit.reflectors == k
        radial_m, plane_m = _rms(fit.deviations_m[mine & fit.kept])
        yield {
            "sweep": sweep.name,
            "joint": sweep.joint + 1,
            "reflector": record.reflectors[index].name,
            "link": record.reflectors[index].link,
            "points": int(mine.sum()),
            "kept": int((mine & fit.kept).sum()),
            "centre_m": circle.centre_m.tolist(),
            "normal": circle.normal.tolist(),
            "radius_m": float(circle.radius_m),
            "arc_rad": float(fit.arcs_rad[k]),
            "radial_rms_m": radial_m,
            "plane_rms_m": plane_m,
            "noise_ratio": fit.noise_ratio,
            "implied": sweep.implied,
            "usable": sweep.usable,
        }


def _rms(deviations_m: np.ndarray[Any, np.dtype[np.float64]]) -> tuple[float, float]:
    radial, plane = np.sqrt(np.mean(deviations_m**2, axis=0)).tolist() if len(deviations_m) else (0.0, 0.0)
    return radial, plane


def _coupling(arm: Arm, p: ArmEvidence) -> dict[str, Any]:
    """Joint and driver by number, as an arm file counts them."""
    (parameter,) = (q for q in optional_parameters(arm, "coupling") if q.name == p.name)
    return {
        "joint": arm.own_steps.index(parameter.step) + 1,
        "driver": parameter.joint + 1,
        "factor": p.value,
        "std": p.std if p.free else None,
        "nominal": p.nominal,
        "free": p.free,
        "reason": p.reason,
    }


def _errors(errors: PointErrors) -> dict[str, Any]:
    return {
        "points": len(errors.distances_m),
        "rms_m": errors.rms_m,
        "max_m": errors.max_m,
        "rms_rad": errors.rms_rad,
    }


def _reflector(r: ReflectorPlace) -> dict[str, Any]:
    return {
        "name": r.name,
        "link": r.link,
        "place_m": r.place_m.tolist(),
        "std_m": [None if np.isinf(v) else v for v in r.std_m.tolist()],
        "unseen": r.unseen,
    }
