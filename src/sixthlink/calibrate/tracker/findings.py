"""What is wrong with a sweep, in words that say cause and cure?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from sixthlink.errors import CalibrationError
from sixthlink.units import DEG, MM

__all__ = ["CircleFinding", "NoCircleError", "degrees", "millimetres", "some"]


@dataclass(frozen=True)
class CircleFinding:
    """One thing that a sweep tells about itself.

    Attributes:
        kind: A short name, for example ``short arc`` or ``outliers``.
        words: One sentence: what, why, what to do.
        figures: The numbers of the sentence by name and unit.
        grave: Whether the axis must not be used; otherwise the finding has been dealt with, or cannot hurt.
    """

    kind: str
    words: str
    figures: Mapping[str, float] = field(default_factory=dict)
    grave: bool = True

    def __str__(self) -> str:
        return f"{self.kind}: {self.words}"


class NoCircleError(CalibrationError):
    """The points of a sweep show no axis at all; ``findings`` say why."""

    def __init__(self, findings: Sequence[CircleFinding]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join(str(f) for f in self.findings))


def millimetres(length_m: float) -> str:
    """A length for a sentence."""
    return f"{length_m / MM:.3g} mm"


def degrees(angle_rad: float) -> str:
    """An angle for a sentence."""
    return f"{angle_rad / DEG:.3g}°"


def some(indices: Sequence[int], texts: Sequence[str] | None = None) -> str:
    """The first few of many points by their places in the sweep, counted from 1, with what belongs to each."""
    parts = [f"{i + 1}" + (f" ({texts[k]})" if texts else "") for k, i in enumerate(indices[:6])]
    rest = len(indices) - len(parts)
    return ("points " if len(indices) > 1 else "point ") + ", ".join(parts) + (f" and {rest} more" if rest else "")
