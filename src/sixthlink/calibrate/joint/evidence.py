"""What does a joint estimate leave behind as proof of its numbers?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.arm import parameter_values
from sixthlink.calibrate.joint.blocks import BlockVerdict
from sixthlink.calibrate.joint.estimate import Estimate
from sixthlink.calibrate.observations import Columns
from sixthlink.geometry import Floats, frozen_floats
from sixthlink.robot import Arm
from sixthlink.solvers import covariance_of_own

__all__ = ["ArmEvidence", "Budget", "Correlation", "JointEvidence", "NoiseEvidence", "joint_evidence", "names_of"]

NOTABLE_CORRELATION = 0.9

PRIOR_RULES = 0.9
"""Share of the maker's tolerance from which a standard deviation counts as the tolerance itself."""

_MOTION = (("x", "m"), ("y", "m"), ("z", "m"), ("rotation_x", "rad"), ("rotation_y", "rad"), ("rotation_z", "rad"))
_NOISE_UNITS = {
    "across": "m",
    "along": "m",
    "contact": "m",
    "readings": "m",
    "tilt": "rad",
    "roll": "rad",
    "orientation": "rad",
}


@dataclass(frozen=True)
class ArmEvidence:
    """One parameter of the arm.

    Attributes:
        name: For example ``alpha2``.
        unit: ``m``, ``rad``, ``-`` or ``rad/m``.
        nominal: The maker's value.
        value: The estimated value; the nominal one where it is not free.
        std: Its standard deviation; 0 where it is not free.
        free: Whether it was estimated.
        reason: Why it was not, or that the maker's tolerance says more about it than the data.
    """

    name: str
    unit: str
    nominal: float
    value: float
    std: float
    free: bool
    reason: str


@dataclass(frozen=True)
class NoiseEvidence:
    """Size of the noise of one origin.

    Attributes:
        origin: ``joints``, ``pixels``, ``standard``, or for recorded poses ``across``, ``along``, ``tilt``, ``roll``.
        unit: ``m``, ``rad`` or ``px``; ``-`` for a multiple of what was stated.
        size: The size that the estimate used.
        stated: The size stated beforehand, or None.
    """

    origin: str
    unit: str
    size: float
    stated: float | None


@dataclass(frozen=True)
class Correlation:
    """Two unknowns that the data hardly tell apart."""

    first: str
    second: str
    coefficient: float


@dataclass(frozen=True)
class Budget:
    """Where the uncertainty of a length between two placements comes from, as standard deviations.

    Attributes:
        reference_length_m: Mean of the reference lengths [m].
        std_m: Standard uncertainty of such a length [m]: the root of the sum of the squares below.
        pixels_m: Noise of the head's images while measuring [m].
        lens_m: What the calibration leaves of the cameras [m].
        target_m: What the target's own errors add [m]; None: nobody stated them.
        head_m: What it leaves of the head [m].
        arm_m: What it leaves of the arm's geometry [m].
        repeatability_m: Joint repeatability while measuring [m].
        advice: What would help most.
    """

    reference_length_m: float
    std_m: float
    pixels_m: float
    lens_m: float
    target_m: float | None
    head_m: float
    arm_m: float
    repeatability_m: float
    advice: str


@dataclass(frozen=True, eq=False)
class JointEvidence:
    """The proof of a joint estimate.

    Attributes:
        unknowns: Names of the G shared unknowns: the head's motion in the frame that carries it, cameras, arm.
        covariance: ``(G, G)`` of these [m, rad, pixel, -], widened where the stated noise does not explain the data.
        arm: Every parameter of the arm that was considered.
        blocks: Optional blocks and whether held-out shots asked for them.
        noise: Size of every origin of noise.
        chi2_per_dof: Whitened sum of squares per degree of freedom under the stated noise.
        dof: Degrees of freedom.
        correlations: Pairs of unknowns with a coefficient above 0.9.
        placement_std: ``(P, 6)`` standard deviations of the placements [m, rad].
        budget: Where the uncertainty of a measured length comes from, or None with a single placement.
    """

    unknowns: tuple[str, ...]
    covariance: Floats
    arm: tuple[ArmEvidence, ...]
    blocks: tuple[BlockVerdict, ...]
    noise: tuple[NoiseEvidence, ...]
    chi2_per_dof: float
    dof: int
    correlations: tuple[Correlation, ...]
    placement_std: Floats
    budget: Budget | None = None

    def __post_init__(self) -> None:
        G = len(self.unknowns)
        object.__setattr__(self, "covariance", frozen_floats(self.covariance, (G, G), "covariance"))
        object.__setattr__(self, "placement_std", frozen_floats(self.placement_std, (None, 6), "placement_std"))

    @property
    def head_std(self) -> Mapping[str, float]:
        """Standard deviation of the head's motion by name, in the axes of the frame that carries it [m, rad]."""
        std = np.sqrt(np.diag(self.covariance))
        names = [f"head.{axis}" for axis, _ in _MOTION]
        return {
            f"{axis}_{unit}": float(std[self.unknowns.index(name)])
            for (axis, unit), name in zip(_MOTION, names, strict=True)
            if name in self.unknowns
        }


