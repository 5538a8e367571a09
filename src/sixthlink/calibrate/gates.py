"""What must a calibration answer with yes before it is accepted?"""

from __future__ import annotations

from sixthlink.calibrate.calibration import Gate
from sixthlink.calibrate.head import GAP_TOLERANCE, Certificate

__all__ = ["gates_of"]

MINIMUM_USED_SHARE = 0.5
"""Share of the calibration shots that must have been usable for the result to be accepted."""


def gates_of(recorded: int, used: int, certificate: Certificate) -> tuple[Gate, ...]:
    """The gates of a calibration with ``used`` of ``recorded`` shots."""
    return (
        _gate(
            "enough shots used",
            used >= MINIMUM_USED_SHARE * recorded,
            f"{used} of {recorded} calibration shots were usable, at least {MINIMUM_USED_SHARE:.0%} are needed",
            "the rejections say what to change",
        ),
        _gate(
            "proven minimum",
            certificate.certified,
            f"eq. (11) is within {certificate.relative_gap:.1e} of its proven lower bound, at most "
            f"{GAP_TOLERANCE:.0e} is accepted",
            "more swarms or iterations help, or shots with less noise",
        ),
    )


def _gate(name: str, passed: bool, figure: str, cure: str) -> Gate:
    """A gate whose message carries the cure only where one is needed."""
    return Gate(name, passed, figure if passed else f"{figure}; {cure}")
