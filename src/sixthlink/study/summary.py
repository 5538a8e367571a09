"""Do the intervals hold, is the noise of the stated size, and could anybody do better?

Coverage counts. Efficiency is the Cramér-Rao variance over the mean square error. The efficient estimator of
:mod:`~sixthlink.study.truth` met the same noise, and its mean square error is known beforehand: it is the bound. What
it shows by chance is therefore taken off (a control variate), which leaves far less to chance than plain averaging.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import bdtr, bdtrc, ndtr

from sixthlink.geometry import Floats
from sixthlink.study.trial import CHI2, FAILED, JOINT_NOISE, MAHALANOBIS, REJECTED, Row

__all__ = ["Mean", "PointSummary", "Quantity", "Verdict", "summaries"]

COVERAGE, COVERAGE_MARGIN, CHI2_MARGIN, EFFICIENCY = 0.95, 0.02, 0.02, 0.95
"""What is asked: 93-97 % of the 95 % intervals hold, χ² per degree of freedom 0.98-1.02, efficiency 0.95."""

STANDARD_ERRORS = 4.0
"""Distance beyond which chance is no explanation: few trials widen the bounds to this, 2,000 hardly do."""

CHANCE = float(ndtr(-STANDARD_ERRORS))
"""The same as a probability, for counts, whose chance is known exactly."""

FEWEST_FOR_EFFICIENCY = 20
"""Trials from which a mean square error and its standard error say something."""


@dataclass(frozen=True)
class Mean:
    """An average over trials, with its Monte Carlo standard error."""

    value: float
    standard_error: float


@dataclass(frozen=True)
class Quantity:
    """One unknown or one measured length, over all trials in which it was free.

    Attributes:
        name: As in the table.
        unit: Its unit.
        count: Number of trials.
        rms_error: Root mean square error.
        std: Root mean square of the reported standard uncertainties.
        bound_std: Root mean square of the smallest possible standard deviations.
        coverage: Share of 95 % intervals that contain the truth.
        efficiency: Cramér-Rao variance over mean square error, the efficient estimator's luck taken off where known.
        plain_efficiency: The same without taking anything off.
    """

    name: str
    unit: str
    count: int
    rms_error: float
    std: float
    bound_std: float
    coverage: Mean
    efficiency: Mean
    plain_efficiency: Mean


@dataclass(frozen=True)
class Verdict:
    """One question, and whether the trials answer it with yes.

    Attributes:
        name: For example ``coverage``.
        passed: Whether the trials are compatible with what is asked.
        message: Figures and limits in words.
    """

    name: str
    passed: bool
    message: str


@dataclass(frozen=True)
class PointSummary:
    """One cell of the study.

    Attributes:
        point: Its number.
        trials: Recordings that were estimated.
        failed: Recordings whose estimate did not settle.
        quantities: Unknowns and lengths.
        chi2_per_dof: Mean over the trials.
        mahalanobis2_per_dof: Squared distance of all shared unknowns together to the truth, per unknown.
        joint_noise: Mean size of the joints' noise, as a multiple of the true one.
        rejected: Mean number of shots called wrong, none of which is.
        coverage: Mean over all quantities.
        efficiency: Mean over all quantities.
        verdicts: Coverage, noise and efficiency.
    """

    point: int
    trials: int
    failed: int
    quantities: tuple[Quantity, ...]
    chi2_per_dof: Mean
    mahalanobis2_per_dof: Mean
    joint_noise: Mean
    rejected: Mean
    coverage: Mean
    efficiency: Mean
    verdicts: tuple[Verdict, ...]

    @property
    def passed(self) -> bool:
        """Whether every verdict is yes."""
        return all(v.passed for v in self.verdicts)


def summaries(rows: Iterable[Row], source: str = "poses") -> tuple[PointSummary, ...]:
    """Summary of every cell of a table.

    Args:
        rows: The table.
        source: What its trials begin with. The luck of the efficient estimator is only known where nothing but
            drawn noise separates it from the truth: from poses.
    """
    by_point: dict[int, dict[str, list[Row]]] = {}
    for row in rows:
        by_point.setdefault(row.point, {}).setdefault(row.quantity, []).append(row)
    return tuple(_summary(point, by_point[point], lucky=source == "poses") for point in sorted(by_point))


def _summary(point: int, by_name: dict[str, list[Row]], *, lucky: bool) -> PointSummary:
    failed = len(by_name.pop(FAILED, []))
    scalars = {n: _mean([r.estimate for r in by_name.pop(n, [])]) for n in (CHI2, MAHALANOBIS, JOINT_NOISE, REJECTED)}
    trials = max((len(rows) for rows in by_name.values()), default=0)
    quantities = tuple(_quantity(rows, lucky=lucky) for rows in by_name.values())
    coverage = _mean_coverage(by_name)
    efficiencies = [q.efficiency.value for q in quantities]
    # The quantities of one trial share their noise: the mean is no better known than one of them on average.
    spread = float(np.mean([q.efficiency.standard_error for q in quantities])) if quantities else 0.0
    efficiency = Mean(float(np.mean(efficiencies)) if quantities else 0.0, spread)
    return PointSummary(
        point,
        trials,
        failed,
        quantities,
        chi2_per_dof=scalars[CHI2],
        mahalanobis2_per_dof=scalars[MAHALANOBIS],
        joint_noise=scalars[JOINT_NOISE],
        rejected=scalars[REJECTED],
        coverage=coverage,
        efficiency=efficiency,
        verdicts=(
            _coverage(quantities, coverage),
            _near_one("chi2", "χ² per degree of freedom", scalars[CHI2]),
            _near_one("mahalanobis", "squared distance to the truth per unknown", scalars[MAHALANOBIS]),
            _efficient(quantities, efficiency),
            Verdict("settled", failed == 0, f"{failed} of {failed + trials} estimates did not settle"),
        ),
    )


def _mean_coverage(by_name: dict[str, list[Row]]) -> Mean:
    """Mean share of intervals that hold; the numbers of one trial share their noise and count once."""
    per_trial: dict[int, list[bool]] = {}
    for rows in by_name.values():
        for row in rows:
            per_trial.setdefault(row.trial, []).append(row.inside_95)
    return _mean([float(np.mean(inside)) for inside in per_trial.values()])


def _quantity(rows: Sequence[Row], *, lucky: bool) -> Quantity:
    n = len(rows)
    squares = np.array([(r.estimate - r.truth) ** 2 for r in rows])
    efficient = np.array([r.efficient_error**2 for r in rows])
    bound = float(np.mean([r.bound_std**2 for r in rows]))
    covered = float(np.mean([r.inside_95 for r in rows]))
    return Quantity(
        name=rows[0].quantity,
        unit=rows[0].unit,
        count=n,
        rms_error=float(np.sqrt(squares.mean())),
        std=float(np.sqrt(np.mean([r.std**2 for r in rows]))),
        bound_std=float(np.sqrt(bound)),
        coverage=Mean(covered, float(np.sqrt(COVERAGE * (1.0 - COVERAGE) / n))),
        efficiency=_ratio(bound, squares - efficient + bound if lucky else squares),
        plain_efficiency=_ratio(bound, squares),
    )


def _ratio(bound: float, squares: Floats) -> Mean:
    """Bound over the mean of the squares, with the standard error that the mean's causes."""
    mean = _mean(squares.tolist())
    ratio = bound / mean.value
    return Mean(ratio, ratio * mean.standard_error / mean.value)


