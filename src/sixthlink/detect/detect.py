"""Which named points do the images of a recording show, and which images had to be refused?

Each image is looked at by itself. A board that looks the same after a turn may therefore come out with either end
first, even in two images of one shot; whoever compares images settles that (``Target.turn``).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sixthlink.errors import CalibrationError
from sixthlink.progress import Progress
from sixthlink.recording import BOARD_KINDS, Detections, Recording, Rejection, joined
from sixthlink.target import MARK_FINDERS, Found, GreyImage, NotFound

__all__ = ["Memory", "detect"]

STAGE = "detecting"


class Memory(Protocol):
    """Remembers what was found in the image of a shot and a camera, both by index."""

    def recall(self, shot: int, camera: int) -> Found | NotFound | None:
        """What was found before; None where nobody has looked."""
        ...

    def remember(self, shot: int, camera: int, answer: Found | NotFound) -> None:
        """Keep what was found."""
        ...


@dataclass(frozen=True)
class _Job:
    """One image to look at."""

    shot: int
    camera: int


def detect(
    recording: Recording,
    read_image: Callable[[int, int], GreyImage | NotFound],
    *,
    memory: Memory | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
) -> tuple[Detections, tuple[Rejection, ...]]:
    """Points of the target in calibration shots and marks of the length standard in all others.

    Args:
        recording: The recording; if it carries pixels instead of images, these are the answer.
        read_image: Grey image of a shot and a camera, both by index, or why it cannot be read. It is called from
            several threads.
        memory: What was found in the same images before; images that it knows are not read.
        progress: Receives the number of images done.
        workers: Threads; by default as many as there are processors.

    Returns:
        The detections, ordered by shot, camera and point whatever the number of workers, and one rejection for
        every image without any.

    Raises:
        CalibrationError: The recording has no images and no pixels.
    """
    if recording.pixels is not None:
        return recording.pixels, ()
    jobs = _jobs(recording)
    if not jobs:
        raise CalibrationError(
            "the recording names no images and no pixels, so there is nothing to detect; name the images of each shot"
        )
    tables: list[Detections] = []
    rejections: list[Rejection] = []
    executor = ThreadPoolExecutor(max_workers=workers or os.cpu_count() or 1)
    with _one_opencv_thread():
        try:
            answers = executor.map(lambda job: _answer(recording, read_image, memory, job), jobs)
            for done, (job, answer) in enumerate(zip(jobs, answers, strict=True), start=1):
                if isinstance(answer, Found):
                    tables.append(_table(job, answer))
                else:
                    camera = recording.head.cameras[job.camera].name
                    rejections.append(Rejection(recording.ids[job.shot], camera, answer.reason))
                if progress is not None:
                    progress.step(STAGE, done, len(jobs))
        finally:  # a listener may stop the walk by raising: images that nobody waits for are not begun
            executor.shutdown(cancel_futures=True)
    return joined(tables), tuple(rejections)


def _jobs(recording: Recording) -> list[_Job]:
    return [
        _Job(shot, index)
        for shot in range(len(recording.ids))
        for index, camera in enumerate(recording.head.cameras)
        if camera.name in recording.images and recording.images[camera.name][shot]
    ]


def _answer(
    recording: Recording, read_image: Callable[[int, int], GreyImage | NotFound], memory: Memory | None, job: _Job
) -> Found | NotFound:
    known = memory.recall(job.shot, job.camera) if memory is not None else None
    if known is not None:
        return known
    image = read_image(job.shot, job.camera)
    if isinstance(image, NotFound):
        return image
    answer = _look(recording, image, job)
    if memory is not None:
        memory.remember(job.shot, job.camera, answer)
    return answer


def _look(recording: Recording, image: GreyImage, job: _Job) -> Found | NotFound:
    camera = recording.head.cameras[job.camera]
    if image.shape != (camera.height_px, camera.width_px):
        return NotFound(
            f"the image is {image.shape[1]} x {image.shape[0]} pixel, but the camera was described with "
            f"{camera.width_px} x {camera.height_px}; is it another camera's image?"
        )
    if recording.kinds[job.shot] in BOARD_KINDS:
        if recording.target is None:
            return NotFound("the recording describes no target to look for")
        return recording.target.find(image)
    if recording.standard is None:
        return NotFound("the recording describes no length standard to look for")
    found = MARK_FINDERS[recording.standard.mark](image)
    if isinstance(found, NotFound):
        return found
    mark = recording.standard.marks.index(recording.marks[job.shot])
    return Found(np.full(1, mark, dtype=np.int64), found.pixels, found.sigmas_px)


def _table(job: _Job, found: Found) -> Detections:
    order = np.argsort(found.points, kind="stable")
    rows = len(order)
    return Detections(
        np.full(rows, job.shot),
        np.full(rows, job.camera),
        found.points[order],
        found.pixels[order],
        found.sigmas_px[order],
    )


@contextmanager
def _one_opencv_thread() -> Iterator[None]:
    """The images are the parallel work; threads inside each would only wait for one another."""
    import cv2

    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
