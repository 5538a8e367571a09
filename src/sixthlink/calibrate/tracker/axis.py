"""Where is the axis of the joint that was swept, how surely, and is the sweep fit to say so?

The circles of all reflectors share the axis. Covariance from the final Jacobian; its size from the stated noise or,
where none is stated or the points deny it, from the deviations. Theory: docs/theory/circle_points.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc, stdtrit

from sixthlink.calibrate.tracker.belonging import Belonging, belonging, freedom, noise_variance
from sixthlink.calibrate.tracker.coaxial import (
    Coaxial,
    normal_covariance,
    phase_rows,
    phases_of,
    refooted,
    reversed_axis,
    whitened,
)
from sixthlink.calibrate.tracker.findings import CircleFinding
from sixthlink.calibrate.tracker.misfit import misfit
from sixthlink.calibrate.tracker.shape import judged_fit, refuse_without_circle
from sixthlink.calibrate.tracker.sweep import Sweep
from sixthlink.calibrate.tracker.turning import Turning, arc_of, judged_turning, turning
from sixthlink.geometry import Circle, Floats, Ints, Line, frozen_floats

__all__ = ["AxisFit", "axis_covariance", "circle_covariance", "fit_axis"]

Mask = npt.NDArray[np.bool_]

DOUBT = 1e-3
"""Chance of the deviations under the stated noise below which they, not the statement, size the covariance."""


@dataclass(frozen=True, eq=False)
class AxisFit:
    """The axis of a sweep.

    Attributes:
        axis: The axis; its point is the foot at the mean height of the points. It points so that points turn about it
            by the right-hand rule as the joint's angle grows; without angles, as the points follow each other.
        circles: One circle per reflector, with the axis' direction as normal.
        frame: ``(3, 3)`` rows: two unit vectors across the axis, and its direction.
        covariance: ``(4 + 2M, 4 + 2M)`` of: shift of the foot along the first two rows of the frame [m], tilt of the
            direction towards them [rad], then height and radius of each circle [m].
        reflectors: ``(N,)`` the circle of each point.
        deviations_m: ``(N, 2)`` how far each point lies outside its circle and above its plane [m].
        kept: ``(N,)`` whether each point belongs.
        noise_m: Standard deviation per direction that the deviations show [m].
        noise_ratio: The same over the stated noise; 1 where none was stated.
        dof: Degrees of freedom of the fit.
        noise_known: Whether the covariance rests on the stated noise; otherwise intervals need Student's factor.
        arcs_rad: ``(M,)`` arc on which each reflector was seen [rad].
        turning: How the phases follow the angles; None without angles.
        findings: Everything that the sweep tells about itself.
    """

    axis: Line
    circles: tuple[Circle, ...]
    frame: Floats
    covariance: Floats
    reflectors: Ints
    deviations_m: Floats
    kept: npt.NDArray[np.bool_]
    noise_m: float
    noise_ratio: float
    dof: int
    noise_known: bool
    arcs_rad: Floats
    turning: Turning | None
    findings: tuple[CircleFinding, ...]

    def __post_init__(self) -> None:
        N, P = len(self.kept), len(self.covariance)
        for name, shape in (("frame", (3, 3)), ("covariance", (P, P)), ("deviations_m", (N, 2)), ("arcs_rad", (None,))):
            object.__setattr__(self, name, frozen_floats(getattr(self, name), shape, name))
        kept = self.kept.copy()
        kept.flags.writeable = False
        object.__setattr__(self, "kept", kept)

    @property
    def usable(self) -> bool:
        """Whether no finding forbids using the axis."""
        return not any(f.grave for f in self.findings)

    @property
    def signed(self) -> bool:
        """Whether the joint's angles have decided which way the axis points."""
        return self.turning is not None and self.turning.follows

    @property
    def direction_uncertainty_rad(self) -> float:
        """Standard uncertainty of the direction, along its least certain tilt [rad]."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[2:4, 2:4])[-1]))

    @property
    def position_uncertainty_m(self) -> float:
        """Standard uncertainty of the foot, across the axis along its least certain shift [m]."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[:2, :2])[-1]))

    @property
    def radial_rms_m(self) -> float:
        """RMS distance of the points that belong from their circles, in the plane [m]."""
        return float(np.sqrt(np.mean(self.deviations_m[self.kept, 0] ** 2)))

    @property
    def plane_rms_m(self) -> float:
        """RMS distance of the points that belong from their planes [m]."""
        return float(np.sqrt(np.mean(self.deviations_m[self.kept, 1] ** 2)))

    @property
    def tangential_m(self) -> Floats:
        """How far each point lies along its circle from where the joint's angle says ``(N,)``; zeros without angles."""
        if self.turning is None:
            return np.zeros(len(self.kept))
        radii = np.array([c.radius_m for c in self.circles])
        return self.turning.residuals_rad * radii[self.reflectors]

    def expansion(self, coverage: float = 0.95) -> float:
        """Factor from standard uncertainty to the half-width of an interval: Student's where the noise is estimated."""
        dof = np.inf if self.noise_known else float(self.dof)
        return float(stdtrit(min(dof, 1e9), 0.5 + 0.5 * coverage))