def _mean(values: Sequence[float]) -> Mean:
    if not values:
        return Mean(0.0, 0.0)
    error = float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0
    return Mean(float(np.mean(values)), error)


def _coverage(quantities: Sequence[Quantity], mean: Mean) -> Verdict:
    out = [q for q in quantities if _is_off(q)]
    mean_off = abs(mean.value - COVERAGE) > max(COVERAGE_MARGIN, STANDARD_ERRORS * mean.standard_error)
    low, high = (pick((q.coverage.value for q in quantities), default=0.0) for pick in (min, max))
    worst = "".join(f"; {q.name} {100 * q.coverage.value:.1f} %" for q in sorted(out, key=_chance)[:3])
    message = (
        f"95 % intervals hold in {100 * mean.value:.2f} ± {100 * mean.standard_error:.2f} % on average, "
        f"{100 * low:.1f}-{100 * high:.1f} % over {len(quantities)} quantities, {len(out)} outside the limits{worst}"
    )
    return Verdict("coverage", not out and not mean_off, message)


def _is_off(q: Quantity) -> bool:
    return abs(q.coverage.value - COVERAGE) > COVERAGE_MARGIN and _chance(q) < CHANCE


def _chance(q: Quantity) -> float:
    """Chance of a coverage at least as far to the same side of 95 %."""
    held = round(q.coverage.value * q.count)
    return float(min(bdtr(held, q.count, COVERAGE), bdtrc(held - 1, q.count, COVERAGE) if held else 1.0))


def _near_one(name: str, title: str, mean: Mean) -> Verdict:
    passed = abs(mean.value - 1.0) <= max(CHI2_MARGIN, STANDARD_ERRORS * mean.standard_error)
    return Verdict(name, passed, f"{title} {mean.value:.4f} ± {mean.standard_error:.4f}")


def _efficient(quantities: Sequence[Quantity], mean: Mean) -> Verdict:
    def short(q: Quantity) -> bool:
        return q.efficiency.value < EFFICIENCY - STANDARD_ERRORS * q.efficiency.standard_error

    judged = [q for q in quantities if q.count >= FEWEST_FOR_EFFICIENCY]
    out = [q for q in judged if short(q)]
    worst = "".join(
        f", lowest {q.efficiency.value:.3f} ± {q.efficiency.standard_error:.3f} ({q.name})"
        for q in sorted(judged, key=lambda q: q.efficiency.value)[:1]
    )
    message = f"efficiency {mean.value:.3f} on average{worst}, {len(out)} below {EFFICIENCY}"
    enough = mean.value >= EFFICIENCY - STANDARD_ERRORS * mean.standard_error
    return Verdict("efficiency", not out and enough, message)
