"""Which cameras make the head, and what is already known of them?"""

from __future__ import annotations

import numpy as np

from sixthlink.camera import FISHEYE, FISHEYE_TERMS, Camera
from sixthlink.files.recording_schema import (
    TARGET_POSES,
    CameraSection,
    HeadSection,
    IntrinsicsSection,
    PoseSection,
)
from sixthlink.files.schema_findings import did_you_mean
from sixthlink.files.sections import Sections, add_finding
from sixthlink.files.yaml_marks import Keys
from sixthlink.geometry import Floats, checked_transforms
from sixthlink.recording import EYE_IN_HAND, CameraDescription, Head

__all__ = ["head_of"]


def head_of(sections: Sections, length_m: float | None) -> Head | None:
    """The head of a recording, or None while it cannot be told; findings go to ``sections``.

    Args:
        sections: The judged sections.
        length_m: Metres per unit of length, None when the file does not say.
    """
    section: HeadSection | None = sections.valid.get("head")
    if section is None:
        return None
    before = len(sections.findings)
    observations = sections.valid.get("observations")
    if isinstance(section.cameras, str):
        if observations is not None and observations != TARGET_POSES:
            cure = "describe the cameras, or record target poses"
            add_finding(
                sections,
                ("head", "cameras"),
                "has no cameras",
                f"cameras for observations: {observations}",
                cure,
            )
        if section.reference is not None:
            add_finding(sections, ("head", "reference"), "is given without cameras", "", "remove it", at_key=True)
        names: list[str] = []
    else:
        if observations == TARGET_POSES:
            expected, cure = "cameras: none for observations: target-poses", "remove the cameras"
            add_finding(sections, ("head", "cameras"), "has cameras", expected, cure, at_key=True)
        names = _ordered_names(sections, section.reference, section.cameras)
    cameras = [_camera(sections, name, section, length_m) for name in names]
    nominal = _nominal(sections, section, length_m)
    if len(sections.findings) > before:
        return None
    return Head(tuple(cameras), nominal)


def _ordered_names(sections: Sections, reference: str | None, cameras: dict[str, CameraSection]) -> list[str]:
    """Names of the cameras, the reference first."""
    names = list(cameras)
    if not names:
        add_finding(sections, ("head", "cameras"), "names no camera", "at least one", "describe the cameras")
    elif reference is None:
        expected = "the name of the camera whose frame is the head's"
        add_finding(
            sections,
            ("head", "reference"),
            "is missing",
            expected,
            f'write for example "reference: {names[0]}"',
        )
    elif reference not in cameras:
        cure = did_you_mean(reference, names) or "write one of them"
        add_finding(sections, ("head", "reference"), f"'{reference}' is no camera", f"one of {', '.join(names)}", cure)
    return sorted(names, key=lambda name: name != reference)


def _camera(sections: Sections, name: str, head: HeadSection, length_m: float | None) -> CameraDescription:
    section = head.cameras[name] if not isinstance(head.cameras, str) else None
    if section is None:
        raise ValueError(f"camera {name} is not in the section")
    keys: Keys = ("head", "cameras", name)
    width_px, height_px = section.image_size_px
    camera = None
    if isinstance(section.intrinsics, IntrinsicsSection):
        camera = _intrinsics(sections, keys, section.intrinsics, (width_px, height_px))
    T_camera_head = None
    if head.reference == name:
        if section.pose is not None:
            what, expected = "is given for the reference camera", "no pose: its frame is the head's"
            add_finding(sections, (*keys, "pose"), what, expected, "remove it", at_key=True)
    elif section.pose is None and isinstance(head.cameras, dict) and head.reference in head.cameras:
        expected = "calibrate or T_camera_head for every camera but the reference"
        add_finding(sections, (*keys, "pose"), "is missing", expected, 'write for example "pose: calibrate"')
    elif isinstance(section.pose, PoseSection):
        T_camera_head = _matrix(sections, (*keys, "pose", "T_camera_head"), section.pose.T_camera_head, length_m)
    return CameraDescription(name, width_px, height_px, camera, T_camera_head)


def _intrinsics(sections: Sections, keys: Keys, given: IntrinsicsSection, size_px: tuple[int, int]) -> Camera | None:
    """The camera as given, if its terms are those of its lens model."""
    fisheye, terms = given.model == FISHEYE, len(given.distortion)
    if fisheye != (terms == len(FISHEYE_TERMS)):
        expected = ", ".join(FISHEYE_TERMS) if fisheye else "5, 8 or 12: k1, k2, p1, p2, k3, ..."
        cure = "leave p1 and p2 out" if fisheye else 'write "model: fisheye" for a fisheye, or 0 for missing terms'
        what = f"has {terms} terms for a {given.model} lens"
        add_finding(sections, (*keys, "intrinsics", "distortion"), what, expected, cure)
        return None
    return Camera(
        *size_px, np.array(given.focal_px), np.array(given.centre_px), np.array(given.distortion), given.model
    )


def _nominal(sections: Sections, section: HeadSection, length_m: float | None) -> Floats | None:
    """The drawing's pose of the head, named as the mount asks for it."""
    mount = sections.valid.get("mount")
    if section.nominal is None or mount is None:
        return None
    right, wrong = ("T_flange_head", "T_base_head") if mount == EYE_IN_HAND else ("T_base_head", "T_flange_head")
    keys: Keys = ("head", "nominal")
    if getattr(section.nominal, wrong) is not None:
        cure = "write the other one, or remove nominal"
        add_finding(sections, (*keys, wrong), f"does not fit mount: {mount}", right, cure, at_key=True)
    rows = getattr(section.nominal, right)
    if rows is None:
        if getattr(section.nominal, wrong) is None:
            add_finding(
                sections,
                keys,
                "is empty",
                f"{right}, four rows of four numbers",
                "write it, or remove nominal",
            )
        return None
    return _matrix(sections, (*keys, right), rows, length_m)


def _matrix(sections: Sections, keys: Keys, rows: list[list[float]], length_m: float | None) -> Floats | None:
    """A rigid transform whose translation is in the file's unit of length."""
    if length_m is None:
        return None
    T = np.array(rows, dtype=np.float64)
    T[:3, 3] *= length_m
    try:
        return checked_transforms(T, "the matrix")
    except ValueError as error:
        cure = "copy all four rows with at least five digits; the translation is the last column"
        add_finding(sections, keys, str(error), "a rotation and a translation", cure)
        return None
