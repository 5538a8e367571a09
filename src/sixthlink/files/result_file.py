"""How is a calibration kept, so that it reads back bit for bit?

``result.json``: one JSON object in metres, radians and pixels. Numbers are written with all their digits. The same
object, with the list of written files added, is what ``sixthlink calibrate --json`` prints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from sixthlink.calibrate import (
    BoardEvidence,
    Calibration,
    CameraEvidence,
    Certificate,
    Gate,
    HeldOut,
    SearchBox,
    SearchReport,
    ShotEvidence,
    head_link_of,
    paper_numbers_of,
)
from sixthlink.camera import Camera, CameraRig
from sixthlink.files.joint_section import arm_as_dict, arm_from_dict, joint_as_dict, joint_from_dict
from sixthlink.files.result_object import made_from, result_fault, result_object, write_object
from sixthlink.files.unobserved import (
    filled,
    head_matrix,
    head_numbers,
    held_head,
    motions_as_dict,
    target_matrices,
    unobserved_from_dict,
)
from sixthlink.recording import EYE_IN_HAND, Rejection
from sixthlink.solvers import SwarmBudget

__all__ = ["RESULT_SCHEMA", "read_result", "result_as_dict", "result_from_dict", "write_result"]

RESULT_SCHEMA = "sixthlink-result/1"
_CERTIFICATE_KEYS = {"value_m2": "value", "bound_m2": "bound"}


def write_result(path: Path, calibration: Calibration) -> None:
    """Write a calibration; an older file stays whole until the new one is complete."""
    write_object(path, result_as_dict(calibration))


def read_result(path: Path) -> Calibration:
    """Read a calibration back.

    Raises:
        InputError: The file is missing, too large, not JSON, of another schema or incomplete.
    """
    data = result_object(path, RESULT_SCHEMA)
    if data.get("unobserved_motions") and np.array(data["unobserved_motions"]["motions"])[:, 3:].any():
        what = "the calibration has not observed " + "; ".join(data["unobserved"])
        expected = "an orientation of the head, without which nothing is measured"
        cure = "record shots that turn the flange about two axes, and calibrate again"
        raise result_fault(path, "unobserved", what, expected, cure)
    return made_from(path, data, result_from_dict)


def result_as_dict(calibration: Calibration) -> dict[str, Any]:
    """The JSON object of a calibration: metres, radians, pixels; matrices row by row."""
    c = calibration
    in_hand = c.mount == EYE_IN_HAND
    scatter = c.scatter
    return {
        "schema": RESULT_SCHEMA,
        "recording": c.recording,
        "mount": c.mount,
        "solver": c.solver,
        "accepted": c.accepted,
        "head": {
            "camera": c.rig.reference if c.rig else None,
            "T_flange_camera": head_matrix(c, lambda of: of.X) if in_hand else None,
            "T_base_camera": None if in_hand else head_matrix(c, lambda of: of.X),
            "T_link5_camera": head_matrix(c, lambda of: of.T_link5_head),
            "paper": head_numbers(c, paper_numbers_of),
            "dh": head_numbers(c, head_link_of),
            "std": _or_none(c.joint, lambda joint: dict(joint.head_std)),
        },
        "unobserved": list(c.unobserved.words) if c.unobserved else [],
        "unobserved_motions": _or_none(c.unobserved, lambda found: motions_as_dict(c, found)),
        "objective": {
            "value": c.value_m2,
            "unit": "m²",
            "rotation_length_m": c.rotation_length_m,
            "pairs": c.pairs,
        },
        "certificate": {_CERTIFICATE_KEYS.get(k, k): v for k, v in asdict(c.certificate).items()},
        "search": _or_none(c.search, _search_as_dict),
        "residuals": {
            "rms_translation_m": scatter.rms_translation_m,
            "rms_rotation_rad": scatter.rms_rotation_rad,
            "max_translation_m": float(scatter.translations_m.max()),
            "max_rotation_rad": float(scatter.rotations_rad.max()),
        },
        "placements": [
            {"name": name, "T_base_target" if in_hand else "T_flange_target": T}
            for name, T in zip(c.placements, target_matrices(c), strict=True)
        ],
        "shots": [asdict(s) for s in c.shots],
        "rejected": [asdict(r) for r in c.rejections],
        "cameras": _cameras_as_list(c),
        "stereo_rms_px": c.stereo_rms_px,
        "target": {"print_sigma_m": c.print_sigma_m, **asdict(c.board)},
        "tracker_points": c.tracker_points,
        "arm": _or_none(c.arm, lambda arm: arm_as_dict(arm, c.joint)),
        **joint_as_dict(c),
        "heldout": _or_none(c.heldout, asdict),
        "scale_shots": list(c.scale_shots),
        "notes": list(c.notes),
        "gates": [asdict(g) for g in c.gates],
        "inputs": dict(c.inputs),
        "versions": dict(c.versions),
    }


def result_from_dict(data: Mapping[str, Any]) -> Calibration:
    """A calibration from its JSON object: the inverse of :func:`result_as_dict`.

    Raises:
        KeyError, TypeError, ValueError: Something is missing or of the wrong shape.
    """
    in_hand = data["mount"] == EYE_IN_HAND
    targets = [p["T_base_target" if in_hand else "T_flange_target"] for p in data["placements"]]
    return Calibration(
        recording=data["recording"],
        mount=data["mount"],
        solver=data["solver"],
        X=held_head(data, "T_flange_camera" if in_hand else "T_base_camera"),
        arm=_or_none(data["arm"], arm_from_dict),
        rig=_rig_from_list(data["cameras"]),
        cameras=tuple(CameraEvidence(**entry["evidence"]) for entry in data["cameras"]),
        stereo_rms_px=data["stereo_rms_px"],
        print_sigma_m=data["target"]["print_sigma_m"],
        board=BoardEvidence(**{k: v for k, v in data["target"].items() if k != "print_sigma_m"}),
        tracker_points=data.get("tracker_points", 0),
        placements=tuple(p["name"] for p in data["placements"]),
        Ts_base_target=filled(targets),
        value_m2=data["objective"]["value"],
        rotation_length_m=data["objective"]["rotation_length_m"],
        pairs=data["objective"]["pairs"],
        search=_or_none(data["search"], _search_from_dict),
        certificate=_certificate_from_dict(data["certificate"]),
        shots=tuple(ShotEvidence(**s) for s in data["shots"]),
        rejections=tuple(Rejection(**r) for r in data["rejected"]),
        gates=tuple(Gate(**g) for g in data["gates"]),
        inputs=dict(data["inputs"]),
        versions=dict(data["versions"]),
        unobserved=unobserved_from_dict(data, targets),
        joint=joint_from_dict(data),
        heldout=_or_none(data["heldout"], lambda found: HeldOut(**found)),
        scale_shots=tuple(data["scale_shots"]),
        notes=tuple(data.get("notes", ())),
    )


def _search_as_dict(search: SearchReport) -> dict[str, Any]:
    return {
        "variant": search.variant,
        "seed": search.seed,
        "swarms": search.budget.swarms,
        "particles": search.budget.particles,
        "iterations": search.budget.iterations,
        "box_half_width_m": search.box.half_width_m,
        "best_unpolished": search.best_unpolished_m2,
        "value": search.value_m2,
        "agreeing": search.agreeing,
    }


def _certificate_from_dict(data: Mapping[str, Any]) -> Certificate:
    names = {key: name for name, key in _CERTIFICATE_KEYS.items()}
    return Certificate(**{names.get(key, key): value for key, value in data.items()})


def _search_from_dict(data: Mapping[str, Any]) -> SearchReport:
    return SearchReport(
        variant=data["variant"],
        seed=data["seed"],
        budget=SwarmBudget(data["swarms"], data["particles"], data["iterations"]),
        box=SearchBox(data["box_half_width_m"]),
        best_unpolished_m2=data["best_unpolished"],
        value_m2=data["value"],
        agreeing=data["agreeing"],
    )


def _cameras_as_list(calibration: Calibration) -> list[dict[str, Any]]:
    rig = calibration.rig
    if rig is None:
        return []
    return [
        {
            "name": name,
            "image_size_px": [camera.width_px, camera.height_px],
            "focal_px": camera.focal_px.tolist(),
            "centre_px": camera.centre_px.tolist(),
            "model": camera.model,
            "distortion": list(camera.written_distortion),
            "T_camera_head": T.tolist(),
            "evidence": {
                "calibrated": e.calibrated,
                "images": e.images,
                "rms_px": e.rms_px,
                "std": e.std.tolist(),
            },
        }
        for name, camera, T, e in zip(rig.names, rig.cameras, rig.Ts_camera_head, calibration.cameras, strict=True)
    ]


def _rig_from_list(entries: list[Mapping[str, Any]]) -> CameraRig | None:
    if not entries:
        return None
    cameras = tuple(
        Camera(
            width_px=entry["image_size_px"][0],
            height_px=entry["image_size_px"][1],
            focal_px=entry["focal_px"],
            centre_px=entry["centre_px"],
            distortion=entry["distortion"],
            model=entry["model"],
        )
        for entry in entries
    )
    return CameraRig(
        tuple(entry["name"] for entry in entries),
        cameras,
        np.array([entry["T_camera_head"] for entry in entries]),
    )


def _or_none(value: Any, convert: Callable[[Any], Any]) -> Any:
    return None if value is None else convert(value)
