"""How does a drawing become markup in which no string can break out?

Every attribute and every text is escaped here, whoever wrote it; the other modules only say what to draw.
Colours and weights are classes of the page's style sheet, so that a drawing follows light, dark and paper.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from sixthlink.geometry import Floats

__all__ = ["Scale", "drawing", "element", "line", "outline", "shortened", "text", "tick_step", "ticks"]


@dataclass(frozen=True)
class Scale:
    """A linear axis: values ``low`` to ``high`` lie at ``start`` to ``end`` of the drawing."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        """Where a value lies."""
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)


def element(tag: str, *children: str, **attributes: object) -> Markup:
    """One element. Plain strings are escaped, markup is kept; ``font_size`` is written ``font-size``."""
    spelled = Markup("").join(
        Markup(' {}="{}"').format(name.rstrip("_").replace("_", "-"), _spelled(value))
        for name, value in attributes.items()
        if value != ""
    )
    if not children:
        return Markup("<{}{}/>").format(tag, spelled)
    return Markup("<{0}{1}>{2}</{0}>").format(tag, spelled, Markup("").join(children))


def drawing(width: float, height: float, parts: Iterable[str], *, label: str) -> Markup:
    """A whole drawing; ``label`` says in words what it shows."""
    return element("svg", *parts, viewBox=f"0 0 {_spelled(width)} {_spelled(height)}", role="img", aria_label=label)


def line(x1: float, y1: float, x2: float, y2: float, role: str) -> Markup:
    """A straight line of a class ``role``."""
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, class_=role)


def text(x: float, y: float, words: str, role: str = "", *, anchor: str = "start") -> Markup:
    """Words at a place."""
    return element("text", words, x=x, y=y, class_=role, text_anchor="" if anchor == "start" else anchor)


def outline(points: Floats, role: str, *, closed: bool = True) -> Markup:
    """A polygon or polyline through ``(N, 2)`` points."""
    spelled = " ".join(f"{_spelled(float(x))},{_spelled(float(y))}" for x, y in np.asarray(points))
    return element("polygon" if closed else "polyline", points=spelled, class_=role)


def shortened(words: str, room: float) -> str:
    """Words cut to fit into ``room`` of the drawing in small print; empty where not even two letters fit."""
    letters = int(room / 6.5)
    if len(words) <= letters:
        return words
    return words[: letters - 1] + "…" if letters >= 3 else ""


def tick_step(span: float, about: int) -> float:
    """The step of 1, 2 or 5 times a power of ten that divides ``span`` into about so many parts."""
    rough = span / about
    power = 10.0 ** math.floor(math.log10(rough))
    return min((1.0, 2.0, 5.0, 10.0), key=lambda m: abs(math.log(m * power / rough))) * power


def ticks(low: float, high: float, about: int = 4) -> tuple[list[float], int]:
    """Round values from ``low`` to ``high``, and the decimals that they need."""
    step = tick_step(high - low, about)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)], max(-math.floor(math.log10(step) + 1e-9), 0)


def _spelled(value: object) -> object:
    if not isinstance(value, float):
        return value
    rounded = f"{value:.1f}".removesuffix(".0")
    return "0" if rounded == "-0" else rounded
