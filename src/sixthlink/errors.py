"""What can go wrong, and what does the user do about it?

::

    SixthlinkError
    ├── InputError              the user's files or options are at fault (exit code 2); carries every finding at once
    │   └── IndependenceError   verification was asked to judge shots that the calibration has already seen
    ├── CalibrationError        the files are fine but the data cannot carry the estimate (exit code 2)
    │   ├── TooFewShotsError    fewer usable shots than the estimate needs
    │   ├── DegenerateMotionError  the motion leaves a direction of the head unseen
    │   └── NoCircleError       the points of a joint sweep show no axis (calibrate.tracker, with its findings)
    ├── Cancelled               the user stopped a long step; nothing was written
    └── Interrupted             long work was stopped that can be gone on with; what was finished is kept
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

__all__ = [
    "CalibrationError",
    "Cancelled",
    "DegenerateMotionError",
    "Finding",
    "IndependenceError",
    "InputError",
    "Interrupted",
    "SixthlinkError",
    "TooFewShotsError",
]


@dataclass(frozen=True)
class Finding:
    """One thing wrong with the input.

    Attributes:
        where: File, or the option, that is at fault.
        line: One-based line number, 0 when the whole file is meant.
        column: One-based column (character in YAML, cell in CSV), 0 when the whole line is meant.
        field: Name of the field, for example ``robot.positions`` or ``q3``.
        what: What was found.
        expected: What was expected instead.
        cure: What to do now.
    """

    where: str
    field: str
    what: str
    expected: str
    cure: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        place = ":".join([self.where, *(str(n) for n in (self.line, self.column) if n)])
        expected = f", expected {self.expected}" if self.expected else ""
        cure = f"; {self.cure}" if self.cure else ""
        return f"{place}: {self.field}: {self.what}{expected}{cure}"


class SixthlinkError(Exception):
    """Root of every error that sixthlink raises on purpose."""


class InputError(SixthlinkError):
    """The user's input is at fault; ``findings`` lists everything that was found, not just the first."""

    def __init__(self, findings: Sequence[Finding]) -> None:
        self.findings = tuple(findings)
        super().__init__("\n".join(str(f) for f in self.findings))


class IndependenceError(InputError):
    """A verification shot was already used for calibration."""


class CalibrationError(SixthlinkError):
    """The data cannot carry the estimate; the message says what is missing."""


class TooFewShotsError(CalibrationError):
    """Fewer usable shots than the estimate needs.

    Attributes:
        needed: Shots that are needed.
        usable: Shots that were usable.
    """

    def __init__(self, message: str, *, needed: int, usable: int) -> None:
        self.needed = needed
        self.usable = usable
        super().__init__(message)

    def because(self, reasons: Iterable[str]) -> TooFewShotsError:
        """The same with a line for each shot that was refused before, and why."""
        lines = "".join(f"\n  {reason}" for reason in reasons)
        return TooFewShotsError(f"{self}{lines}", needed=self.needed, usable=self.usable)


class DegenerateMotionError(CalibrationError):
    """The robot's motion leaves at least one direction of the head unseen; ``directions`` names them."""

    def __init__(self, message: str, *, directions: Sequence[str] = ()) -> None:
        self.directions = tuple(directions)
        super().__init__(message)


class Cancelled(SixthlinkError):  # noqa: N818 - a wish of the user, not an error of anybody
    """The user stopped a long step; nothing was written."""


class Interrupted(SixthlinkError):  # noqa: N818 - often a wish of the user, not an error of anybody
    """Long work was stopped that can be gone on with; the message says what was kept."""
