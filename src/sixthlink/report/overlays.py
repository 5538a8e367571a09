"""Were the points found where the target is?

A few images, small, with the detected points drawn over them as vectors: the shots that fit worst and best,
and the worst of every placement. The drawing keeps the camera's own pixels as its units.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from sixthlink.calibrate import ShotEvidence
from sixthlink.geometry import Floats, Ints
from sixthlink.progress import Progress
from sixthlink.recording import Detections, Recording
from sixthlink.report.quantities import millimetres, pixels
from sixthlink.report.svg import element
from sixthlink.target import GreyImage, NotFound, Target, turn_names

__all__ = ["ImageReader", "Picture", "ShotPictures", "chosen_shots", "shot_pictures"]

ImageReader = Callable[[int, int], GreyImage | NotFound]
"""Gives the grey image of a shot and a camera, both by index."""

SHOTS, CAMERAS = 6, 2
"""Shots that are shown, and cameras of each."""

WIDTH_PX, QUALITY = 640, 70
"""Width and quality of the small images."""


@dataclass(frozen=True)
class Picture:
    """One camera's view of one shot: its name, what to say of it, and the drawing."""

    camera: str
    remark: str
    drawing: Markup


@dataclass(frozen=True)
class ShotPictures:
    """A shot, why it was chosen and how it fits in words, and its pictures, reference camera first."""

    shot: ShotEvidence
    caption: str
    pictures: tuple[Picture, ...]


def chosen_shots(shots: Sequence[tuple[int, ShotEvidence]]) -> list[tuple[int, ShotEvidence, str]]:
    """At most six shots worth looking at, with the reason: worst, best, then the worst of each placement.

    Args:
        shots: Index in the recording and evidence of every shot that could be shown.
    """
    by_residual = sorted(shots, key=lambda s: -s[1].translation_m)
    if not by_residual:
        return []
    chosen = [(*by_residual[0], "largest residual")]
    if len(by_residual) > 1:
        chosen.append((*by_residual[-1], "smallest residual"))
    seen = {by_residual[0][1].placement}
    for index, shot in by_residual[1:-1]:
        if shot.placement not in seen:
            seen.add(shot.placement)
            chosen.append((index, shot, "largest residual of its placement"))
    return chosen[:SHOTS]


def shot_pictures(
    recording: Recording,
    detections: Detections,
    shots: Sequence[tuple[int, ShotEvidence]],
    read_image: ImageReader | None,
    progress: Progress,
) -> tuple[ShotPictures, ...]:
    """Pictures of the chosen shots with the points that were found in them.

    Args:
        recording: The recording.
        detections: What was found, indexed as the recording is.
        shots: Index in the recording and evidence of every used shot.
        read_image: Gives the images; None draws the points on an empty field.
        progress: Listener.
    """
    chosen = chosen_shots([s for s in shots if (detections.shots == s[0]).any()])
    cameras = range(min(len(recording.head.cameras), CAMERAS))
    made: list[ShotPictures] = []
    for k, (index, shot, why) in enumerate(chosen):
        progress.step("draw the report", k, len(chosen))
        pictures = tuple(_picture(recording, detections, (index, shot), c, read_image) for c in cameras)
        made.append(ShotPictures(shot, _caption(shot, why), pictures))
    progress.step("draw the report", len(chosen), len(chosen))
    return tuple(made)


def _caption(shot: ShotEvidence, why: str) -> str:
    turned = "; read from another end" if shot.turns else ""
    return f"{why}, {millimetres(shot.translation_m)}, image RMS {pixels(shot.rms_px)}{turned}"


def _picture(
    recording: Recording,
    detections: Detections,
    used: tuple[int, ShotEvidence],
    camera: int,
    read_image: ImageReader | None,
) -> Picture:
    index, shot = used
    described = recording.head.cameras[camera]
    rows = np.flatnonzero((detections.shots == index) & (detections.cameras == camera))
    names, at = detections.points[rows], detections.pixels[rows]
    if recording.target is not None and shot.turns:
        names = turn_names(recording.target.turn, len(recording.target.points_m))[shot.turns, names]
    image = read_image(index, camera) if read_image else NotFound("")
    remark = f"{len(rows)} points" if len(rows) else "target not found"
    if isinstance(image, NotFound):
        remark += f"; no image: {image.reason}" if image.reason else ""
        size, href = (described.width_px, described.height_px), ""
    else:
        size, href = (image.shape[1], image.shape[0]), _encoded(image)
    label = f"Points found in shot {shot.shot} by camera {described.name}"
    return Picture(described.name, remark, _overlay(size, names, at, target=recording.target, href=href, label=label))


