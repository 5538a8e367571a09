"""What does a reader see first: the verdict, one number with its meaning, and a handful of facts?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate import Calibration, JointEvidence
from sixthlink.measure import COVERAGE_95, LengthCheck, LengthStatistics, statistics
from sixthlink.report.quantities import DASH, SPACE, degrees, fixed, millimetres, pixels

__all__ = ["Verdict", "check_statistics", "facts_of", "verdict_of"]


@dataclass(frozen=True)
class Verdict:
    """The first thing a reader sees.

    Attributes:
        accepted: Whether no gate refuses.
        words: By which gates, in words.
        figure: The headline number with its unit.
        was: The same before calibration; empty when unknown.
        meaning: What the number is.
        advice: What would help most; empty where nobody knows.
    """

    accepted: bool
    words: str
    figure: str
    was: str
    meaning: str
    advice: str = ""


def verdict_of(calibration: Calibration, check: LengthCheck | None) -> Verdict:
    """The verdict; its number is the best proof there is: certified lengths, then the estimate's own doubt."""
    return Verdict(calibration.accepted, _gates(calibration), *_headline(calibration, check), _advice(calibration))


def facts_of(calibration: Calibration, check: LengthCheck | None) -> list[tuple[str, str]]:
    """A handful of figures under the verdict: what, how much."""
    placements = _counted(len(calibration.placements), "placement")
    facts = _doubts(calibration, check)
    facts.append(("shots used", f"{len(calibration.shots)} at {placements}"))
    if calibration.shots:
        scatter = calibration.scatter
        facts.append(("target scatter, RMS", _both(scatter.rms_translation_m, scatter.rms_rotation_rad)))
    if check is not None:
        facts.append(("largest length error", millimetres(check_statistics(check)[0].max_abs_m)))
    if calibration.rig is not None and calibration.shots:
        rms_px = float(np.sqrt(np.mean([s.rms_px**2 for s in calibration.shots])))
        facts.append(("image residual, RMS", pixels(rms_px)))
    if calibration.search is not None:
        agreeing = f"{calibration.search.agreeing} of {calibration.search.budget.swarms} swarms"
        facts.append(("search agreement", agreeing))
    return [*facts, ("not used", f"{len(calibration.rejections)} images or shots")]


def check_statistics(check: LengthCheck) -> tuple[LengthStatistics, LengthStatistics | None]:
    """Statistics of the errors after and before; None without a before."""
    certified = check.standard.length_m
    before = None if check.before_m is None else statistics(check.before_m, certified)
    return statistics(check.after_m, certified), before


def _gates(calibration: Calibration) -> str:
    refusing = [g for g in calibration.gates if not g.passed]
    if refusing:
        return "Refused by " + ", ".join(f"“{g.name}”: {g.message}" for g in refusing) + "."
    if calibration.gates:
        return "Every gate passed: " + ", ".join(g.name for g in calibration.gates) + "."
    return "No gate was set, so none refused."


def _headline(calibration: Calibration, check: LengthCheck | None) -> tuple[str, str, str]:
    """Figure, what it was before, and its meaning."""
    budget = calibration.joint.budget if calibration.joint else None
    if check is not None:
        after, before = check_statistics(check)
        meaning = (
            f"RMS error of a certified length of {millimetres(check.standard.length_m)}, "
            f"measured at {_counted(after.count, 'placement')} that the calibration has not seen"
        )
        return millimetres(after.rms_m, 3), millimetres(before.rms_m, 3) if before else "", meaning
    if budget is not None:
        length = millimetres(budget.reference_length_m, 0)
        meaning = f"standard uncertainty (k = 1) of a measured length of {length}, by the calibration’s own account"
        return f"±{SPACE}{millimetres(budget.std_m, 3)}", "", meaning
    if calibration.heldout is not None:
        held = calibration.heldout
        meaning = f"RMS error on {_counted(held.shots, 'shot')} that the calibration has not seen"
        return f"{millimetres(held.rms_translation_m, 3)}, {degrees(held.rms_rotation_rad, 3)}", "", meaning
    rms = millimetres(calibration.scatter.rms_translation_m, 3) if calibration.shots else DASH
    return rms, "", "RMS scatter of the target’s position about its placement: agreement, not accuracy"


def _advice(calibration: Calibration) -> str:
    budget = calibration.joint.budget if calibration.joint else None
    return budget.advice[:1].upper() + budget.advice[1:] if budget else ""


def _doubts(calibration: Calibration, check: LengthCheck | None) -> list[tuple[str, str]]:
    """What the headline does not yet say of lengths, held-out shots and the sum of squares."""
    facts = []
    joint = calibration.joint
    if check is not None and joint is not None and joint.budget is not None:
        name = f"a length of {millimetres(joint.budget.reference_length_m, 0)} is measured to"
        facts.append((name, f"±{SPACE}{millimetres(joint.budget.std_m, 3)} (k = 1)"))
    if check is not None and check.inside_95 is not None:
        inside = f"{np.count_nonzero(check.inside_95)} of {len(check.after_m)}"
        facts.append(("lengths inside their 95 % interval", inside))
    held = calibration.heldout
    if held is not None and (check is not None or (joint is not None and joint.budget is not None)):
        error = _both(held.rms_translation_m, held.rms_rotation_rad)
        facts.append(("held-out error, RMS", f"{error} on {_counted(held.shots, 'shot')}"))
    if joint is not None:
        facts.append(("χ² per degree of freedom", _chi2(joint)))
    return facts


def _chi2(joint: JointEvidence) -> str:
    """The sum of squares beside where chance alone leaves it (Wilson and Hilferty, PNAS 17 (1931), 684)."""
    if joint.dof < 1:
        return DASH
    spread = 2.0 / (9.0 * joint.dof)
    low, high = (max(1.0 - spread + side * COVERAGE_95 * spread**0.5, 0.0) ** 3 for side in (-1.0, 1.0))
    return f"{fixed(joint.chi2_per_dof, 2)} (by chance {fixed(low, 2)} to {fixed(high, 2)})"


def _both(length_m: float, angle_rad: float) -> str:
    return f"{millimetres(length_m)}, {degrees(angle_rad)}"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
