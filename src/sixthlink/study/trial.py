"""What came out of one simulated recording, number by number, beside the truth?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from sixthlink.calibrate.joint import Estimate, estimate
from sixthlink.calibrate.observations import JointState, KnownLengths
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats, motion_between
from sixthlink.solvers import covariance_of_own
from sixthlink.study.design import Study
from sixthlink.study.draw import Draw, drawn_poses, told
from sixthlink.study.pixels import drawn_pixels
from sixthlink.study.plan import Plan
from sixthlink.study.truth import TRUE_NOISE, Bound, bound_at, equivalent_truth

__all__ = ["CHI2", "FAILED", "JOINT_NOISE", "MAHALANOBIS", "REJECTED", "Row", "run_trial"]

CHI2, FAILED, JOINT_NOISE = "chi2_per_dof", "failed", "noise.joints"
MAHALANOBIS, REJECTED = "mahalanobis2_per_dof", "rejected"
"""Rows that are no unknowns; every trial ends with ``CHI2`` or consists of ``FAILED``."""

WITHIN_95 = float(-ndtri(0.025))
"""Half the width of a 95 % interval, in standard deviations."""

MOTION = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")
MOTION_UNITS = ("m", "m", "m", "rad", "rad", "rad")


@dataclass(frozen=True)
class Row:
    """One number of one trial.

    Attributes:
        point: Number of the cell in the study.
        trial: Number of the recording.
        quantity: For example ``head.x``, ``arm.theta2``, ``p1.rotation_z`` or ``length.r3``.
        unit: Its unit.
        truth: True value; of head and placements 0, since their estimate is written as the motion from the truth.
        estimate: What was estimated.
        std: Standard uncertainty as reported; 0 where there is none.
        bound_std: Smallest standard deviation that an unbiased estimator can have; 0 where there is none.
        efficient_error: Error, under the same noise, of the estimator that attains that bound.
    """

    point: int
    trial: int
    quantity: str
    unit: str
    truth: float
    estimate: float
    std: float = 0.0
    bound_std: float = 0.0
    efficient_error: float = 0.0

    @property
    def inside_95(self) -> bool:
        """Whether the 95 % interval contains the truth."""
        return abs(self.estimate - self.truth) <= WITHIN_95 * self.std


def run_trial(plan: Plan, study: Study, point: int, trial: int) -> tuple[Row, ...]:
    """Draw a recording, estimate, and set every number beside the truth.

    The same study and trial give the same rows, wherever and whenever they are run.
    """
    random = np.random.default_rng(np.random.SeedSequence(study.seed, spawn_key=(trial,)))
    try:
        draw = (drawn_pixels if study.source == "pixels" else drawn_poses)(plan, random)
        data, lengths = told(draw, study.control)
        found = estimate(data, noise="stated" if study.noise == "known" else "estimated")
        truth = equivalent_truth(found, draw, plan.Ts_base_target)
    except CalibrationError:
        return (Row(point, trial, FAILED, "-", 0.0, 1.0),)
    bound = bound_at(truth, found, draw)
    columns = (
        *_shared(found, truth, bound, draw),
        *_placements(found, truth, bound),
        *_lengths(found, truth, bound, (draw.lengths, lengths), plan.length_names),
        *_scalars(found, truth),
    )
    return tuple(Row(point, trial, *column) for column in columns)


_Column = tuple[str, str, float, float, float, float, float]


def _shared(found: Estimate, truth: JointState, bound: Bound, draw: Draw) -> list[_Column]:
    """Head, lenses and arm."""
    columns, error = found.problem.columns, _error(found, truth)
    names = [f"head.{m}" for m in MOTION] + [f"lens.{n}" for n in draw.lens_names]
    names += [f"arm.{p.name}" for p in columns.arm]
    units = [*MOTION_UNITS] + [_lens_unit(n) for n in draw.lens_names] + [p.unit for p in columns.arm]
    true = np.concatenate([np.zeros(6), truth.lens_step, truth.arm_step])
    std, bound_std = _std(found.covariance), _std(bound.covariance)
    return [
        (names[k], units[k], *_floats(true[k], true[k] + error[k], std[k], bound_std[k], bound.shared[k]))
        for k in range(columns.size)
    ]


def _lens_unit(name: str) -> str:
    """Unit of a camera's number, for example ``right.fx`` or ``left.rotation_z``."""
    term = name.rpartition(".")[2]
    if term in MOTION:
        return MOTION_UNITS[MOTION.index(term)]
    return "px" if term in ("fx", "fy", "cx", "cy") else "-"