def names_of(columns: Columns, lens: Sequence[str]) -> tuple[str, ...]:
    """Names of the shared unknowns in the order of their columns."""
    head = [f"head.{axis}" for axis, _ in _MOTION] if columns.head else []
    tool = ["tool.x", "tool.y", "tool.z"] if columns.tool else []
    tool += [f"reflector.{name}.{axis}" for name in columns.reflectors for axis in "xyz"]
    tool += [f"reflector.{columns.reflectors[k]}.{axis}" for k in columns.turned for axis, _ in _MOTION[3:]]
    return (*head, *tool, *lens, *(f"arm.{p.name}" for p in columns.arm))


def joint_evidence(
    nominal: Arm, found: Estimate, verdicts: tuple[BlockVerdict, ...], lens: Sequence[str], stated: Mapping[str, float]
) -> JointEvidence:
    """The proof of an estimate.

    Args:
        nominal: The arm as its maker describes it.
        found: The estimate.
        verdicts: On the optional blocks.
        lens: Names of the cameras' free unknowns.
        stated: Sizes of noise that were stated beforehand.
    """
    columns = found.problem.columns
    covariance = found.covariance
    placements = np.zeros((0, 6))
    if "placements" in found.fit.own:
        rows = found.fit.reduced.own[found.fit.own.index("placements")]
        own = covariance_of_own(rows, covariance)[0]
        placements = np.sqrt(np.einsum("bii->bi", own))
    names = names_of(columns, lens)
    here = {name for linear in found.fit.linear for name in linear.noises}
    noise = tuple(
        NoiseEvidence(n, _NOISE_UNITS.get(n, "-"), s, stated.get(n)) for n, s in found.scales.items() if n in here
    )
    return JointEvidence(
        unknowns=names,
        covariance=covariance,
        arm=_arm_evidence(nominal, found, covariance),
        blocks=verdicts,
        noise=noise,
        chi2_per_dof=found.chi2_per_dof,
        dof=found.dof,
        correlations=_correlations(names, covariance),
        placement_std=placements,
    )


def _arm_evidence(nominal: Arm, found: Estimate, covariance: Floats) -> tuple[ArmEvidence, ...]:
    free = {p.name: k for k, p in enumerate(found.problem.columns.arm)}
    stds = np.sqrt(np.diag(covariance)[found.problem.columns.arm_slice])
    before = parameter_values(nominal, found.parameters)
    after = parameter_values(found.fit.state.arm, found.parameters)
    evidence = []
    for p, seen, old, new in zip(found.parameters, found.visibility, before, after, strict=True):
        std = float(stds[free[p.name]]) if p.name in free else 0.0
        prior_rules = p.name in free and std > PRIOR_RULES * p.sigma
        reason = "the data add little to the maker's tolerance" if prior_rules else seen.reason
        evidence.append(ArmEvidence(p.name, p.unit, float(old), float(new), std, p.name in free, reason))
    return tuple(evidence)


def _correlations(names: Sequence[str], covariance: Floats) -> tuple[Correlation, ...]:
    std = np.sqrt(np.maximum(np.diag(covariance), np.finfo(np.float64).tiny))
    rho = covariance / std[:, None] / std
    i, j = np.nonzero(np.triu(np.abs(rho) > NOTABLE_CORRELATION, k=1))
    found = [Correlation(names[a], names[b], float(rho[a, b])) for a, b in zip(i.tolist(), j.tolist(), strict=True)]
    return tuple(sorted(found, key=lambda c: -abs(c.coefficient)))
