"""The only rooms that open a user's file, each entered on first use: nobody loads pydantic idly."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sixthlink.files.arm_file import load_arm, maker_names, read_arm, write_arm
    from sixthlink.files.arm_result_file import (
        ARM_RESULT_SCHEMA,
        arm_result_as_dict,
        arm_result_from_dict,
        read_arm_result,
        write_arm_result,
    )
    from sixthlink.files.atomic import atomic_write_bytes, atomic_write_text
    from sixthlink.files.detection_memory import DetectionMemory
    from sixthlink.files.detections_file import read_detections, write_detections
    from sixthlink.files.images import image_reader, read_grey_image
    from sixthlink.files.notes_on_images import image_notes
    from sixthlink.files.recording_folder import read_recording
    from sixthlink.files.recording_robot import file_sha256
    from sixthlink.files.recording_writer import write_recording
    from sixthlink.files.result_file import (
        RESULT_SCHEMA,
        read_result,
        result_as_dict,
        result_from_dict,
        write_result,
    )
    from sixthlink.files.skeleton import write_skeleton
    from sixthlink.files.study_table import append_trial, read_study, write_study
    from sixthlink.files.targets_table import Targets, read_targets, write_targets
    from sixthlink.files.tracked_arm_file import TRACKED_ARM_SCHEMA, tracked_arm_as_dict, write_tracked_arm
    from sixthlink.files.tracker_folder import read_tracker_record
    from sixthlink.files.tracker_skeleton import write_tracker_skeleton
    from sixthlink.files.tracker_writer import write_tracker_record
    from sixthlink.files.truth_file import write_truth
    from sixthlink.files.urdf import arm_from_urdf

_ROOMS = {
    "arm_file": ("load_arm", "maker_names", "read_arm", "write_arm"),
    "arm_result_file": (
        "ARM_RESULT_SCHEMA",
        "arm_result_as_dict",
        "arm_result_from_dict",
        "read_arm_result",
        "write_arm_result",
    ),
    "atomic": ("atomic_write_bytes", "atomic_write_text"),
    "detection_memory": ("DetectionMemory",),
    "detections_file": ("read_detections", "write_detections"),
    "images": ("image_reader", "read_grey_image"),
    "notes_on_images": ("image_notes",),
    "recording_folder": ("read_recording",),
    "recording_robot": ("file_sha256",),
    "recording_writer": ("write_recording",),
    "result_file": ("RESULT_SCHEMA", "read_result", "result_as_dict", "result_from_dict", "write_result"),
    "skeleton": ("write_skeleton",),
    "study_table": ("append_trial", "read_study", "write_study"),
    "targets_table": ("Targets", "read_targets", "write_targets"),
    "tracked_arm_file": ("TRACKED_ARM_SCHEMA", "tracked_arm_as_dict", "write_tracked_arm"),
    "tracker_folder": ("read_tracker_record",),
    "tracker_skeleton": ("write_tracker_skeleton",),
    "tracker_writer": ("write_tracker_record",),
    "truth_file": ("write_truth",),
    "urdf": ("arm_from_urdf",),
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names}

__all__ = [
    "ARM_RESULT_SCHEMA",
    "RESULT_SCHEMA",
    "TRACKED_ARM_SCHEMA",
    "DetectionMemory",
    "Targets",
    "append_trial",
    "arm_from_urdf",
    "arm_result_as_dict",
    "arm_result_from_dict",
    "atomic_write_bytes",
    "atomic_write_text",
    "file_sha256",
    "image_notes",
    "image_reader",
    "load_arm",
    "maker_names",
    "read_arm",
    "read_arm_result",
    "read_detections",
    "read_grey_image",
    "read_recording",
    "read_result",
    "read_study",
    "read_targets",
    "read_tracker_record",
    "result_as_dict",
    "result_from_dict",
    "tracked_arm_as_dict",
    "write_arm",
    "write_arm_result",
    "write_detections",
    "write_recording",
    "write_result",
    "write_skeleton",
    "write_study",
    "write_targets",
    "write_tracked_arm",
    "write_tracker_record",
    "write_tracker_skeleton",
    "write_truth",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
