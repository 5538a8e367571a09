"""What should a user hear of the image files of a recording, once for all of them?

Only the files' own words are looked at, whatever was found in the images and whether anyone looked at them before.
"""

from __future__ import annotations

import mmap
from dataclasses import dataclass
from pathlib import Path

from sixthlink.files.exif import UPRIGHT, noted_turn
from sixthlink.files.images import JPEG, kind_of
from sixthlink.files.inside import file_inside
from sixthlink.recording import Recording

__all__ = ["image_notes"]


@dataclass(frozen=True)
class _Words:
    """What one image file says of itself."""

    kind: str | None
    orientation: int


def image_notes(folder: Path, recording: Recording) -> tuple[str, ...]:
    """Notes on the images that a recording names: compression that costs accuracy, turns that are not made.

    Args:
        folder: Folder of the recording.
        recording: The recording.
    """
    names = {name for column in recording.images.values() for name in column if name}
    words = [_words(folder, name) for name in names]
    notes = []
    if lossy := sum(w.kind == JPEG for w in words):
        notes.append(
            f"{_images(lossy)} JPEG: its compression moves corners by 0.005 pixel at quality 90 and 0.01 at 75, and "
            "smooths noise away, so that their uncertainty is stated up to three times too small; record PNG or TIFF "
            "where it matters"
        )
    turns = [w.orientation for w in words if w.orientation != UPRIGHT]
    if turns:
        numbers = ", ".join(map(str, sorted(set(turns))))
        notes.append(
            f"{_images(len(turns))} marked to be turned (EXIF orientation {numbers}): taken as stored, as the lens "
            "sees them"
        )
    return tuple(notes)


def _words(folder: Path, name: str) -> _Words:
    """What a file says; nothing where it cannot be opened, which is refused elsewhere."""
    try:
        with file_inside(folder, name).open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            turn = noted_turn(data)
            return _Words(kind_of(data[:8]), UPRIGHT if turn is None else turn.orientation)
    except (OSError, ValueError):  # not there, or empty
        return _Words(None, UPRIGHT)


def _images(count: int) -> str:
    return f"{count} images are" if count > 1 else "1 image is"
