"""Which keys may recording.yaml have, and of what type?

Only shapes and words; what needs two sections at once, or another file, is judged in ``recording_sections``.
This module imports pydantic and is imported only when a recording is read.
"""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    create_model,
)

from sixthlink.camera import LENS_MODELS, PINHOLE
from sixthlink.files.schema_findings import UNION_TAG, one_of
from sixthlink.geometry import ORIENTATIONS
from sixthlink.recording import MOUNTS
from sixthlink.target import MARK_FINDERS, SOCKET, TARGET_KINDS
from sixthlink.units import ANGLE_UNITS, LENGTH_UNITS

__all__ = [
    "EXAMPLES",
    "JOINTS",
    "NONE",
    "SCHEMA",
    "SECTIONS",
    "CameraSection",
    "HeadSection",
    "IntrinsicsSection",
    "PoseSection",
    "RobotSection",
    "StandardSection",
    "TargetPosesSection",
    "UnitsSection",
    "target_model",
]

SCHEMA = "sixthlink-recording/1"
CALIBRATE = "calibrate"
NONE = "none"
JOINTS, FLANGE_POSES = "joints", "flange-poses"
IMAGES, PIXELS, TARGET_POSES, TOUCHES = "images", "pixels", "target-poses", "touches"

EXAMPLES = {
    "schema": f"schema: {SCHEMA}",
    "name": "name: left cell, March",
    "units": "units: {length: mm, angle: deg}",
    "units.length": "length: mm",
    "units.angle": "angle: deg",
    "mount": "mount: eye-in-hand",
    "robot": "robot: {name: abb_irb1400, positions: joints}",
    "robot.name": "name: abb_irb1400",
    "robot.arm": "arm: my_arm.yaml",
    "robot.urdf": "urdf: {file: my_arm.urdf, base: base_link, tip: tool0}",
    "robot.urdf.file": "file: my_arm.urdf",
    "robot.urdf.base": "base: base_link",
    "robot.urdf.tip": "tip: tool0",
    "robot.kinematics": "kinematics: none",
    "robot.label": "label: Denso VS-6577",
    "robot.positions": "positions: joints",
    "robot.orientation": "orientation: abb",
    "robot.direction": "direction: T_base_flange",
    "robot.positions_confirmed": "positions_confirmed: true",
    "head": "head: {reference: right, cameras: {right: {image_size_px: [640, 480], intrinsics: calibrate}}}",
    "head.reference": "reference: right",
    "head.cameras": "cameras: {right: {image_size_px: [2452, 2056], intrinsics: calibrate}}",
    "head.cameras.*": "right: {image_size_px: [2452, 2056], intrinsics: calibrate}",
    "head.cameras.*.image_size_px": "image_size_px: [2452, 2056]",
    "head.cameras.*.intrinsics": "intrinsics: calibrate",
    "head.cameras.*.intrinsics.focal_px": "focal_px: [4900, 4900]",
    "head.cameras.*.intrinsics.centre_px": "centre_px: [1225.5, 1027.5]",
    "head.cameras.*.intrinsics.distortion": "distortion: [0, 0, 0, 0, 0]",
    "head.cameras.*.intrinsics.model": "model: fisheye",
    "head.cameras.*.pose": "pose: calibrate",
    "head.cameras.*.pose.T_camera_head": "T_camera_head: four rows of four numbers",
    "head.nominal": "nominal: {T_flange_head: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 150], [0, 0, 0, 1]]}",
    "head.nominal.T_flange_head": "T_flange_head: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 150], [0, 0, 0, 1]]",
    "head.nominal.T_base_head": "T_base_head: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 900], [0, 0, 0, 1]]",
    "head.pose_of": "pose_of: laser tracker, six-degree-of-freedom probe",
    "target": "target: {kind: chessboard, columns: 12, rows: 9, square: 20}",
    "length_standard": "length_standard: none",
    "length_standard.length": "length: 1234.15",
    "length_standard.uncertainty": "uncertainty: 0.003",
    "length_standard.mark": "mark: quadrant",
    "length_standard.mark_diameter": "mark_diameter: 24",
    "length_standard.marks": "marks: [A, B]",
    "observations": "observations: images",
    "target_poses": "target_poses: {orientation: quaternion-xyzw, direction: T_head_target}",
    "target_poses.orientation": "orientation: quaternion-xyzw",
    "target_poses.direction": "direction: T_head_target",
}
"""Every key, and a line that shows it."""

_PRESETS = (*(name for name in ORIENTATIONS if not name.startswith("euler-")), "euler- and three axes")

Positive = Annotated[float, Field(gt=0)]
Size = Annotated[int, Field(gt=0)]
Text = Annotated[str, StringConstraints(min_length=1)]
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]+$")]
Row = Annotated[list[float], Field(min_length=4, max_length=4)]
Rows = Annotated[list[Row], Field(min_length=4, max_length=4)]
OrientationName = Annotated[str, BeforeValidator(one_of(ORIENTATIONS, shown=_PRESETS))]


Calibrate = Annotated[str, BeforeValidator(one_of([CALIBRATE], shown=[CALIBRATE, "a mapping"]))]
Nothing = Annotated[str, BeforeValidator(one_of([NONE], shown=[NONE, "a mapping"]))]


def _word_or_mapping(value: Any) -> str:
    return f"{UNION_TAG}mapping" if isinstance(value, dict) else f"{UNION_TAG}word"


