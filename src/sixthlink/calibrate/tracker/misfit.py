"""Why do the points of a sweep not lie on one circle?

Reflectors that were swept together but do not share an axis; two reflectors under one name; a smooth path beside the
circle, because a second joint moved; two circles with different axes; or just more noise than stated. The simplest
explanation is named that leaves hardly more than the best one, and less than a third of the deviations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.tracker.belonging import Belonging, freedom
from sixthlink.calibrate.tracker.coaxial import Coaxial, nearest_circles, start_circles, whitened
from sixthlink.calibrate.tracker.findings import CircleFinding, degrees, millimetres
from sixthlink.calibrate.tracker.mixture import FEWEST, a_third_fits_better, peeled
from sixthlink.calibrate.tracker.path import SmoothPath, smooth_path
from sixthlink.calibrate.tracker.sweep import Sweep, subset
from sixthlink.geometry import Ints, Line, common_normal
from sixthlink.units import MM

__all__ = ["misfit"]

TIMES = 3.0
"""Times the noise from which deviations are a fault."""

ALIKE = 1.5
"""An explanation may leave so many times what the best one leaves, and still be preferred for being simpler."""

CHANCE = 1e-4
"""Chance of a smooth path in noise alone below which it is real."""

SCATTERED = 0.1
"""Share of points off the circle from which they may be another circle's."""


SECOND_JOINT = (
    "a second joint moved too, or the link yields; sweep one joint alone, slowly, and for axis 2 of a coupled arm put "
    "the reflector on the lower arm"
)


@dataclass(frozen=True)
class _Explanation:
    """A finding, and what it leaves of the deviations, whitened or in metres."""

    left: float
    finding: CircleFinding


def misfit(sweep: Sweep, found: Belonging) -> CircleFinding | None:
    """The explanation of deviations that are too large or of too smooth a course, or None where there is neither.

    Args:
        sweep: All points.
        found: Which of them belong to the circles.
    """
    whole = bool(found.kept.all())
    circles = found.circles if whole else nearest_circles(start_circles(sweep), sweep, np.ones(len(sweep.points_m)))
    size, stated = _size(circles, sweep), sweep.covariances_m2 is not None
    if size <= 10.0 * sweep.rounding_m and not stated:
        return None
    scattered = bool(np.count_nonzero(~found.kept) >= SCATTERED * len(sweep.points_m))
    # Few points off the circle are outliers, and would only hide a path; many may be the path.
    path = smooth_path(circles, sweep) if whole or scattered else smooth_path(*_of_the_kept(sweep, found))
    suspect = size > TIMES if stated else scattered or len(sweep.names) > 1 or a_third_fits_better(sweep, size / TIMES)
    tried = [_apart(sweep), *_mixed(sweep)] if suspect else []
    tried.insert(-1, _long_way(path, stated=stated) if path else None)
    explanations = [e for e in tried if e is not None and e.left <= size / TIMES]
    if explanations:
        best = min(e.left for e in explanations)
        return next(e.finding for e in explanations if e.left <= ALIKE * best)
    if scattered:
        return None
    if path and path.chance < CHANCE:
        return _slight_path(path, stated=stated)
    return _noise(*_of_the_kept(sweep, found)) if stated and size > TIMES else None


def _of_the_kept(sweep: Sweep, found: Belonging) -> tuple[Coaxial, Sweep]:
    """The circles of the points that belong, and these points; a reflector may have lost all of its own."""
    part = subset(sweep, found.kept)
    return nearest_circles(start_circles(part), part, np.ones(len(part.points_m))), part


def _size(circles: Coaxial, sweep: Sweep) -> float:
    """RMS of the whitened deviations per degree of freedom; in metres where no noise is stated."""
    every = np.ones(len(sweep.points_m), dtype=bool)
    return float(np.sqrt(np.sum(whitened(circles, sweep)[1] ** 2) / max(freedom(every, sweep), 1)))


@dataclass(frozen=True, eq=False)
class _Separate:
    axes: tuple[Coaxial, ...]
    size: float


def _separately(sweep: Sweep, labels: Ints) -> _Separate | None:
    """A circle with an axis of its own per label; None where one has too few points."""
    squares, dof, axes = 0.0, 0, []
    for label in np.unique(labels).tolist():
        part = subset(sweep, labels == label, labels)
        every = np.ones(len(part.points_m), dtype=bool)
        if len(every) < FEWEST:
            return None
        axes.append(nearest_circles(start_circles(part), part, every.astype(np.float64)))
        squares += float(np.sum(whitened(axes[-1], part)[1] ** 2))
        dof += freedom(every, part)
    return _Separate(tuple(axes), float(np.sqrt(squares / dof)))


def _apart(sweep: Sweep) -> _Explanation | None:
    """Reflectors that turn about different axes."""
    separate = _separately(sweep, sweep.reflectors) if len(sweep.names) > 1 else None
    if separate is None:
        return None
    distance_m, angle_rad = _between(separate.axes[0], separate.axes[1])
    first, second = sweep.names[:2]
    words = (
        f"reflectors {first} and {second} turn about axes {millimetres(distance_m)} and {degrees(angle_rad)} apart: "
        "one of them sits on another link, or on a link that a parallelogram carries; mount both on the link that the "
        "swept joint drives, for axis 2 of a coupled arm on the lower arm"
    )
    figures = {"distance_m": distance_m, "angle_rad": angle_rad}
    return _Explanation(separate.size, CircleFinding("axes differ", words, figures))


