"""How are detections kept beside a result, and read again? In the same form as pixels.csv."""

from __future__ import annotations

from pathlib import Path

from sixthlink.errors import Finding, InputError
from sixthlink.files.atomic import atomic_write_text
from sixthlink.files.csv_table import read_csv
from sixthlink.files.pixels_table import PixelNames, pixels_text, read_pixels
from sixthlink.recording import Detections, Recording

__all__ = ["read_detections", "write_detections"]


def write_detections(path: Path, recording: Recording, detections: Detections) -> None:
    """Write what was detected in a recording as a pixel table."""
    atomic_write_text(path, pixels_text(recording, detections))


def read_detections(path: Path, recording: Recording) -> Detections:
    """Read a pixel table that belongs to a recording.

    Raises:
        InputError: The table is not one, or names shots, cameras or points that the recording has not.
    """
    names = PixelNames(
        shots=recording.ids,
        marks=recording.marks,
        cameras=tuple(c.name for c in recording.head.cameras),
        points=len(recording.target.points_m) if recording.target else 0,
        standard_marks=recording.standard.marks if recording.standard else (),
    )
    findings: list[Finding] = []
    table = read_csv(path, findings)
    detections = None if table is None else read_pixels(table, names, findings)
    if detections is None:
        raise InputError(findings)
    return detections