def fit_axis(sweep: Sweep) -> AxisFit:
    """Axis and circles of one sweep, with everything that is wrong with it.

    Args:
        sweep: The points of one joint sweep.

    Returns:
        The fit; look at ``usable`` before the axis is used.

    Raises:
        NoCircleError: The points show no circle: too few, standing still or on one line.
    """
    refuse_without_circle(sweep)
    found = belonging(sweep)
    circles = refooted(found.circles, sweep, found.kept.astype(np.float64))
    circles, turned = _directed(circles, sweep, found.kept)
    covariance, noise_ratio, known = _covariance(circles, sweep, found.kept)
    deviations = whitened(circles, sweep)[0]
    noise_m = noise_ratio if sweep.covariances_m2 is None else _rms_m(deviations, found.kept, sweep)
    fit = AxisFit(
        axis=Line(circles.origin_m, circles.frame[2]),
        circles=tuple(
            Circle(circles.origin_m + h * circles.frame[2], circles.frame[2], np.abs(r))
            for h, r in zip(circles.heights_m, circles.radii_m, strict=True)
        ),
        frame=circles.frame,
        covariance=covariance,
        reflectors=sweep.reflectors,
        deviations_m=deviations,
        kept=found.kept,
        noise_m=noise_m,
        noise_ratio=noise_ratio if sweep.covariances_m2 is not None else 1.0,
        dof=freedom(found.kept, sweep),
        noise_known=known,
        arcs_rad=_arcs(circles, sweep, found.kept),
        turning=turned,
        findings=(),
    )
    return replace(fit, findings=_findings(fit, circles, sweep, found))


def _directed(circles: Coaxial, sweep: Sweep, kept: Mask) -> tuple[Coaxial, Turning | None]:
    """The axis pointed by the joint's angles (C9), or by the order of the points where they are silent."""
    turned = _turning(circles, sweep, kept)
    if turned is not None and turned.follows:
        forward = turned.sense > 0
    else:
        steps = np.diff(phases_of(circles, sweep)[sweep.reflectors == 0])
        forward = float(np.sum(np.mod(steps + np.pi, 2.0 * np.pi) - np.pi)) >= 0.0
    if forward:
        return circles, turned
    circles = reversed_axis(circles)
    return circles, _turning(circles, sweep, kept)


def _turning(circles: Coaxial, sweep: Sweep, kept: Mask) -> Turning | None:
    if sweep.angles_rad is None:
        return None
    covariance = _covariance(circles, sweep, kept)[0]
    # The square root of a covariance that rounding may have left a hair below positive.
    sizes, directions = np.linalg.eigh(covariance[:4, :4])
    doubts = phase_rows(circles, sweep) @ (directions * np.sqrt(np.maximum(sizes, 0.0)))
    noise_m = sweep.rounding_m + _rms_m(whitened(circles, sweep)[0], kept, sweep)
    radii = np.abs(circles.radii_m)
    noise_rad = noise_m / max(float(radii.max()), sweep.rounding_m)
    # On the axis a phase is nothing but noise: such reflectors are not asked unless all are there.
    heard = radii > 0.1 * radii.max()
    return turning(
        phases_of(circles, sweep),
        sweep.angles_rad,
        sweep.reflectors,
        kept & heard[sweep.reflectors],
        doubts_rad=doubts,
        noise_rad=noise_rad,
    )


def _covariance(circles: Coaxial, sweep: Sweep, kept: Mask) -> tuple[Floats, float, bool]:
    """Covariance, the noise over the stated one [-] or in metres, and whether the stated noise was believed."""
    _, r, J = whitened(circles, sweep)
    inverse = normal_covariance(J[kept])
    dof, variance = freedom(kept, sweep), noise_variance(r, kept, sweep)
    believed = sweep.covariances_m2 is not None and float(chdtrc(dof, variance * dof)) > DOUBT
    return (inverse if believed else variance * inverse), float(np.sqrt(variance)), believed


def _rms_m(deviations: Floats, kept: Mask, sweep: Sweep) -> float:
    return float(np.sqrt(np.sum(deviations[kept] ** 2) / max(freedom(kept, sweep), 1)))


def _arcs(circles: Coaxial, sweep: Sweep, kept: Mask) -> Floats:
    phases = phases_of(circles, sweep)
    return np.array([arc_of(phases[kept & (sweep.reflectors == k)]) for k in range(len(sweep.names))])


def _findings(fit: AxisFit, circles: Coaxial, sweep: Sweep, found: Belonging) -> tuple[CircleFinding, ...]:
    """The cause first: what does not lie on a circle says little about arcs and angles."""
    cause = misfit(sweep, found)
    findings = judged_fit(
        sweep,
        kept=fit.kept,
        deviations_m=fit.deviations_m,
        arcs_rad=fit.arcs_rad,
        radii_m=np.abs(circles.radii_m),
        noise_m=fit.noise_m,
        direction_uncertainty_rad=fit.direction_uncertainty_rad,
        explained=cause is not None,
    )
    if cause is not None:
        return (cause, *findings)
    if fit.turning is None or sweep.angles_rad is None:
        return findings
    return findings + judged_turning(fit.turning, phases_of(circles, sweep), sweep.angles_rad, sweep.reflectors)


def axis_covariance(fit: AxisFit) -> Floats:
    """Covariance ``(6, 6)`` of the foot [m] and the direction as vectors of the tracker's frame; its rank is 4."""
    J = np.zeros((6, 4))
    J[:3, :2] = fit.frame[:2].T
    J[3:, 2:] = fit.frame[:2].T
    return J @ fit.covariance[:4, :4] @ J.T


def circle_covariance(fit: AxisFit, reflector: int) -> Floats:
    """Covariance ``(6, 6)`` of one circle: centre [m] in the tracker's frame, two tilts [rad], radius [m]."""
    e1, e2, n = fit.frame
    height = float((fit.circles[reflector].centre_m - fit.axis.point_m) @ n)
    J = np.zeros((6, len(fit.covariance)))
    J[:3, 0], J[:3, 1], J[:3, 2], J[:3, 3] = e1, e2, height * e1, height * e2
    J[:3, 4 + 2 * reflector] = n
    J[3, 2] = J[4, 3] = J[5, 5 + 2 * reflector] = 1.0
    return J @ fit.covariance @ J.T
