"""Calibrate a camera or stereo head as the last link of a robot arm, and prove it on a length standard.

The front door: every public name, sorted, fetched on first use, so that importing one rotation loads no OpenCV.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sixthlink.calibrate import Calibration, SolveOptions
    from sixthlink.calibrate.touches import ArmCalibration
    from sixthlink.camera import Camera, CameraRig
    from sixthlink.errors import CalibrationError, Finding, InputError, SixthlinkError
    from sixthlink.files import (
        load_arm,
        read_arm,
        read_arm_result,
        read_recording,
        read_result,
        write_arm,
        write_arm_result,
        write_result,
    )
    from sixthlink.measure import LengthCheck, LengthStatistics, statistics
    from sixthlink.recording import Detections, Recording, Rejection
    from sixthlink.robot import (
        Arm,
        HeadLink,
        PaperNumbers,
        flange_poses,
        head_link_from_transform,
        paper_numbers_from_transform,
    )
    from sixthlink.target import Charuco, Chessboard, LengthStandard
    from sixthlink.workflow import calibrate_folder, simulate_folder, verify_folder

_HOMES = {
    "Arm": "robot",
    "ArmCalibration": "calibrate.touches",
    "Calibration": "calibrate",
    "CalibrationError": "errors",
    "Camera": "camera",
    "CameraRig": "camera",
    "Charuco": "target",
    "Chessboard": "target",
    "Detections": "recording",
    "Finding": "errors",
    "HeadLink": "robot",
    "InputError": "errors",
    "LengthCheck": "measure",
    "LengthStandard": "target",
    "LengthStatistics": "measure",
    "PaperNumbers": "robot",
    "Recording": "recording",
    "Rejection": "recording",
    "SixthlinkError": "errors",
    "SolveOptions": "calibrate",
    "calibrate_folder": "workflow",
    "flange_poses": "robot",
    "head_link_from_transform": "robot",
    "load_arm": "files",
    "paper_numbers_from_transform": "robot",
    "read_arm": "files",
    "read_arm_result": "files",
    "read_recording": "files",
    "read_result": "files",
    "simulate_folder": "workflow",
    "statistics": "measure",
    "verify_folder": "workflow",
    "write_arm": "files",
    "write_arm_result": "files",
    "write_result": "files",
}

__all__ = [
    "Arm",
    "ArmCalibration",
    "Calibration",
    "CalibrationError",
    "Camera",
    "CameraRig",
    "Charuco",
    "Chessboard",
    "Detections",
    "Finding",
    "HeadLink",
    "InputError",
    "LengthCheck",
    "LengthStandard",
    "LengthStatistics",
    "PaperNumbers",
    "Recording",
    "Rejection",
    "SixthlinkError",
    "SolveOptions",
    "calibrate_folder",
    "flange_poses",
    "head_link_from_transform",
    "load_arm",
    "paper_numbers_from_transform",
    "read_arm",
    "read_arm_result",
    "read_recording",
    "read_result",
    "simulate_folder",
    "statistics",
    "verify_folder",
    "write_arm",
    "write_arm_result",
    "write_result",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
