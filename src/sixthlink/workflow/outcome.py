"""What did a step write, and which shots of a recording may it see?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import numpy as np

from sixthlink.recording import Recording, shots_of_kind, subset

__all__ = ["ARM", "DETECTIONS", "REPORT", "RESULT", "Outcome", "now", "shots_for", "versions"]

RESULT, REPORT, DETECTIONS, ARM = "result.json", "report.html", "detections.csv", "arm.yaml"
"""Names of what a calibration leaves in its result folder."""


@dataclass(frozen=True)
class Outcome:
    """Files that a step wrote, by what they are."""

    files: Mapping[str, Path]


def shots_for(recording: Recording, kinds: tuple[str, ...]) -> Recording:
    """The recording's shots of some kinds, knowing only the input files that those shots are made of."""
    keep = np.sort(np.concatenate([shots_of_kind(recording, kind) for kind in kinds]))
    part = subset(recording, keep)
    images = {name for names in recording.images.values() for name in names}
    used = {name for names in part.images.values() for name in names}
    inputs = {name: digest for name, digest in recording.inputs.items() if name in used or name not in images}
    return replace(part, inputs=inputs)


def versions() -> dict[str, str]:
    """Versions of sixthlink and of the libraries that shape its numbers."""
    return {name: version(name) for name in ("sixthlink", "numpy", "scipy", "opencv-python-headless")}


def now() -> str:
    """Date and time in words, universal time."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
