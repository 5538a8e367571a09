"""How close to their circles do the points of each sweep lie, and how far off was the arm where it had not looked?

One small panel per sweep on one common scale, its points along the arc; and the cumulative shares of the held-out
errors before and after. Small print is 12 units high on drawings that are 420 or 860 units wide; the page scales them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from sixthlink.calibrate.tracked_arm import TrackedArm
from sixthlink.calibrate.tracker import AxisFit
from sixthlink.geometry import Floats
from sixthlink.recording import TrackerRecord
from sixthlink.report.circle_scene import COLOURS, along_arc, evenly
from sixthlink.report.quantities import SPACE, fixed, significant
from sixthlink.report.svg import Scale, drawing, element, line, outline, shortened, text, ticks
from sixthlink.units import DEG, MM

__all__ = ["MOST_DOTS", "MOST_PANELS", "deviation_plot", "heldout_plot"]

NARROW, WIDE = 420.0, 860.0

MOST_PANELS, MOST_DOTS = 12, 120
"""Sweeps that get a panel, and points that each of them shows."""

COLUMNS, GAP, LEFT = 3, 18.0, 44.0
PANEL, HEAD, FOOT = 104.0, 36.0, 20.0
"""Height of a panel's plot, of the words above it and of the scale below."""

LARGE_M = 0.5 * MM
"""Deviation from which millimetres are written rather than micrometres."""

SMALLEST_MM = 1e-9
"""Error that stands for none on a logarithmic scale."""


@dataclass(frozen=True, eq=False)
class _Panel:
    """The points of one sweep.

    Attributes:
        name: Name of the sweep.
        role: Class of the joint that moved.
        along_rad: ``(N,)`` place of each point along its arc [rad].
        deviations_m: ``(N, 2)`` how far it lies outside its circle and above its plane [m].
        kept: ``(N,)`` whether it belongs.
        fit: The axis.
    """

    name: str
    role: str
    along_rad: Floats
    deviations_m: Floats
    kept: npt.NDArray[np.bool_]
    fit: AxisFit


@dataclass(frozen=True)
class _Unit:
    """In which unit deviations are written."""

    name: str
    metres: float


@dataclass(frozen=True, eq=False)
class _Curve:
    """Sorted errors under a name that is their class; places on the scale are log10 of millimetres.

    Attributes:
        name: ``before`` or ``after``.
        errors_mm: ``(N,)`` [mm], rising.
    """

    name: str
    errors_mm: Floats

    @property
    def places(self) -> Floats:
        """Place of each error ``(N,)``."""
        return np.asarray(np.log10(np.maximum(self.errors_mm, SMALLEST_MM)))

    @property
    def median(self) -> float:
        """Place of the median error."""
        return math.log10(max(float(np.median(self.errors_mm)), SMALLEST_MM))

    @property
    def largest(self) -> float:
        """Place of the largest error."""
        return float(self.places[-1])


