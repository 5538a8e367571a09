"""Uncertainties are honest, and the checks that say so can fail."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sixthlink.files import load_arm
from sixthlink.simulate import SCENARIOS
from sixthlink.study import Plan, PointSummary, Row, Study, planned, run_trial, summaries

CELL = replace(SCENARIOS["paper"], placements=2, poses=8, ruler_placements=4)


@cache
def plan() -> Plan:
    return planned(CELL, load_arm("abb_irb1400", folder=Path()), seed=0)


@cache
def rows_of(trials: int, noise: str = "known", control: str = "none") -> list[Row]:
    study = Study((CELL,), trials, 0, noise, control)
    return [row for trial in range(trials) for row in run_trial(plan(), study, 0, trial)]


def studied(trials: int, noise: str = "known", control: str = "none") -> PointSummary:
    return summaries(rows_of(trials, noise, control))[0]


def refused(summary: PointSummary) -> set[str]:
    return {v.name for v in summary.verdicts if not v.passed}


def test_intervals_hold_residuals_are_as_large_as_the_noise_and_nobody_could_do_better():
    summary = studied(100)
    assert refused(summary) == set(), summary.verdicts
    assert summary.chi2_per_dof.standard_error < 0.02
    assert {q.name.partition(".")[0] for q in summary.quantities} >= {"head", "arm", "p1", "length"}


def test_they_also_hold_when_the_noise_has_to_be_found():
    summary = studied(40, noise="estimated")
    assert refused(summary) == set(), summary.verdicts
    assert summary.joint_noise.value == pytest.approx(1.0, abs=0.05)


def test_understated_noise_is_refused():
    assert {"coverage", "chi2", "mahalanobis"} <= refused(studied(25, control="weights-wrong-by-two"))


def test_weights_that_know_no_covariance_are_refused():
    assert "efficiency" in refused(studied(25, control="unwhitened"))


def test_the_efficient_estimator_attains_the_bound():
    ratios = (
        np.array([(row.efficient_error / row.bound_std) ** 2 for row in rows_of(100, "known", "none") if row.bound_std])
        .reshape(100, -1)
        .mean(axis=1)
    )
    assert ratios.mean() == pytest.approx(1.0, abs=4 * ratios.std() / 10)


def test_a_trial_that_begins_with_pixels_brings_the_lenses_along():
    small = replace(SCENARIOS["small"], ruler_placements=1)
    study = Study((small,), 1, source="pixels")
    rows = run_trial(planned(small, load_arm("abb_irb1400", folder=Path()), seed=0), study, 0, 0)
    lens = [row for row in rows if row.quantity.startswith("lens.")]
    assert len(lens) >= 16
    assert {row.quantity.partition(".")[0] for row in rows} >= {"head", "arm", "p1", "length", "noise"}


def test_the_same_trial_is_the_same_wherever_it_is_run():
    study = Study((CELL,), 3)
    assert run_trial(plan(), study, 0, 2) == run_trial(plan(), study, 0, 2)
    assert run_trial(plan(), study, 0, 1) != run_trial(plan(), study, 0, 2)