_WORD, _MAPPING, _CHOOSE = (
    Tag(f"{UNION_TAG}word"),
    Tag(f"{UNION_TAG}mapping"),
    Discriminator(_word_or_mapping),
)


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)


class UnitsSection(_Section):
    """Units of the file and of shots.csv."""

    length: Annotated[str, BeforeValidator(one_of(LENGTH_UNITS))]
    angle: Annotated[str, BeforeValidator(one_of(ANGLE_UNITS))]


class UrdfSection(_Section):
    """An arm between two links of a URDF file."""

    file: Text
    base: Text
    tip: Text


class RobotSection(_Section):
    """Which robot, and how its positions are written."""

    name: Text | None = None
    arm: Text | None = None
    urdf: UrdfSection | None = None
    kinematics: Literal["none"] | None = None
    label: Text | None = None
    positions: Annotated[str, BeforeValidator(one_of([JOINTS, FLANGE_POSES]))]
    orientation: OrientationName | None = None
    direction: Annotated[str, BeforeValidator(one_of(["T_base_flange", "T_flange_base"]))] | None = None
    positions_confirmed: bool = False


def _terms(value: Any) -> Any:
    from pydantic_core import PydanticCustomError

    if isinstance(value, list) and len(value) not in {4, 5, 8, 12}:
        expected = "a list of 5, 8 or 12, or of 4 with model: fisheye"
        raise PydanticCustomError("one_of", "{expected}", {"expected": expected, "cure": ""})
    return value


class IntrinsicsSection(_Section):
    """Intrinsics of one camera."""

    model: Annotated[str, BeforeValidator(one_of(LENS_MODELS))] = PINHOLE
    focal_px: Annotated[list[Positive], Field(min_length=2, max_length=2)]
    centre_px: Annotated[list[float], Field(min_length=2, max_length=2)]
    distortion: Annotated[list[float], BeforeValidator(_terms)]


class PoseSection(_Section):
    """Pose of the head frame in a camera."""

    T_camera_head: Rows


class CameraSection(_Section):
    """One camera."""

    image_size_px: Annotated[list[Size], Field(min_length=2, max_length=2)]
    intrinsics: Annotated[Annotated[Calibrate, _WORD] | Annotated[IntrinsicsSection, _MAPPING], _CHOOSE]
    pose: Annotated[Annotated[Calibrate, _WORD] | Annotated[PoseSection, _MAPPING], _CHOOSE] | None = None


class NominalSection(_Section):
    """The drawing's pose of the head; which of the two depends on the mount."""

    T_flange_head: Rows | None = None
    T_base_head: Rows | None = None


class HeadSection(_Section):
    """The cameras, the reference among them, and the drawing's pose."""

    reference: Text | None = None
    cameras: Annotated[Annotated[Nothing, _WORD] | Annotated[dict[Name, CameraSection], _MAPPING], _CHOOSE] = NONE
    nominal: NominalSection | None = None
    pose_of: Text | None = None


class StandardSection(_Section):
    """The length standard and its certificate."""

    length: Positive
    uncertainty: Positive
    mark: Annotated[str, BeforeValidator(one_of([*MARK_FINDERS, SOCKET]))]
    mark_diameter: Positive | None = None
    marks: Annotated[list[Text], Field(min_length=2, max_length=2)] = ["A", "B"]


class TargetPosesSection(_Section):
    """How measured target poses are written."""

    orientation: OrientationName
    direction: Annotated[str, BeforeValidator(one_of(["T_head_target", "T_target_head"]))]


SECTIONS: dict[str, Any] = {
    "schema": Annotated[str, BeforeValidator(one_of([SCHEMA]))],
    "name": Text,
    "units": UnitsSection,
    "mount": Annotated[str, BeforeValidator(one_of(MOUNTS))],
    "robot": RobotSection,
    "head": HeadSection,
    "target": Annotated[Annotated[Nothing, _WORD] | Annotated[dict[str, Any], _MAPPING], _CHOOSE],
    "length_standard": Annotated[Annotated[Nothing, _WORD] | Annotated[StandardSection, _MAPPING], _CHOOSE],
    "observations": Annotated[str, BeforeValidator(one_of([IMAGES, PIXELS, TARGET_POSES, TOUCHES]))],
    "target_poses": TargetPosesSection,
}
"""Type of each section; each is judged by itself, so that a mistake in one does not hide those in another."""

OPTIONAL = frozenset({"target", "length_standard", "target_poses"})
"""Sections that some recordings do without."""

OF_A_HEAD = frozenset({"mount", "head", "target", "target_poses"})
"""Sections that recordings of touches have not: nothing sees, nothing is seen."""


def target_model(kind: str) -> tuple[type[BaseModel], dict[str, str]]:
    """Schema of one kind of target, from the fields of its dataclass, and an example per key.

    A field ``square_m`` becomes the key ``square``, a positive number in the unit of length of the file.
    Defaults stay the dataclass's own: only what the user wrote is to be handed on.
    """
    class_ = TARGET_KINDS[kind]
    hints = get_type_hints(class_)
    keys: dict[str, Any] = {"kind": (str, ...)}
    examples = {"target.kind": f"kind: {kind}"}
    for f in (f for f in fields(class_) if f.init):
        key = f.name.removesuffix("_m")
        type_ = Positive if key != f.name else hints[f.name]
        keys[key] = (type_, ... if f.default is MISSING else f.default)
        sample = {int: "9", str: "...", bool: "false"}.get(type_, "20")
        examples[f"target.{key}"] = f"{key}: {sample}"
    return create_model(f"{kind}_target", __base__=_Section, **keys), examples
