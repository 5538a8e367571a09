"""What do the errors look like?

Two plots: errors of the length standard per placement, and the residual of eq. (10) per shot. Small print is
12 units high on drawings that are 420 or 860 units wide; the page scales them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from sixthlink.calibrate import ShotEvidence
from sixthlink.geometry import Floats
from sixthlink.report.quantities import SPACE, fixed, millimetres
from sixthlink.report.svg import Scale, drawing, element, line, shortened, text, ticks
from sixthlink.units import DEG, MM

__all__ = ["ErrorSeries", "error_plot", "residual_plot"]

NARROW, WIDE = 420.0, 860.0


@dataclass(frozen=True, eq=False)
class ErrorSeries:
    """Signed errors ``(R,)`` [m] under a name; ``role`` is its class in the style sheet.

    ``halves_m`` are the half widths of their 95 % intervals [m], where they are known.
    """

    name: str
    role: str
    errors_m: Floats
    halves_m: Floats | None = None

    @property
    def reach_m(self) -> float:
        """How far the errors and their intervals reach from zero [m]."""
        halves_m = 0.0 if self.halves_m is None else self.halves_m
        return float((np.abs(self.errors_m) + halves_m).max(initial=0.0))


def error_plot(placements: Sequence[str], series: Sequence[ErrorSeries], *, band_m: float, label: str) -> Markup:
    """Errors per placement as dots on one scale about zero.

    Args:
        placements: Names of the R placements.
        series: What to show.
        band_m: Half width of the band in which the certified length itself is uncertain [m].
        label: What the plot shows, in words.
    """
    height, left, right, top, bottom = 250.0, 46.0, 8.0, 12.0, 34.0
    largest = max(s.reach_m for s in series) / MM
    reach = 1.12 * max(largest, band_m / MM, 1e-4)
    y = Scale(-reach, reach, height - bottom, top)
    x = Scale(-0.5, len(placements) - 0.5, left, NARROW - right)
    marks, decimals = ticks(-reach, reach, 6)
    parts = [_band(x, y, band_m / MM)]
    for mark in marks:
        role = "axis" if abs(mark) < 1e-12 else "grid"
        parts += [line(left, y(mark), NARROW - right, y(mark), role)]
        parts += [text(left - 6, y(mark) + 4, fixed(mark, decimals), "tick", anchor="end")]
    every = -(-len(placements) // 20)
    for k in range(0, len(placements), every):
        parts.append(text(x(k), height - bottom + 16, str(k + 1), "tick", anchor="middle"))
    parts.append(text(left, height - 3, "error in mm by number of the placement", "tick"))
    for one in series:
        for k, error in enumerate(one.errors_m):
            if one.halves_m is not None:
                low, high = (float(error + side * one.halves_m[k]) / MM for side in (-1.0, 1.0))
                parts.append(line(x(k), y(low), x(k), y(high), f"interval {one.role}"))
            tip = element("title", f"{one.name}, {placements[k]}: {millimetres(float(error), sign=True)}")
            dot = element("circle", tip, cx=x(k), cy=y(float(error) / MM), r=4, class_=f"dot {one.role}")
            parts += [line(x(k), y(0.0), x(k), y(float(error) / MM), f"stem {one.role}"), dot]
    return drawing(NARROW, height, parts, label=label)


def residual_plot(shots: Sequence[ShotEvidence]) -> Markup:
    """Residuals of eq. (10) per shot, millimetres above degrees, by placement, the worst of each named."""
    groups = list(dict.fromkeys(s.placement for s in shots))
    ordered = sorted(shots, key=lambda s: groups.index(s.placement))
    x = Scale(0.0, float(len(ordered)), 52.0, WIDE - 8.0)
    panel, gap = 150.0, 22.0
    parts = _group_shades(ordered, groups, x, 2 * panel + gap)
    shifts_mm = np.array([s.translation_m for s in ordered]) / MM
    turns_deg = np.array([s.rotation_rad for s in ordered]) / DEG
    below = Scale(0.0, 1.0, 2 * panel + gap, panel + gap)
    parts += _bars(ordered, shifts_mm, x, Scale(0.0, 1.0, panel, 0.0), unit=f"{SPACE}mm", name="distance in mm")
    parts += _bars(ordered, turns_deg, x, below, unit="°", name="angle in degrees")
    return drawing(
        WIDE,
        2 * panel + gap + 24.0,
        parts,
        label=f"Residual of each of {len(ordered)} shots in millimetres and in degrees, by placement",
    )


def _band(x: Scale, y: Scale, half_mm: float) -> Markup:
    return element(
        "rect", x=x.start, y=y(half_mm), width=x.end - x.start, height=y(-half_mm) - y(half_mm), class_="band"
    )


def _group_shades(ordered: Sequence[ShotEvidence], groups: Sequence[str], x: Scale, height: float) -> list[Markup]:
    """Every other placement on a shade, its name below."""
    parts: list[Markup] = []
    first = 0
    for k, name in enumerate(groups):
        count = sum(s.placement == name for s in ordered)
        left, width = x(first), x(first + count) - x(first)
        if k % 2 == 0:
            parts.append(element("rect", x=left, y=0.0, width=width, height=height, class_="shade"))
        words = shortened(name, width)
        if words:
            parts.append(text(left + width / 2, height + 16, words, "tick", anchor="middle"))
        first += count
    return parts


def _bars(
    ordered: Sequence[ShotEvidence], values: Floats, x: Scale, room: Scale, *, unit: str, name: str
) -> list[Markup]:
    """One panel in the height of ``room``: bars, round values, RMS and the name of the worst shot."""
    worst, rms = int(np.argmax(values)), float(np.sqrt(np.mean(values**2)))
    y = Scale(0.0, 1.28 * max(float(values.max()), 1e-4), room.start, room.end)
    marks, decimals = ticks(0.0, y.high, 4)
    parts = [line(x.start, y(m), x.end, y(m), "axis" if m == 0.0 else "grid") for m in marks]
    parts += [text(x.start - 6, y(m) + 4, fixed(m, decimals), "tick", anchor="end") for m in marks]
    width = x(1.0) - x(0.0)
    gap = min(0.18 * width, 2.0)
    for k, shot in enumerate(ordered):
        value = float(values[k])
        parts.append(
            element(
                "rect",
                element("title", f"{shot.shot}, {shot.placement}: {fixed(value, 4)}{unit}"),
                x=x(k) + gap,
                y=y(value),
                width=width - 2 * gap,
                height=y(0.0) - y(value),
                class_="bar worst" if k == worst else "bar",
            )
        )
    parts.append(line(x.start, y(rms), x.end, y(rms), "level"))
    parts.append(text(x.start + 5, room.end + 12, name, "note"))
    parts.append(text(x.end - 5, room.end + 12, f"dashed: RMS {fixed(rms, 4)}{unit}", "note", anchor="end"))
    words = f"{shortened(ordered[worst].shot, 120.0)} {fixed(float(values[worst]), 4)}{unit}"
    half = 3.6 * len(words)
    at = min(max(x(worst + 0.5), x.start + half), x.end - half)
    parts.append(text(at, y(float(values[worst])) - 5, words, "worst", anchor="middle"))
    return parts
