"""How do the images of a recording become pixels, as fast as they can be read, and what do they say of the cameras?"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

import numpy as np

from sixthlink.calibrate import (
    RigCalibration,
    StereoCheck,
    boards_with_disc_centres,
    calibrate_rig,
    given_rig,
    stereo_checks,
)
from sixthlink.detect import detect
from sixthlink.errors import CalibrationError
from sixthlink.files import DetectionMemory, image_notes, image_reader, read_recording, write_detections
from sixthlink.progress import Progress, Silent
from sixthlink.recording import BOARD_KINDS, Detections, Recording, Rejection, selected
from sixthlink.target import Found, GreyImage, NotFound
from sixthlink.workflow.outcome import DETECTIONS, Outcome

__all__ = ["ImageReport", "detect_folder", "look"]


@dataclass(frozen=True, eq=False)
class ImageReport:
    """What the images of a recording show.

    Attributes:
        recording: The recording.
        detections: What was found.
        rejections: Images in which nothing was found, and why.
        images: Images that were looked at.
        recalled: How many of them were known from before.
        decode_s: Time for reading and decoding, over all images, per worker [s].
        total_s: Time from the first image to the last [s].
        cameras: The cameras as these images calibrate them; None where they do not, for the reason in ``why``.
        why: Why the images do not calibrate the cameras; empty where they do.
        stereo: Whether the given poses of the cameras still fit.
        notes: What the image files say of themselves and a user should know.
    """

    recording: Recording
    detections: Detections
    rejections: tuple[Rejection, ...]
    images: int
    recalled: int
    decode_s: float
    total_s: float
    cameras: RigCalibration | None
    why: str
    stereo: tuple[StereoCheck, ...]
    notes: tuple[str, ...]


@dataclass
class _Stopwatch:
    """Adds up the time that several threads spend on reading."""

    read: Callable[[int, int], GreyImage | NotFound]
    spent_s: float = 0.0
    lock: Lock = field(default_factory=Lock)

    def __call__(self, shot: int, camera: int) -> GreyImage | NotFound:
        begun = time.perf_counter()
        image = self.read(shot, camera)
        with self.lock:
            self.spent_s += time.perf_counter() - begun
        return image


@dataclass
class _Memory:
    """The user's cache, asked about the images of one recording."""

    recording: Recording
    kept: DetectionMemory
    recalled: int = 0

    def recall(self, shot: int, camera: int) -> Found | NotFound | None:
        digest, wanted = self._key(shot, camera)
        known = self.kept.recall(digest, wanted) if digest else None
        self.recalled += known is not None
        return known

    def remember(self, shot: int, camera: int, answer: Found | NotFound) -> None:
        digest, wanted = self._key(shot, camera)
        if digest:
            self.kept.remember(digest, wanted, answer)

    def _key(self, shot: int, camera: int) -> tuple[str, str]:
        recording = self.recording
        name = recording.images[recording.head.cameras[camera].name][shot]
        digest = recording.inputs.get(name, "")
        if recording.kinds[shot] in BOARD_KINDS or recording.standard is None:
            return digest, repr(recording.target)
        return digest, f"{recording.standard.mark} {recording.standard.marks.index(recording.marks[shot])}"


def look(folder: Path, recording: Recording, progress: Progress) -> tuple[Detections, tuple[Rejection, ...]]:
    """What the images of a recording show; images that were looked at before are not read again."""
    memory = _Memory(recording, DetectionMemory())
    return detect(recording, image_reader(folder, recording), memory=memory, progress=progress)


def detect_folder(
    folder: Path, *, out: Path | None, cached: bool, progress: Progress, workers: int
) -> tuple[ImageReport, Outcome]:
    """Look at every image of a recording folder, and at the cameras that took them.

    Args:
        folder: The recording.
        out: Where to write the detections; nowhere when None.
        cached: Whether images that were looked at before are taken from the cache.
        progress: Listener.
        workers: Threads that look.
    """
    recording = read_recording(folder, calibrating=False)
    watch, memory = _Stopwatch(image_reader(folder, recording)), _Memory(recording, DetectionMemory())
    begun = time.perf_counter()
    detections, rejections = detect(
        recording, watch, memory=memory if cached else None, progress=progress, workers=workers
    )
    total_s = time.perf_counter() - begun
    boards = selected(
        detections, np.isin(detections.shots, [i for i, k in enumerate(recording.kinds) if k in BOARD_KINDS])
    )
    given = given_rig(recording)
    if given is not None:
        boards = boards_with_disc_centres(recording, boards, given)
    cameras, why = _cameras(recording, detections)
    report = ImageReport(
        recording=recording,
        detections=detections,
        rejections=rejections,
        images=sum(bool(name) for names in recording.images.values() for name in names),
        recalled=memory.recalled if cached else 0,
        decode_s=watch.spent_s / workers,
        total_s=total_s,
        cameras=cameras,
        why=why,
        stereo=stereo_checks(recording, boards),
        notes=image_notes(folder, recording),
    )
    files: dict[str, Path] = {}
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        files["detections"] = out / DETECTIONS
        write_detections(files["detections"], recording, detections)
    return report, Outcome(files)


def _cameras(recording: Recording, detections: Detections) -> tuple[RigCalibration | None, str]:
    """The cameras by these images, or why these do not calibrate them."""
    try:
        return calibrate_rig(recording, detections, progress=Silent()), ""
    except CalibrationError as problem:
        return None, str(problem)