def _mixed(sweep: Sweep) -> tuple[_Explanation | None, _Explanation | None]:
    """Several circles under one name: about one axis, and about an axis each."""
    labels = peeled(sweep) if len(sweep.names) == 1 else np.zeros(len(sweep.points_m), dtype=np.int64)
    grouped = labels >= 0
    counts = np.bincount(labels[grouped]).tolist()
    if len(counts) < 2 or np.count_nonzero(~grouped) > SCATTERED * len(labels):
        return None, None
    part = subset(sweep, grouped, labels)
    coaxial = nearest_circles(start_circles(part), part, np.ones(len(part.points_m)))
    shares = " and ".join(str(n) for n in counts)
    figures = {f"points_{k + 1}": float(n) for k, n in enumerate(counts)}
    lengths = " and ".join(f"{length / MM:.6g} mm" for length in coaxial.radii_m.tolist())
    changes = np.flatnonzero(np.diff(labels[grouped]))
    where = (
        f", the second from point {int(np.flatnonzero(grouped)[changes[0] + 1]) + 1} on" if len(changes) == 1 else ""
    )
    moved = " or one that was moved" if where else ""
    words = (
        f"{shares} points lie on circles of radius {lengths} about one axis{where}: two reflectors under one "
        f"name{moved}; give each its own"
    )
    together = _Explanation(_size(coaxial, part), CircleFinding("mixed reflectors", words, figures))
    separate = _separately(subset(sweep, grouped), labels[grouped])
    if separate is None:
        return together, None
    return together, _Explanation(separate.size, _two_axes(separate, labels, shares, figures))


def _two_axes(separate: _Separate, labels: Ints, shares: str, figures: dict[str, float]) -> CircleFinding:
    distance_m, angle_rad = _between(separate.axes[0], separate.axes[1])
    apart = f"{shares} points lie on circles whose axes are {millimetres(distance_m)} and {degrees(angle_rad)} apart"
    figures = figures | {"distance_m": distance_m, "angle_rad": angle_rad}
    places = np.flatnonzero(labels >= 0)
    changes = np.flatnonzero(np.diff(labels[places]))
    if len(changes) == len(separate.axes) - 1 > 1:
        words = f"{apart}, one after the other: {SECOND_JOINT}"
        return CircleFinding("path beside the circle", words, figures)
    if len(changes) != 1:
        return CircleFinding("two axes", f"{apart}: the sweeps of two joints are mixed; separate them", figures)
    place = int(places[changes[0] + 1])
    words = (
        f"{apart}, the second from point {place + 1} on: the tracker, the reflector or another joint moved there, or "
        "two sweeps are in one; measure again or split the sweep"
    )
    return CircleFinding("moved in between", words, figures | {"from_point": float(place + 1)})


def _between(first: Coaxial, second: Coaxial) -> tuple[float, float]:
    """Distance [m], beside the circles, and angle [rad] of two axes, whichever way they point."""
    centre_m = first.origin_m + first.heights_m[0] * first.frame[2]
    other = Line(second.origin_m, second.frame[2])
    angle_rad = float(common_normal(Line(centre_m, first.frame[2]), other).angle_rad)
    gap = centre_m - second.origin_m
    return float(np.linalg.norm(gap - (gap @ second.frame[2]) * second.frame[2])), min(angle_rad, np.pi - angle_rad)


def _long_way(path: SmoothPath, *, stated: bool) -> _Explanation | None:
    """A path beside the circle that is several times the noise."""
    noise = 1.0 if stated else path.left
    if path.chance >= CHANCE or path.before <= TIMES * noise:
        return None
    words = (
        f"the points leave the circle by {millimetres(path.rms_m)} RMS on a smooth path, {_where(path)}, "
        f"{path.before / max(noise, 1e-300):.3g} times {_noise_name(stated=stated)}: {SECOND_JOINT}"
    )
    # The noise is what such a path leaves at best: a path that leaves less has fitted it.
    return _Explanation(path.left, CircleFinding("path beside the circle", words, _figures(path, noise)))


def _slight_path(path: SmoothPath, *, stated: bool) -> CircleFinding:
    noise = 1.0 if stated else path.left
    words = (
        f"the points leave the circle by {millimetres(path.rms_m)} RMS, {path.before / noise:.3g} times "
        f"{_noise_name(stated=stated)}, but on a smooth path, {_where(path)}: the bearing wobbles, the link yields, or "
        "a second joint moved a little; the axis is less certain than stated, check whether another joint moved"
    )
    return CircleFinding("slight path", words, _figures(path, noise), grave=False)


def _where(path: SmoothPath) -> str:
    if path.share_above > 0.7:
        return "mostly along the axis, like a helix or a saddle"
    return "in the plane" if path.share_above < 0.3 else "in the plane and out of it"


def _noise_name(*, stated: bool) -> str:
    return "the stated noise" if stated else "the scatter about that path"


def _figures(path: SmoothPath, noise: float) -> dict[str, float]:
    times = path.before / max(noise, 1e-300)
    return {"rms_m": path.rms_m, "times": times, "share_along_axis": path.share_above}


def _noise(circles: Coaxial, sweep: Sweep) -> CircleFinding | None:
    """Noise beyond what was stated, in no order."""
    times = _size(circles, sweep)
    if times <= TIMES:
        return None
    rms_m = float(np.sqrt(np.mean(whitened(circles, sweep)[0] ** 2)))
    words = (
        f"the points leave the circle by {millimetres(rms_m)} RMS in no order, {times:.3g} times the stated noise: "
        "several joints moved, the reflector was loose, or the noise is stated too small or in a wrong unit; sweep "
        "again, or state the noise with what the robot adds to it"
    )
    return CircleFinding("noise", words, {"rms_m": rms_m, "times": times})