def _overlay(size: tuple[int, int], names: Ints, at: Floats, *, target: Target | None, href: str, label: str) -> Markup:
    """The image under a cross per point, the first point ringed, with the target's x and y from there."""
    width, height = size
    # The centre of the first pixel is (0, 0): the image begins half a pixel before it.
    frame = {"x": -0.5, "y": -0.5, "width": width, "height": height}
    parts = [element("image", href=href, **frame) if href else element("rect", class_="empty", **frame)]
    if len(names):
        parts.append(element("path", d=_crosses(at, 0.010 * width), class_="found"))
        first = int(np.argmin(names))
        parts.append(_ring(at[first], 0.014 * width))
        if target is not None:
            points = target.points_m[names]
            parts += [_arrow(points, at, first, axis, 0.028 * width) for axis in (0, 1)]
    return element("svg", *parts, viewBox=f"-0.5 -0.5 {width} {height}", role="img", aria_label=label)


def _crosses(at: Floats, arm: float) -> str:
    return "".join(f"M{u - arm:.1f} {v:.1f}h{2 * arm:.1f}M{u:.1f} {v - arm:.1f}v{2 * arm:.1f}" for u, v in at)


def _ring(at: Floats, radius: float) -> Markup:
    return element("circle", cx=float(at[0]), cy=float(at[1]), r=radius, class_="origin")


def _arrow(points: Floats, at: Floats, first: int, axis: int, type_size: float) -> Markup:
    """From the first point to its third neighbour along one axis of the target, where one was found."""
    offsets = points - points[first]
    across = np.abs(np.delete(offsets, axis, axis=1)).max(axis=1)
    neighbours = np.flatnonzero((offsets[:, axis] > 1e-9) & (across < 1e-9))
    if not len(neighbours):
        return Markup("")
    ordered = neighbours[np.argsort(offsets[neighbours, axis])]
    start, end = at[first], at[ordered[min(2, len(ordered) - 1)]]
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    aside = np.array([-along[1], along[0]])
    barbs = [end - type_size * (0.6 * along + s * 0.25 * aside) for s in (-1.0, 1.0)]
    path = "M{:.1f} {:.1f}L{:.1f} {:.1f}M{:.1f} {:.1f}L{:.1f} {:.1f}L{:.1f} {:.1f}".format(
        *start, *end, *barbs[0], *end, *barbs[1]
    )
    u, v = end + along * type_size
    name = element(
        "text",
        "xy"[axis],
        x=float(u),
        y=float(v) + 0.3 * type_size,
        font_size=type_size,
        text_anchor="middle",
        class_=f"axis-{'xy'[axis]}",
    )
    return element("path", d=path, class_=f"axis-{'xy'[axis]}") + name


def _encoded(image: GreyImage) -> str:
    """A small copy of an image as a data address: WebP, or JPEG where OpenCV was built without."""
    import cv2

    height, width = image.shape
    scale = min(WIDTH_PX / width, 1.0)
    size = (max(round(width * scale), 1), max(round(height * scale), 1))
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    grey = _eight_bit(small)
    if cv2.haveImageWriter(".webp"):
        data, kind = cv2.imencode(".webp", grey, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])[1], "webp"
    else:
        data, kind = cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1], "jpeg"
    return f"data:image/{kind};base64,{base64.b64encode(data.tobytes()).decode('ascii')}"


def _eight_bit(image: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """16-bit images hold 10, 12 or 16 bits of light: the brightest pixel becomes white."""
    if image.dtype == np.uint8:
        return image
    return np.rint(image * (255.0 / max(float(image.max()), 1.0))).astype(np.uint8)