def _placements(found: Estimate, truth: JointState, bound: Bound) -> list[_Column]:
    place = found.fit.own.index("placements")
    covariance = covariance_of_own(found.fit.reduced.own[place], found.covariance)[0]
    error = motion_between(truth.Ts_stand_target, found.fit.state.Ts_stand_target)
    std, bound_std = _std(covariance), _std(bound.own_covariance)
    return [
        (f"p{p + 1}.{m}", unit, *_floats(0.0, error[p, k], std[p, k], bound_std[p, k], bound.own[p, k]))
        for p in range(len(error))
        for k, (m, unit) in enumerate(zip(MOTION, MOTION_UNITS, strict=True))
    ]


def _lengths(
    found: Estimate, truth: JointState, bound: Bound, lengths: tuple[KnownLengths, KnownLengths], names: tuple[str, ...]
) -> list[_Column]:
    """The ruler at every placement, as seen and as told."""
    true, said = lengths
    columns = found.problem.columns
    at_truth = true.linearised(truth, columns)
    there = said.linearised(found.fit.state, columns)
    own = sum(TRUE_NOISE[n] ** 2 * pattern[:, 0, 0] for n, pattern in at_truth.noises.items())
    own_said = sum(found.scales[n] ** 2 * v[:, 0, 0] for n, v in there.noises.items() if n != "standard")
    std = np.sqrt(_carried(there.shared[:, 0], found.covariance) + own_said)
    bound_std = np.sqrt(_carried(at_truth.shared[:, 0], bound.covariance) + own)
    efficient = at_truth.residuals[:, 0] + at_truth.shared[:, 0] @ bound.shared
    measured = true.length_m + there.residuals[:, 0]
    return [
        (f"length.{n}", "m", *_floats(true.length_m, measured[k], std[k], bound_std[k], efficient[k]))
        for k, n in enumerate(names)
    ]


def _scalars(found: Estimate, truth: JointState) -> list[_Column]:
    error = _error(found, truth)
    d = len(error)
    white = found.fit.reduced.factor @ error
    rejected = float(sum(int((~kept).sum()) for kept in found.kept))
    return [
        (JOINT_NOISE, "-", 1.0, float(found.scales["joints"]), 0.0, 0.0, 0.0),
        (REJECTED, "-", 0.0, rejected, 0.0, 0.0, 0.0),
        (MAHALANOBIS, "-", 1.0, float(white @ white) / d, float(np.sqrt(2.0 / d)), 0.0, 0.0),
        (CHI2, "-", 1.0, found.chi2_per_dof, float(np.sqrt(2.0 / max(found.dof, 1))), 0.0, 0.0),
    ]


def _error(found: Estimate, truth: JointState) -> Floats:
    """Error ``(G,)`` of the shared unknowns."""
    state = found.fit.state
    assert state.X is not None  # noqa: S101
    assert truth.X is not None  # noqa: S101
    return np.concatenate(
        [motion_between(truth.X, state.X), state.lens_step - truth.lens_step, state.arm_step - truth.arm_step]
    )


def _carried(J: Floats, covariance: Floats) -> Floats:
    return np.asarray(np.einsum("ri,ij,rj->r", J, covariance, J), dtype=np.float64)


def _std(covariance: Floats) -> Floats:
    return np.asarray(np.sqrt(np.einsum("...ii->...i", covariance)), dtype=np.float64)


def _floats(*values: float) -> tuple[float, float, float, float, float]:
    a, b, c, d, e = (float(v) for v in values)
    return a, b, c, d, e
