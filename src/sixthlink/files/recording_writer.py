"""How does a recording become a folder that a person can open, and that reads back as the same recording?

Files are written in millimetres and degrees, with all the digits that a number has. Images are named, not
written.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sixthlink.camera import PINHOLE, Camera
from sixthlink.errors import Finding, InputError
from sixthlink.files.atomic import atomic_write_text
from sixthlink.files.pixels_table import pixels_text
from sixthlink.files.shot_positions import joint_units, looks_like_other_unit
from sixthlink.files.yaml_marks import yaml_text
from sixthlink.geometry import ORIENTATIONS, Floats, values_from_rotations
from sixthlink.recording import EYE_IN_HAND, CameraDescription, Recording
from sixthlink.target import SOCKET, TARGET_KINDS, LengthStandard, Target
from sixthlink.units import DEG, MM

__all__ = ["write_recording"]

_ORIENTATION = "quaternion-wxyz"
_FIELDS = ORIENTATIONS[_ORIENTATION].fields


def write_recording(
    folder: Path, recording: Recording, *, robot: Mapping[str, object], overwrite: bool = False
) -> None:
    """Write ``recording.yaml``, ``shots.csv`` and, when pixels were recorded, ``pixels.csv``.

    Args:
        folder: The folder; it is created when missing.
        recording: The recording. Where it has pixels or target poses these are its observations, otherwise
            images.
        robot: Who the robot is, as recording.yaml says it, for example ``{"name": "abb_irb1400"}`` or
            ``{"kinematics": "none", "label": "Denso VS-6577"}``.
        overwrite: Whether an existing recording may be replaced.

    Raises:
        InputError: The folder has a recording already.
        OSError: The folder cannot be written.
    """
    path = folder / "recording.yaml"
    taken = [p for p in (path, folder / "shots.csv", folder / "pixels.csv") if p.exists()]
    if taken and not overwrite:
        cure = "choose another folder, or ask for overwriting"
        raise InputError([Finding(str(p), "file", "exists already", "a new folder", cure) for p in taken])
    folder.mkdir(parents=True, exist_ok=True)
    atomic_write_text(folder / "shots.csv", _shots_text(recording))
    if recording.pixels is not None:
        atomic_write_text(folder / "pixels.csv", pixels_text(recording, recording.pixels))
    atomic_write_text(path, yaml_text(_sections(recording, robot)))  # last: a folder without it is no recording


def _sections(recording: Recording, robot: Mapping[str, object]) -> dict[str, Any]:
    sections: dict[str, Any] = {
        "schema": "sixthlink-recording/1",
        "name": recording.name,
        "units": {"length": "mm", "angle": "deg"},
        "mount": recording.mount,
        "robot": {**robot, **_conventions(recording)},
        "head": _head(recording),
        "target": _target(recording.target),
        "length_standard": _standard(recording.standard),
        "observations": _observations(recording),
    }
    if recording.touched:
        sections = {key: section for key, section in sections.items() if key not in {"mount", "head", "target"}}
    if recording.Ts_head_target is not None:
        sections["target_poses"] = {"orientation": _ORIENTATION, "direction": "T_head_target"}
    return sections


def _observations(recording: Recording) -> str:
    if recording.pixels is not None:
        return "pixels"
    if recording.touched:
        return "touches"
    return "images" if recording.Ts_head_target is None else "target-poses"


def _conventions(recording: Recording) -> dict[str, object]:
    if recording.joints is None:
        return {"positions": "flange-poses", "orientation": _ORIENTATION, "direction": "T_base_flange"}
    written: dict[str, object] = {"positions": "joints"}
    if recording.arm and looks_like_other_unit(recording.arm, _written_joints(recording), "deg"):
        written["positions_confirmed"] = True
    return written


def _head(recording: Recording) -> dict[str, Any]:
    cameras = recording.head.cameras
    head: dict[str, Any] = {"cameras": "none"}
    if cameras:
        head = {
            "reference": cameras[0].name,
            "cameras": {c.name: _camera(c, c is cameras[0]) for c in cameras},
        }
    if recording.head.nominal is not None:
        name = "T_flange_head" if recording.mount == EYE_IN_HAND else "T_base_head"
        head["nominal"] = {name: _matrix(recording.head.nominal)}
    return head


def _camera(camera: CameraDescription, is_reference: bool) -> dict[str, Any]:
    given = camera.camera
    written: dict[str, Any] = {
        "image_size_px": [camera.width_px, camera.height_px],
        "intrinsics": "calibrate" if given is None else _intrinsics(given),
    }
    if not is_reference:
        pose = camera.T_camera_head
        written["pose"] = "calibrate" if pose is None else {"T_camera_head": _matrix(pose)}
    return written


def _intrinsics(camera: Camera) -> dict[str, Any]:
    return {
        **({"model": camera.model} if camera.model != PINHOLE else {}),
        "focal_px": camera.focal_px.tolist(),
        "centre_px": camera.centre_px.tolist(),
        "distortion": list(camera.written_distortion),
    }


def _matrix(T: Floats) -> list[list[float]]:
    scaled = np.array(T)
    scaled[:3, 3] /= MM
    rows: list[list[float]] = scaled.tolist()
    return rows


def _target(target: Target | None) -> object:
    if target is None:
        return "none"
    kind = next(k for k, class_ in TARGET_KINDS.items() if class_ is type(target))
    written: dict[str, object] = {"kind": kind}
    for f in (f for f in fields(TARGET_KINDS[kind]) if f.init):
        value = getattr(target, f.name)
        written[f.name.removesuffix("_m")] = float(value / MM) if f.name.endswith("_m") else value
    return written


def _standard(standard: LengthStandard | None) -> object:
    if standard is None:
        return "none"
    diameter = {} if standard.mark == SOCKET else {"mark_diameter": float(standard.mark_diameter_m / MM)}
    return {
        "length": float(standard.length_m / MM),
        "uncertainty": float(standard.uncertainty_m / MM),
        "mark": standard.mark,
        **diameter,
        "marks": list(standard.marks),
    }


def _shots_text(recording: Recording) -> str:
    columns: dict[str, Any] = {
        "shot": recording.ids,
        "placement": recording.placements,
        "kind": recording.kinds,
        "mark": recording.marks,
    }
    if recording.joints is not None:
        columns |= {f"q{j}": values for j, values in enumerate(_written_joints(recording).T.tolist(), start=1)}
    elif recording.Ts_base_flange is not None:
        columns |= _pose_columns("", recording.Ts_base_flange)
    observations = _observations(recording)
    if observations == "images":
        blank = ("",) * len(recording.ids)
        columns |= {f"image_{c.name}": recording.images.get(c.name, blank) for c in recording.head.cameras}
    elif observations == "target-poses" and recording.Ts_head_target is not None:
        columns |= _pose_columns("target_", recording.Ts_head_target)
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()


def _written_joints(recording: Recording) -> Floats:
    if recording.joints is None or recording.arm is None:
        raise ValueError("a recording without joints has none to write")
    written: Floats = recording.joints / joint_units(recording.arm, MM, DEG)
    return written


def _pose_columns(prefix: str, poses: Floats) -> dict[str, list[float]]:
    turns = values_from_rotations(ORIENTATIONS[_ORIENTATION], poses[:, :3, :3])
    table = np.concatenate([poses[:, :3, 3] / MM, turns], axis=1)
    names = [f"{prefix}{name}" for name in ("x", "y", "z", *_FIELDS)]
    return dict(zip(names, table.T.tolist(), strict=True))
