"""What does a joint estimate's doubt look like?

The error budget as a waterfall of variance shares, and a dot with its 95 % interval, small enough for a table's cell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from markupsafe import Markup

from sixthlink.calibrate import Budget
from sixthlink.measure import COVERAGE_95
from sixthlink.report.quantities import SPACE, fixed, millimetres
from sixthlink.report.svg import Scale, drawing, element, line, text

__all__ = ["IntervalScale", "budget_plot"]

WIDTH, ROW, BAR = 860.0, 27.0, 14.0
LEFT, RIGHT, AT_LENGTH, AT_SHARE = 145.0, 660.0, 765.0, 850.0
CELL_WIDTH, CELL_HEIGHT = 190.0, 18.0


def budget_plot(budget: Budget) -> Markup:
    """Shares of the variance of a measured length, each beginning where the one above it ends."""
    measuring, leaving = "measuring", "leaving"
    parts = [
        ("joint repeatability", budget.repeatability_m, measuring),
        ("pixels", budget.pixels_m, measuring),
        ("arm geometry", budget.arm_m, leaving),
        ("head", budget.head_m, leaving),
        ("lens", budget.lens_m, leaving),
        ("target", budget.target_m, leaving),
    ]
    total = max(budget.std_m**2, 1e-30)
    x = Scale(0.0, 1.0, LEFT, RIGHT)
    bottom = ROW * (len(parts) + 1) + 6.0
    drawn = [line(x(k / 4), 0.0, x(k / 4), bottom, "axis" if k == 0 else "grid") for k in range(5)]
    drawn += [text(x(k / 4), bottom + 15, f"{25 * k}{SPACE}%", "tick", anchor="middle") for k in range(5)]
    done = 0.0
    whole: list[Markup] = []
    for row, (name, std_m, role) in enumerate(parts):
        drawn.append(text(LEFT - 10, _baseline(row), name, anchor="end"))
        if std_m is None:
            drawn.append(text(AT_LENGTH, _baseline(row), "not stated", "note", anchor="end"))
            continue
        share = std_m**2 / total
        tip = f"{name}: {millimetres(std_m)}, {_percent(share)} of the variance"
        span = x(done), x(done + share)
        drawn += [_bar(span, row, role, tip), *_numbers(row, std_m, share)]
        whole.append(_bar(span, len(parts), role, tip))
        done += share
    last = len(parts)
    drawn += [line(0.0, ROW * last + 3.0, AT_SHARE, ROW * last + 3.0, "grid"), *whole]
    drawn += [text(LEFT - 10, _baseline(last), "together", "sum", anchor="end")]
    drawn += _numbers(last, budget.std_m, 1.0, "sum")
    label = f"Shares of the variance of a length of {millimetres(budget.reference_length_m, 0)}"
    return drawing(WIDTH, bottom + 20.0, drawn, label=label)


@dataclass(frozen=True)
class IntervalScale:
    """Dots with intervals on one scale about zero, one to a table's row.

    Attributes:
        reach: Largest value that the cells show.
        band: Half width of the shaded middle; 0 for none.
    """

    reach: float
    band: float = 0.0

    def head(self) -> Markup:
        """The scale itself, for the head of the column."""
        x = self._x()
        power = 10.0 ** math.floor(math.log10(self.reach))
        step = max(m * power for m in (1.0, 2.0, 5.0) if m * power <= self.reach)
        decimals = max(-math.floor(math.log10(step) + 1e-9), 0)
        marks = (-step, 0.0, step)
        written = [text(x(m), 12.0, fixed(m, decimals, sign=True), "tick", anchor="middle") for m in marks]
        return drawing(CELL_WIDTH, 15.0, written, label="scale")

    def cell(self, value: float, std: float, label: str) -> Markup:
        """One dot with its 95 % interval; ``label`` says both in words."""
        x, middle, half = self._x(), CELL_HEIGHT / 2, COVERAGE_95 * std
        parts = [line(x(0.0), 0.0, x(0.0), CELL_HEIGHT, "axis")]
        if self.band > 0.0:
            width = x(self.band) - x(-self.band)
            parts.insert(0, element("rect", x=x(-self.band), y=0.0, width=width, height=CELL_HEIGHT, class_="band"))
        parts.append(line(x(value - half), middle, x(value + half), middle, "interval"))
        parts.append(element("circle", cx=x(value), cy=middle, r=3.5, class_="dot after"))
        return drawing(CELL_WIDTH, CELL_HEIGHT, parts, label=label)

    def _x(self) -> Scale:
        return Scale(-self.reach, self.reach, 14.0, CELL_WIDTH - 14.0)


def _baseline(row: int) -> float:
    return ROW * row + ROW / 2 + 7.0


def _bar(span: tuple[float, float], row: int, role: str, tip: str) -> Markup:
    """A bar that is seen even where its share is nothing."""
    start, end = span
    return element(
        "rect",
        element("title", tip),
        x=start,
        y=ROW * row + (ROW - BAR) / 2 + 3.0,
        width=max(end - start, 1.5),
        height=BAR,
        class_=f"share {role}",
    )


def _numbers(row: int, std_m: float, share: float, role: str = "") -> list[Markup]:
    return [
        text(AT_LENGTH, _baseline(row), millimetres(std_m), role, anchor="end"),
        text(AT_SHARE, _baseline(row), _percent(share), role or "note", anchor="end"),
    ]


def _percent(share: float) -> str:
    return f"{fixed(100.0 * share, 1)}{SPACE}%"
