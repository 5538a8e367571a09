"""How does the calibration of an arm from touches explain itself on one page?

The same style, drawings and rules as the page of a head; the arm stands where the head does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from sixthlink.calibrate import NoiseEvidence
from sixthlink.calibrate.touches import ArmCalibration, TouchEvidence
from sixthlink.geometry import Floats
from sixthlink.measure import COVERAGE_95, LengthCheck, statistics
from sixthlink.report.figures import ErrorSeries, error_plot
from sixthlink.report.joint_tables import arm_table, tolerances_in_words
from sixthlink.report.quantities import DASH, fixed, millimetres, significant
from sixthlink.report.tables import Table, length_statistics_table, length_table
from sixthlink.report.templates import template
from sixthlink.units import MM

__all__ = ["touch_page"]

_ORIGINS = {
    "joints": "joint errors that are new with every touch",
    "contact": "ball in its socket",
    "socket": "joint errors that stay while one socket is touched",
    "pose": "joint errors that follow the pose",
    "standard": "certified length",
}


def touch_page(calibration: ArmCalibration, *, check: LengthCheck | None = None, created: str = "") -> str:
    """A calibration as one self-contained HTML page.

    Args:
        calibration: What to explain.
        check: The gauge, read at places that the calibration has not seen.
        created: When the page was made, for people.

    Returns:
        The page, to be written as UTF-8.
    """
    return template("touch_page.html").render(
        calibration=calibration,
        created=created,
        headline=_headline(calibration, check),
        facts=_facts(calibration),
        gauge=_gauge(check) if check else None,
        arm=arm_table(calibration.arm, calibration.joint.arm),
        tolerances=tolerances_in_words(calibration.arm, calibration.joint.arm),
        noise=_noise_table(calibration.joint.noise),
        sockets=_socket_table(calibration),
        touches=_touch_table(calibration.touches),
        rejections=(*calibration.rejections, *(check.rejections if check else ())),
    )


def _headline(c: ArmCalibration, check: LengthCheck | None) -> dict[str, str]:
    if check is None:
        meaning = "RMS distance of the ball to its socket, nominal and calibrated arm: agreement, not accuracy"
        return {"was": millimetres(c.rms_before_m, 3), "figure": millimetres(c.rms_after_m, 3), "meaning": meaning}
    certified = check.standard.length_m
    meaning = f"RMS error of a gauge of {millimetres(certified)}, read at {len(check.after_m)} places"
    before = "" if check.before_m is None else millimetres(statistics(check.before_m, certified).rms_m, 3)
    return {"was": before, "figure": millimetres(statistics(check.after_m, certified).rms_m, 3), "meaning": meaning}


def _facts(c: ArmCalibration) -> list[tuple[str, str]]:
    facts = [
        ("touches used", f"{len(c.touches)} in {len(c.points)} sockets"),
        ("ball in the flange’s frame", ", ".join(millimetres(v, 3) for v in c.tool_m.tolist())),
        ("χ² per degree of freedom, as stated", fixed(c.joint.chi2_per_dof, 2)),
    ]
    if c.heldout is not None:
        facts.append((f"held-out error, {c.heldout.shots} touches", millimetres(c.heldout.rms_translation_m)))
    return facts


def _gauge(check: LengthCheck) -> dict[str, Any]:
    certified = check.standard.length_m
    halves_m = None if check.std_m is None else COVERAGE_95 * np.hypot(check.std_m, check.standard.uncertainty_m)
    after = ErrorSeries("after", "after", check.after_m - certified, halves_m)
    label = "Errors of the readings"
    plot: Markup = error_plot(check.placements, [after], band_m=2.0 * check.standard.uncertainty_m, label=label)
    return {
        "standard": f"{millimetres(certified)} ± {millimetres(check.standard.uncertainty_m)}",
        "table": length_table(check),
        "statistics": length_statistics_table(check),
        "plot": plot,
    }


def _noise_table(noise: Sequence[NoiseEvidence]) -> Table:
    rows = [
        (n.origin, _ORIGINS.get(n.origin, ""), millimetres(n.size) if n.unit == "m" else f"{significant(n.size, 3)} ×")
        for n in noise
    ]
    return Table(("origin", "what it is", "size (× what the arm’s file states)"), tuple(rows), words=2)


def _socket_table(c: ArmCalibration) -> Table:
    rows = []
    for p in c.points:
        own = [t for t in c.touches if (t.placement, t.mark) == (p.placement, p.mark)]
        position = tuple(fixed(v / MM, 3) for v in p.position_m)
        spread = (_rms([t.before_m for t in own]), _rms([t.after_m for t in own]))
        rows.append((p.placement, p.mark, str(len(own)), *position, *spread))
    heads = ("place", "socket", "touches", "x [mm]", "y [mm]", "z [mm]", "RMS before [mm]", "RMS after [mm]")
    return Table(heads, tuple(rows), words=2)


def _rms(distances_m: Sequence[float]) -> str:
    values: Floats = np.array(distances_m)
    return fixed(float(np.sqrt(np.mean(values**2))) / MM, 4) if len(values) else DASH


def _touch_table(touches: Sequence[TouchEvidence]) -> Table:
    rows = [(t.shot, t.placement, t.mark, fixed(t.before_m / MM, 4), fixed(t.after_m / MM, 4)) for t in touches]
    worst = max(range(len(touches)), key=lambda k: touches[k].after_m, default=0)
    heads = ("touch", "place", "socket", "before [mm]", "after [mm]")
    return Table(heads, tuple(rows), words=3, marked=frozenset({worst}))
