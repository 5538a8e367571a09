"""How far is a measured length from the certified one?

Source: the paper's Table II, its statistics named for what they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sixthlink.calibrate import MarkPoint
from sixthlink.geometry import Floats, frozen_floats
from sixthlink.recording import Rejection
from sixthlink.target import LengthStandard

__all__ = ["COVERAGE_95", "LengthCheck", "LengthStatistics", "lengths_of_placements", "statistics"]

COVERAGE_95 = 1.959963984540054
"""Standard deviations to either side that hold 95 % of a normal distribution."""


@dataclass(frozen=True)
class LengthStatistics:
    """Statistics of signed length errors, each named for what it is.

    Attributes:
        mean_m: Mean signed error [m].
        mean_abs_m: Mean of the absolute errors [m] (what the paper's Table II calls "Mean").
        rms_m: Root mean square error [m].
        std_m: Standard deviation about the mean, n - 1 in the denominator [m]; 0 for a single length.
        max_abs_m: Largest absolute error [m].
        count: Number of lengths.
    """

    mean_m: float
    mean_abs_m: float
    rms_m: float
    std_m: float
    max_abs_m: float
    count: int


@dataclass(frozen=True, eq=False)
class LengthCheck:
    """The length standard measured at several placements, before and after calibration.

    Attributes:
        standard: The length standard with its certificate.
        placements: Names of its R placements.
        before_m: ``(R,)`` lengths with the nominal head and arm [m], or None when the recording names no nominal head.
        after_m: ``(R,)`` lengths with the calibrated head and arm [m].
        rejections: Shots that could not be measured, and why.
        std_m: ``(R,)`` standard uncertainty of the calibrated lengths [m], or None when the calibration keeps no
            covariance (the head alone, the arm taken as exact).
    """

    standard: LengthStandard
    placements: tuple[str, ...]
    before_m: Floats | None
    after_m: Floats
    rejections: tuple[Rejection, ...]
    std_m: Floats | None = None

    def __post_init__(self) -> None:
        R = len(self.placements)
        object.__setattr__(self, "after_m", frozen_floats(self.after_m, (R,), "after_m"))
        if self.before_m is not None:
            object.__setattr__(self, "before_m", frozen_floats(self.before_m, (R,), "before_m"))
        if self.std_m is not None:
            object.__setattr__(self, "std_m", frozen_floats(self.std_m, (R,), "std_m"))

    @property
    def inside_95(self) -> npt.NDArray[np.bool_] | None:
        """``(R,)`` whether each length's 95 % interval, the certificate's doubt included, holds the certified one."""
        if self.std_m is None:
            return None
        half_width_m = COVERAGE_95 * np.hypot(self.std_m, self.standard.uncertainty_m)
        return np.abs(self.after_m - self.standard.length_m) <= half_width_m


def lengths_of_placements(
    points: tuple[MarkPoint, ...], points_base: Floats, placements: tuple[str, ...]
) -> tuple[tuple[str, ...], Floats]:
    """Distance between the two marks at every placement where both were seen.

    A mark seen in several shots of one placement counts with its mean position.

    Args:
        points: Marks in the head frame.
        points_base: ``(M, 3)`` the same marks in the frame in which the standard stands still [m].
        placements: Placement name of every shot of the recording.

    Returns:
        Names of the R placements with both marks, and ``(R,)`` lengths [m].
    """
    names: list[str] = []
    lengths: list[float] = []
    where = np.array([placements[p.shot] for p in points])
    marks = np.array([p.mark for p in points])
    for name in dict.fromkeys(where.tolist()):
        ends = [points_base[(where == name) & (marks == mark)] for mark in (0, 1)]
        if all(len(end) for end in ends):
            names.append(name)
            lengths.append(float(np.linalg.norm(ends[1].mean(axis=0) - ends[0].mean(axis=0))))
    return tuple(names), np.array(lengths)


def statistics(lengths_m: Floats, certified_m: float) -> LengthStatistics:
    """Statistics of the errors of ``(R,)`` lengths against the certified one [m].

    Raises:
        ValueError: There is no length.
    """
    errors = np.asarray(lengths_m, dtype=np.float64) - certified_m
    if len(errors) == 0:
        raise ValueError("no placement shows both marks of the length standard")
    return LengthStatistics(
        mean_m=float(errors.mean()),
        mean_abs_m=float(np.abs(errors).mean()),
        rms_m=float(np.sqrt(np.mean(errors**2))),
        std_m=float(errors.std(ddof=1)) if len(errors) > 1 else 0.0,
        max_abs_m=float(np.abs(errors).max()),
        count=len(errors),
    )