def deviation_plot(result: TrackedArm, record: TrackerRecord) -> Markup:
    """Radial and plane deviations of every sweep along its arc; empty where no sweep shows a circle.

    Args:
        result: The calibration.
        record: The record that it is of.
    """
    panels = list(_panels(result, record))
    if not panels:
        return Markup("")
    largest_m = max(float(np.abs(p.deviations_m[p.kept]).max(initial=0.0)) for p in panels)
    unit = _Unit("mm", MM) if largest_m > LARGE_M else _Unit("µm", 1e-3 * MM)
    reach = 1.1 * max(largest_m, 1e-9) / unit.metres
    width = (WIDE - LEFT - (COLUMNS - 1) * GAP) / COLUMNS
    row_height = HEAD + PANEL + FOOT
    parts: list[Markup] = []
    for k, panel in enumerate(panels):
        row, column = divmod(k, COLUMNS)
        left, top = LEFT + column * (width + GAP), row * row_height + HEAD
        y = Scale(-reach, reach, top + PANEL, top)
        x = Scale(0.0, max(float(panel.along_rad[panel.kept].max(initial=0.0)), 1e-3), left + 7.0, left + width - 7.0)
        parts += _frame(panel, x, y, unit, labelled=column == 0)
        parts += _deviations(panel, x, y, unit)
    rows = -(-len(panels) // COLUMNS)
    label = f"Radial and plane deviations in {unit.name} of the points of {len(panels)} sweeps along their arcs"
    return drawing(WIDE, rows * row_height, parts, label=label)


def heldout_plot(result: TrackedArm) -> Markup:
    """Share of the points that are off by at most so much, before and after, with median and maximum."""
    height, left, right, top, bottom = 284.0, 44.0, 18.0, 38.0, 38.0
    errors = {"before": result.heldout_before, "after": result.heldout}
    curves = sorted((_Curve(n, np.sort(e.distances_m) / MM) for n, e in errors.items()), key=lambda c: c.median)
    high = max(c.largest for c in curves) + 0.08
    # The few smallest errors are hits by chance and would only stretch the scale.
    low = max(min(float(np.quantile(c.places, 0.02)) for c in curves), high - 4.0)
    # The lesser median has its words on its left.
    x = Scale(min(low, (curves[0].median - 0.26 * high) / 0.74), high, left, NARROW - right)
    y = Scale(0.0, 100.0, height - bottom, top)
    parts: list[Markup] = []
    for mark in (0.0, 25.0, 50.0, 75.0, 100.0):
        parts.append(line(left, y(mark), NARROW - right, y(mark), "axis" if mark == 0.0 else "grid"))
        parts.append(text(left - 6, y(mark) + 4, f"{mark:.0f}{SPACE}%", "tick", anchor="end"))
    for mark in _round_values(x.low, x.high):
        at = x(math.log10(mark))
        parts.append(line(at, y(0.0), at, y(100.0), "grid"))
        parts.append(text(at, height - bottom + 16, significant(mark, 1), "tick", anchor="middle"))
    parts.append(text(left, height - 4, "share of the points whose error is at most so many mm", "tick"))
    for rank, curve in enumerate(curves):
        parts += _rising(curve, x, y, rank)
    return drawing(NARROW, height, parts, label="Cumulative shares of the held-out errors in mm, before and after")


def _panels(result: TrackedArm, record: TrackerRecord) -> Iterator[_Panel]:
    """Declared sweeps before implied ones; of too many an even choice."""
    declared = [s for s in result.sweeps if s.fit is not None and not s.implied]
    implied = [s for s in result.sweeps if s.fit is not None and s.implied]
    chosen = [declared[k] for k in evenly(len(declared), MOST_PANELS)]
    chosen += [implied[k] for k in evenly(len(implied), max(MOST_PANELS - len(declared), 0))]
    for sweep in chosen:
        if sweep.fit is None:
            continue
        fit, points = sweep.fit, record.points[sweep.rows]
        along = np.zeros(len(points))
        for k, circle in enumerate(fit.circles):
            mine = fit.reflectors == k
            if fit.kept[mine].any():
                along[mine] = along_arc(circle, points[mine], fit.kept[mine])[1]
        name = sweep.name if sweep.usable else f"{sweep.name} (not usable)"
        yield _Panel(name, f"g{sweep.joint % COLOURS}", along, fit.deviations_m, fit.kept, fit)


def _frame(panel: _Panel, x: Scale, y: Scale, unit: _Unit, *, labelled: bool) -> list[Markup]:
    """The name with the RMS, the scale of deviations, and how long the arc is."""
    left, right = x.start - 7.0, x.end + 7.0
    radial, plane = (significant(rms / unit.metres, 3) for rms in (panel.fit.radial_rms_m, panel.fit.plane_rms_m))
    parts = [
        text(left, y.end - 21, shortened(panel.name, right - left), f"label {panel.role}"),
        text(left, y.end - 6, f"RMS radial {radial}, plane {plane}{SPACE}{unit.name}", "note"),
    ]
    marks, decimals = ticks(y.low, y.high, 4)
    for mark in marks:
        parts.append(line(left, y(mark), right, y(mark), "axis" if abs(mark) < 1e-12 else "grid"))
        if labelled:
            parts.append(text(left - 5, y(mark) + 4, fixed(mark, decimals), "tick", anchor="end"))
    parts.append(text(left, y.start + 14, "0°", "tick"))
    parts.append(text(right, y.start + 14, f"{fixed(x.high / DEG, 0)}°", "tick", anchor="end"))
    return parts


def _deviations(panel: _Panel, x: Scale, y: Scale, unit: _Unit) -> list[Markup]:
    """Plane deviations hollow, radial ones full; what was left out as a cross, at the edge where it lies beyond."""
    parts: list[Markup] = []
    shown = evenly(len(panel.kept), MOST_DOTS)
    shown = np.union1d(shown, np.flatnonzero(~panel.kept)[:MOST_DOTS])
    for column, role in ((1, "plane"), (0, "radial")):
        for k in shown.tolist():
            at = x(float(np.clip(panel.along_rad[k], x.low, x.high)))
            value = float(panel.deviations_m[k, column]) / unit.metres
            if panel.kept[k]:
                parts.append(element("circle", cx=at, cy=y(value), r=2.4, class_=f"dot {role} {panel.role}"))
            elif column == 0:
                off = float(np.linalg.norm(panel.deviations_m[k])) / unit.metres
                inside = y(float(np.clip(value, 0.95 * y.low, 0.95 * y.high)))
                tip = element("title", f"left out: {significant(off, 3)}{SPACE}{unit.name} from its circle")
                cross = f"M{at - 3.5:.1f} {inside - 3.5:.1f}l7 7m0 -7l-7 7"
                parts.append(element("path", tip, d=cross, class_="left-out"))
    return parts


def _round_values(low: float, high: float) -> Sequence[float]:
    """1, 2 and 5 times powers of ten between two values, told by their logarithms; of many decades the powers alone."""
    steps = (1.0, 2.0, 5.0) if high - low < 2.6 else (1.0,)
    powers = range(math.floor(low), math.ceil(high) + 1)
    return [m * 10.0**p for p in powers for m in steps if low <= math.log10(m) + p <= high]


def _rising(curve: _Curve, x: Scale, y: Scale, rank: int) -> list[Markup]:
    """Sorted errors as a rising curve; the lesser median is written above to the left, the other below to the right."""
    N = len(curve.places)
    shown = evenly(N, 300)
    across = [x(max(place, x.low)) for place in curve.places[shown].tolist()]
    upward = [y(100.0 * (k + 1) / N) for k in shown.tolist()]
    parts = [outline(np.column_stack([across, upward]), f"curve {curve.name}", closed=False)]
    u, v = x(curve.median), y(50.0)
    side, lines, anchor = ((-8.0, (-16.0, -2.0), "end"), (8.0, (14.0, 28.0), "start"))[rank]
    for words, down in zip(("median", _millimetres(curve.median)), lines, strict=True):
        parts.append(text(u + side, v + down, words, curve.name, anchor=anchor))
    parts.append(element("circle", cx=u, cy=v, r=3.5, class_=f"dot {curve.name}"))
    u, v = x(curve.largest), y(100.0)
    parts.append(text(u + 5.0, v - 8.0 - 15.0 * rank, f"max {_millimetres(curve.largest)}", curve.name, anchor="end"))
    parts.append(element("circle", cx=u, cy=v, r=3.5, class_=f"dot {curve.name}"))
    return parts


def _millimetres(place: float) -> str:
    return f"{significant(10.0**place, 3)}{SPACE}mm"
