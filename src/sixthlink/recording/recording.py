"""What did the user record?

One noun that everything after it reads: which robot, which head, which target, and one row per shot. Everything is
in metres, radians and pixels; the floor that reads files has already refused whatever was missing or ambiguous.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from sixthlink.camera import Camera
from sixthlink.geometry import Floats, Ints, frozen_floats
from sixthlink.recording.detections import Detections, renumbered
from sixthlink.robot import Arm, flange_poses
from sixthlink.target import LengthStandard, Target

__all__ = [
    "BOARD_KINDS",
    "EYE_IN_HAND",
    "EYE_TO_HAND",
    "KINDS",
    "MOUNTS",
    "CameraDescription",
    "Head",
    "Recording",
    "flange_poses_of",
    "placement_indices",
    "shots_of_kind",
    "subset",
    "with_arm",
]

EYE_IN_HAND, EYE_TO_HAND = "eye-in-hand", "eye-to-hand"
MOUNTS = (EYE_IN_HAND, EYE_TO_HAND)
"""The head rides on the flange, or it stands still and watches a target on the flange."""

KINDS = ("calibrate", "judge", "scale", "verify")
"""What a shot is for: the target for the calibration, or kept out of it to judge it; the length standard likewise."""

BOARD_KINDS = ("calibrate", "judge")
"""Kinds of shots that show the target; the others show the length standard."""


@dataclass(frozen=True, eq=False)
class CameraDescription:
    """What the recording says of one camera.

    Attributes:
        name: Name of the camera.
        width_px: Image width [pixel].
        height_px: Image height [pixel].
        camera: Given intrinsics, or None when they are to be calibrated from the recording's images.
        T_camera_head: ``(4, 4)`` given pose of the head frame in this camera, or None when it is to be calibrated.
    """

    name: str
    width_px: int
    height_px: int
    camera: Camera | None = None
    T_camera_head: Floats | None = None


@dataclass(frozen=True, eq=False)
class Head:
    """What the recording says of the head.

    Attributes:
        cameras: Its cameras, the reference first; empty when target poses were measured by something else.
        nominal: ``(4, 4)`` drawing's pose of the head, ``T_flange_head`` (eye-in-hand) or ``T_base_head``
            (eye-to-hand), or None when the recording has none.
    """

    cameras: tuple[CameraDescription, ...]
    nominal: Floats | None = None


@dataclass(frozen=True, eq=False)
class Recording:
    """A robot, a head, a target and N shots.

    Attributes:
        name: Name for people.
        mount: ``eye-in-hand`` or ``eye-to-hand``.
        robot: Name of the robot for people.
        arm: Its kinematics, or None when only flange poses were recorded.
        head: What is known of the head beforehand.
        target: The calibration target, or None in recordings of target poses only.
        standard: The length standard, or None.
        ids: Name of each shot.
        placements: Name of the target's (or the standard's) placement in each shot.
        kinds: One of ``KINDS`` per shot.
        marks: Name of the mark of the length standard that a shot shows, or of the socket that it touches; empty for
            shots that show the target.
        joints: ``(N, J)`` joint values [rad or m], or None.
        Ts_base_flange: ``(N, 4, 4)`` flange poses as the controller reported them, or None.
        images: Per camera name, one file name per shot (empty where that camera took none).
        pixels: Pixels that were recorded instead of images, or None.
        Ts_head_target: ``(N, 4, 4)`` target poses that were recorded instead of images, or None.
        inputs: SHA-256 per input file, by name within the recording.
    """

    name: str
    mount: str
    robot: str
    arm: Arm | None
    head: Head
    target: Target | None
    standard: LengthStandard | None
    ids: tuple[str, ...]
    placements: tuple[str, ...]
    kinds: tuple[str, ...]
    marks: tuple[str, ...]
    joints: Floats | None = None
    Ts_base_flange: Floats | None = None
    images: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    pixels: Detections | None = None
    Ts_head_target: Floats | None = None
    inputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def touched(self) -> bool:
        """Whether every shot is a touch: a ball on the flange came to rest in a socket, and the joints were read."""
        return not self.head.cameras and self.Ts_head_target is None

    def __post_init__(self) -> None:
        N = len(self.ids)
        columns = {"placements": self.placements, "kinds": self.kinds, "marks": self.marks}
        columns |= {f"images of {camera}": names for camera, names in self.images.items()}
        for what, values in columns.items():
            if len(values) != N:
                raise ValueError(f"{what}: {len(values)} entries for {N} shots")
        if len(set(self.ids)) != N:
            raise ValueError("shot ids must all be different")
        if self.mount not in MOUNTS:
            raise ValueError(f"mount is {self.mount!r}, expected one of {MOUNTS}")
        if self.joints is None and self.Ts_base_flange is None:
            raise ValueError("a recording needs joint values or flange poses")
        if self.joints is not None:
            if self.arm is None:
                raise ValueError("joint values need the arm's kinematics")
            object.__setattr__(self, "joints", frozen_floats(self.joints, (N, len(self.arm.joints)), "joints"))
        for name in ("Ts_base_flange", "Ts_head_target"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen_floats(getattr(self, name), (N, 4, 4), name))


def shots_of_kind(recording: Recording, kind: str) -> Ints:
    """Indices ``(M,)`` of the shots of one kind, in recorded order."""
    return np.array([i for i, k in enumerate(recording.kinds) if k == kind], dtype=np.int64)


def placement_indices(recording: Recording, shots: Ints) -> tuple[Ints, tuple[str, ...]]:
    """Placement number ``(M,)`` of each of the ``(M,)`` shots, and the placements' names in order of appearance."""
    names = tuple(dict.fromkeys(recording.placements[i] for i in shots))
    number = {name: k for k, name in enumerate(names)}
    return np.array([number[recording.placements[i]] for i in shots], dtype=np.int64), names


def flange_poses_of(recording: Recording, *, arm: Arm | None = None) -> Floats:
    """Flange poses ``(N, 4, 4)``: forward kinematics of the joints where there are any, else as the controller said.

    Args:
        recording: The recording.
        arm: Kinematics to use instead of the recording's own.
    """
    if recording.joints is not None:
        chosen = arm or recording.arm
        if chosen is None:
            raise ValueError("joint values need the arm's kinematics")
        return flange_poses(chosen, recording.joints)
    assert recording.Ts_base_flange is not None  # noqa: S101 - the constructor made sure of one of the two
    return recording.Ts_base_flange


def subset(recording: Recording, shots: Ints) -> Recording:
    """The recording reduced to the ``(M,)`` shots of these indices, in that order."""

    def rows(column: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(column[i] for i in shots)

    return replace(
        recording,
        ids=rows(recording.ids),
        placements=rows(recording.placements),
        kinds=rows(recording.kinds),
        marks=rows(recording.marks),
        joints=None if recording.joints is None else recording.joints[shots],
        Ts_base_flange=None if recording.Ts_base_flange is None else recording.Ts_base_flange[shots],
        images={camera: rows(names) for camera, names in recording.images.items()},
        pixels=None if recording.pixels is None else renumbered(recording.pixels, shots),
        Ts_head_target=None if recording.Ts_head_target is None else recording.Ts_head_target[shots],
    )


def with_arm(recording: Recording, arm: Arm) -> Recording:
    """The same recording with another arm, for example a calibrated one."""
    return replace(recording, arm=arm)
