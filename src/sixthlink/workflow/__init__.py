"""The staircase: folder in, artefacts out. The only package that knows every room.

Each function takes paths and options and returns nouns plus the files it wrote. Nothing is written before everything
has succeeded, and every write is atomic.
"""

from sixthlink.workflow.calibration import calibrate_folder, compare_folder
from sixthlink.workflow.detection import ImageReport, detect_folder
from sixthlink.workflow.outcome import Outcome
from sixthlink.workflow.simulation import simulate_folder
from sixthlink.workflow.study import named_study, run_study
from sixthlink.workflow.tracker import arm_from_record, compensate_table
from sixthlink.workflow.verification import verify_folder

__all__ = [
    "ImageReport",
    "Outcome",
    "arm_from_record",
    "calibrate_folder",
    "compare_folder",
    "compensate_table",
    "detect_folder",
    "named_study",
    "run_study",
    "simulate_folder",
    "verify_folder",
]
