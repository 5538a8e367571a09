"""Do the points turn about the axis as the joint's angles say?

Point k should stand at the phase q_k + φ, one φ per reflector. What is left along the circle is not used for the axis;
it tells the axis' sense, and betrays a column of another joint, a wrong unit, and rows that have changed places.
Equations (C9) and (C10) of docs/theory/circle_points.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from sixthlink.calibrate.tracker.findings import CircleFinding, degrees, some
from sixthlink.geometry import Floats, Ints
from sixthlink.units import DEG

__all__ = ["Turning", "arc_of", "judged_turning", "turning"]

EXPLAINED = 0.05
"""Share of the arc that half of the points may be off where the angles still count as theirs."""

FALSE_ALARM = 1e-3

FEW = 0.1
"""Share of the points whose angles may be wrong without the sweep being so."""

SCALE_TOLERANCE = 1e-3
"""Error of a joint's scale that is an arm's own, not a mistake; a tenth of what makes a finding grave."""

MADE_GAUSSIAN = 1.4826


@dataclass(frozen=True, eq=False)
class Turning:
    """How phases follow the joint's angles.

    Attributes:
        sense: 1 where the points turn with the joint about the given axis, -1 where against it.
        offsets_rad: ``(M,)`` phase of each reflector at joint angle zero [rad].
        residuals_rad: ``(N,)`` phase of each point less q + φ [rad].
        scale: Turn of the points per turn of the joint.
        scale_uncertainty: Its standard uncertainty.
        wrong: ``(N,)`` whether a point does not lie where its angle says.
        follows: Whether the points follow the angles at all.
    """

    sense: int
    offsets_rad: Floats
    residuals_rad: Floats
    scale: float
    scale_uncertainty: float
    wrong: npt.NDArray[np.bool_]
    follows: bool


def arc_of(phases_rad: Floats) -> float:
    """The shortest arc that holds all phases [rad]: a whole turn less the largest gap."""
    sorted_phases = np.sort(np.mod(phases_rad, 2.0 * np.pi))
    gaps = np.diff(np.r_[sorted_phases, sorted_phases[:1] + 2.0 * np.pi])
    return float(2.0 * np.pi - gaps.max(initial=0.0)) if len(phases_rad) else 0.0


def turning(
    phases_rad: Floats,
    angles_rad: Floats,
    reflectors: Ints,
    kept: npt.NDArray[np.bool_],
    *,
    doubts_rad: Floats,
    noise_rad: float,
) -> Turning:
    """Fit phases by angles (C9).

    Args:
        phases_rad: ``(N,)`` phases about the axis.
        angles_rad: ``(N,)`` angles of the joint.
        reflectors: ``(N,)`` which circle each point is on, 0 to M - 1.
        kept: ``(N,)`` whether each point is on its circle; the others are not asked.
        doubts_rad: ``(N, P)`` what the axis' own uncertainty does to the phases; their covariance is D Dᵀ.
        noise_rad: Phase noise that the tracker alone makes.
    """
    M = int(reflectors.max()) + 1
    trials = []
    for sense in (1, -1):
        offsets = np.array([_offset((sense * phases_rad - angles_rad)[kept & (reflectors == k)]) for k in range(M)])
        residuals = _wrapped(sense * phases_rad - angles_rad - offsets[reflectors])
        trials.append((float(np.median(np.abs(residuals[kept]))), sense, offsets, residuals))
    median, sense, offsets, residuals = min(trials, key=lambda trial: trial[0])
    arc = max(arc_of(phases_rad[kept & (reflectors == k)]) for k in range(M))
    follows = median < EXPLAINED * arc and float(np.ptp(angles_rad[kept])) > EXPLAINED * arc
    if not follows:
        return Turning(sense, offsets, residuals, float(sense), 0.0, np.zeros(len(residuals), dtype=bool), False)
    good = kept & (np.abs(residuals) <= max(6.0 * MADE_GAUSSIAN * median, 10.0 * noise_rad))
    scale, uncertainty, shifts, wrong = _line(
        angles_rad, residuals, reflectors, good, doubts=doubts_rad, noise_rad=noise_rad
    )
    return Turning(sense, offsets + shifts, residuals - shifts[reflectors], scale, uncertainty, wrong & kept, True)


def _line(
    q: Floats,
    residuals: Floats,
    reflectors: Ints,
    good: npt.NDArray[np.bool_],
    *,
    doubts: Floats,
    noise_rad: float,
) -> tuple[float, float, Floats, npt.NDArray[np.bool_]]:
    """Scale by least squares of the good points, offsets at scale 1, and which points are wrong (C10)."""
    M = int(reflectors.max()) + 1
    rows = np.zeros((len(q), 1 + M))
    rows[:, 0] = q - q.mean()
    rows[np.arange(len(q)), 1 + reflectors] = 1.0
    dof = int(np.count_nonzero(good)) - rows.shape[1]
    solved = np.linalg.lstsq(rows[good], residuals[good], rcond=None)[0]
    left = residuals - rows @ solved
    spread = float(np.sqrt(np.sum(left[good] ** 2) / max(dof, 1))) + 1e-14
    inverse = np.linalg.pinv(rows[good].T @ rows[good])
    wrong = np.zeros(len(q), dtype=bool)
    if dof > 0:
        # Only points that the first look found far may be wrong, and only if the others say so.
        t = float(stdtrit(dof, 1.0 - 0.5 * FALSE_ALARM / len(q)))
        reach = t * np.sqrt(spread**2 * (1.0 + np.einsum("ni,ij,nj->n", rows, inverse, rows)) + noise_rad**2)
        wrong = ~good & (np.abs(left) > reach)
    shifts = np.array([_mean(residuals, good & (reflectors == k)) for k in range(M)])
    # An axis that is off to one side makes all phases grow too fast or too slowly.
    of_axis = float(np.linalg.norm(inverse[0] @ rows[good].T @ doubts[good]))
    return 1.0 + float(solved[0]), float(np.hypot(spread * np.sqrt(inverse[0, 0]), of_axis)), shifts, wrong


def _mean(values: Floats, chosen: npt.NDArray[np.bool_]) -> float:
    return float(values[chosen].mean()) if chosen.any() else 0.0


def _offset(differences: Floats) -> float:
    """The difference that most of the others are close to."""
    if len(differences) == 0:
        return 0.0
    candidates = differences[np.unique(np.linspace(0, len(differences) - 1, 60).round().astype(np.int64))]
    medians = np.median(np.abs(_wrapped(differences[None] - candidates[:, None])), axis=1)
    start = float(candidates[int(np.argmin(medians))])
    return start + float(np.median(_wrapped(differences - start)))


def _wrapped(angles: Floats) -> Floats:
    return np.mod(angles + np.pi, 2.0 * np.pi) - np.pi


def judged_turning(
    turned: Turning, phases_rad: Floats, angles_rad: Floats, reflectors: Ints
) -> tuple[CircleFinding, ...]:
    """What the angles tell about the sweep; arguments as for :func:`turning`, points by their places in it."""
    if not turned.follows:
        return (_not_following(phases_rad, angles_rad, reflectors),)
    found = []
    off = turned.scale - 1.0
    if abs(off) > max(6.0 * turned.scale_uncertainty, SCALE_TOLERANCE):
        words = (
            f"the points turn {turned.scale:.5g} times as far as the joint column says "
            f"(± {turned.scale_uncertainty:.1g}): a wrong gear ratio, or a second joint that moved along; check the "
            "column and the joint's gear"
        )
        grave = abs(off) > 10.0 * SCALE_TOLERANCE
        found.append(CircleFinding("joint scale", words, {"scale": turned.scale}, grave))
    if turned.wrong.any():
        found.append(_wrong_angles(turned, angles_rad, reflectors))
    return tuple(found)


def _wrong_angles(turned: Turning, angles_rad: Floats, reflectors: Ints) -> CircleFinding:
    wrong = np.flatnonzero(turned.wrong)
    grave = len(wrong) >= FEW * len(angles_rad)
    figures = {"points": float(len(wrong)), "largest_rad": float(np.abs(turned.residuals_rad[wrong]).max())}
    right = turned.residuals_rad[~turned.wrong]
    tolerance = 6.0 * float(np.std(right)) + 1e-12
    # Where should point i have stood to be right? At the angle of which other point?
    needed = angles_rad[wrong] + turned.residuals_rad[wrong]
    matches = np.abs(_wrapped(needed[:, None] - angles_rad[wrong][None])) < tolerance
    matches &= (reflectors[wrong][:, None] == reflectors[wrong][None]) & ~np.eye(len(wrong), dtype=bool)
    places = [f"{degrees(turned.residuals_rad[i])} off" for i in wrong[:6].tolist()]
    if len(wrong) > 1 and (matches.sum(axis=0) == 1).all() and (matches.sum(axis=1) == 1).all():
        words = (
            f"{some(wrong.tolist(), places)} stand where others of them should: rows have changed places; "
            "pair points and joint angles anew"
        )
        return CircleFinding("out of order", words, figures, grave)
    words = (
        f"{some(wrong.tolist(), places)} along the circle from where the joint angle says: the angle was read before "
        "the joint stood still, or written wrongly; correct or remove these rows"
    )
    return CircleFinding("wrong angles", words, figures, grave)


def _not_following(phases_rad: Floats, angles_rad: Floats, reflectors: Ints) -> CircleFinding:
    """Why do the points not follow the angles? Judged on the reflector with most points."""
    most = reflectors == np.argmax(np.bincount(reflectors))
    psi, q = phases_rad[most], angles_rad[most]
    arc, span = arc_of(psi), float(np.ptp(q))
    turned = f"the points turn {degrees(arc)} about their axis"
    if span < SCALE_TOLERANCE * arc:
        words = (
            f"{turned} but the joint column stays at {degrees(q[0])}: it is another joint's; choose the swept joint's "
            "column"
        )
        return CircleFinding("wrong joint", words, {"arc_rad": arc, "angles_rad": span})
    order = np.argsort(q, kind="stable")
    path = np.unwrap(psi[order])
    slope, middle = np.polyfit(q[order], path, 1)
    if np.std(path - slope * q[order] - middle) < EXPLAINED * arc:
        words = (
            f"the points turn {abs(slope):.4g} times as far as the joint column says"
            f"{_unit_words(abs(float(slope)))}; correct the column's unit or choose the swept joint's column"
        )
        return CircleFinding("joint scale", words, {"scale": abs(float(slope))})
    if _pairs_when_sorted(psi, q):
        words = f"{turned} and so does the joint, but not in the order of the rows: pair points and joint angles anew"
        return CircleFinding("out of order", words, {"points": float(len(q)), "arc_rad": arc})
    words = (
        f"{turned} but not with the joint column, which moves by {degrees(span)}: it is another joint's, or "
        "another joint turned; check which joint moved"
    )
    return CircleFinding("wrong joint", words, {"arc_rad": arc, "angles_rad": span})


def _unit_words(scale: float) -> str:
    if abs(scale * DEG - 1.0) < 0.02:
        return ": radians were read as degrees"
    if abs(scale / DEG - 1.0) < 0.02:
        return ": degrees were read as radians"
    return ": another unit, a gear, or another joint that moved along"


def _pairs_when_sorted(psi: Floats, q: Floats) -> bool:
    """Whether phases and angles, each put in order from the largest gap on, advance together."""
    phases, angles = np.sort(np.mod(psi, 2.0 * np.pi)), np.sort(q)
    start = (int(np.argmax(np.diff(np.r_[phases, phases[0] + 2.0 * np.pi]))) + 1) % len(phases)
    phases = np.unwrap(np.roll(phases, -start))
    step = float(np.median(np.diff(phases)))
    for path in (phases, -phases[::-1]):
        off = path - angles
        if float(np.abs(off - np.median(off)).max()) < 0.5 * step:
            return True
    return False
