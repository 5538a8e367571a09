"""How does an arm that was calibrated from a laser-tracker record explain itself on one page?

The same style, drawings and rules as the page of an arm from touches; circles, axes and errors at points that no fit
had seen stand where the gauge does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sixthlink.calibrate.tracked_arm import JointSweep, PointErrors, ReflectorPlace, TrackedArm
from sixthlink.calibrate.tracker import AxisFit
from sixthlink.recording import TrackerRecord
from sixthlink.report.circle_scene import circle_plot
from sixthlink.report.joint_tables import arm_table, block_table, correlation_table, noise_table, tolerances_in_words
from sixthlink.report.quantities import DASH, degrees, fixed, millimetres, significant, with_std
from sixthlink.report.tables import Table
from sixthlink.report.templates import template
from sixthlink.report.tracked_figures import MOST_DOTS, MOST_PANELS, deviation_plot, heldout_plot
from sixthlink.units import MM

__all__ = ["tracked_page"]

MRAD = 1e-3

NOT_SEEN = "not seen"
"""What is written instead of a standard deviation that is infinite."""

MOST_PAIRS = 10
"""Correlated pairs that the page lists."""


def tracked_page(result: TrackedArm, record: TrackerRecord, *, created: str = "") -> str:
    """A calibration as one self-contained HTML page.

    Args:
        result: What to explain.
        record: The record that it is of.
        created: When the page was made, for people.

    Returns:
        The page, to be written as UTF-8.
    """
    correlations = correlation_table(result.joint)
    return template("tracked_page.html").render(
        result=result,
        created=created,
        headline=_headline(result),
        facts=_facts(result, record),
        grave=[f for f in result.findings if f.finding.grave],
        softer=[f for f in result.findings if not f.finding.grave],
        scene=circle_plot(result, record),
        deviations=deviation_plot(result, record),
        most={"panels": MOST_PANELS, "dots": MOST_DOTS},
        circles=_circle_table(result, record),
        axes=_axis_table(result),
        stand=", ".join(millimetres(v, 2) for v in result.T_base_tracker[:3, 3].tolist()),
        errors=_error_table(result),
        errors_plot=heldout_plot(result),
        arm=arm_table(result.nominal, result.joint.arm),
        tolerances=tolerances_in_words(result.nominal, result.joint.arm),
        noise=noise_table(result.nominal, result.joint.noise),
        blocks=block_table(result.joint.blocks),
        correlations=replace(correlations, rows=correlations.rows[:MOST_PAIRS]),
        pairs=len(correlations.rows),
        reflectors=_reflector_table(result),
        rejections=Table(("point", "reason"), tuple((r.shot, r.reason) for r in result.rejections), tail=1),
    )


def _headline(result: TrackedArm) -> dict[str, str]:
    count = len(result.heldout.distances_m)
    nominal = "the nominal arm" if result.drawn else "the arm that the axes alone show"
    meaning = (
        f"RMS error at {count} points before and after: every one was predicted by fits that had not seen its pose. "
        f"Before is {nominal}, with tracker and reflectors placed by the other points."
    )
    return {
        "was": millimetres(result.heldout_before.rms_m, 3),
        "figure": millimetres(result.heldout.rms_m, 3),
        "meaning": meaning,
    }


def _facts(result: TrackedArm, record: TrackerRecord) -> list[tuple[str, str]]:
    implied = sum(sweep.implied for sweep in result.sweeps)
    within = f", {implied} of them within free measurements" if implied else ""
    facts = [
        ("points used", f"{len(result.used)} of {len(record)}"),
        ("sweeps", f"{len(result.sweeps)}{within}"),
        ("largest held-out error", millimetres(result.heldout.max_m, 3)),
        ("χ² per degree of freedom, as stated", fixed(result.joint.chi2_per_dof, 2)),
    ]
    return facts + [(f"{p.name}, a factor", with_std(p.value, p.std, "", 4)) for p in result.couplings]


def _circle_table(result: TrackedArm, record: TrackerRecord) -> Table:
    """One row per circle; a sweep that shows none says why, one that cannot be used is soft."""
    found = [(sweep.usable, row) for sweep in result.sweeps for row in _circle_rows(result, record, sweep)]
    soft = frozenset(k for k, (usable, _) in enumerate(found) if not usable)
    numbers = ("kept of points", "radius [mm]", "arc [°]", "radial RMS [mm]", "plane RMS [mm]", "direction ± [mrad]")
    heads = ("sweep", "joint", "reflector", *numbers, "remark")
    if not any(row[-1] for _, row in found):
        return Table(heads[:-1], tuple(row[:-1] for _, row in found), words=3, soft=soft)
    return Table(heads, tuple(row for _, row in found), words=3, soft=soft, tail=1)


def _circle_rows(result: TrackedArm, record: TrackerRecord, sweep: JointSweep) -> Iterator[tuple[str, ...]]:
    joint = result.arm.joints[sweep.joint]
    remark = ", ".join(dict.fromkeys(f.kind for f in sweep.findings))
    names = [record.reflectors[k].name for k in np.unique(record.reflector_of[sweep.rows]).tolist()]
    if sweep.fit is None:
        yield (sweep.name, joint, ", ".join(names), f"0 of {len(sweep.rows)}", *([DASH] * 5), remark)
        return
    for k, name in enumerate(names):
        yield (sweep.name, joint, name, *_circle_numbers(sweep.fit, k), remark)


def _circle_numbers(fit: AxisFit, k: int) -> tuple[str, ...]:
    """What the circle of the k-th reflector of a sweep is, and how close its points lie."""
    mine = fit.reflectors == k
    kept = mine & fit.kept
    std_m = math.sqrt(max(float(fit.covariance[5 + 2 * k, 5 + 2 * k]), 0.0))
    rms_m = np.sqrt(np.mean(fit.deviations_m[kept] ** 2, axis=0)) if kept.any() else np.full(2, np.nan)
    return (
        f"{np.count_nonzero(kept)} of {np.count_nonzero(mine)}",
        with_std(float(fit.circles[k].radius_m) / MM, std_m / MM, "", 3),
        fixed(math.degrees(fit.arcs_rad[k]), 1),
        *(fixed(v / MM, 4) for v in rms_m.tolist()),
        _seen(fit.direction_uncertainty_rad, MRAD),
    )


def _axis_table(result: TrackedArm) -> Table:
    rows = [
        (
            axis.joint,
            *(fixed(v, 6) for v in axis.axis.direction.tolist()),
            _seen(axis.direction_std_rad, MRAD),
            _seen(axis.position_std_m, MM),
            "no sweep: all points" if axis.sweep is None else axis.sweep.name,
        )
        for axis in result.axes
    ]
    heads = ("joint", "x [–]", "y [–]", "z [–]", "± [mrad]", "± [mm]", "at the stop of sweep")
    return Table(heads, tuple(rows), tail=1)


def _error_table(result: TrackedArm) -> Table:
    sets = (result.heldout_before, result.heldout)
    rows = [
        ("RMS error", *(millimetres(e.rms_m) for e in sets)),
        ("median error", *(millimetres(float(np.median(e.distances_m))) for e in sets)),
        ("largest error", *(millimetres(e.max_m) for e in sets)),
    ]
    turns = [_turned(e) for e in sets]
    if any(turns):
        rows.append((f"orientation, RMS of {len(result.heldout.turns_rad)}", *turns))
    heads = (f"at {len(result.heldout.distances_m)} held-out points", "before", "after")
    return Table(heads, tuple(rows), marked=frozenset({0}))


def _turned(errors: PointErrors) -> str:
    return "" if errors.rms_rad is None else degrees(errors.rms_rad)


def _reflector_table(result: TrackedArm) -> Table:
    """Where every reflector sits; one that is not wholly seen is marked."""
    rows = [
        (
            r.name,
            str(r.link) + (" (flange)" if r.link == len(result.arm.joints) else ""),
            *_place(r),
            r.unseen or "nothing",
        )
        for r in result.reflectors
    ]
    marked = frozenset(k for k, r in enumerate(result.reflectors) if r.unseen)
    heads = ("reflector", "link", "x [mm]", "y [mm]", "z [mm]", "what is not seen")
    return Table(heads, tuple(rows), words=2, marked=marked, tail=1)


def _place(reflector: ReflectorPlace) -> tuple[str, ...]:
    pairs = zip(reflector.place_m.tolist(), reflector.std_m.tolist(), strict=True)
    return tuple(NOT_SEEN if math.isinf(std) else with_std(value / MM, std / MM, "", 3) for value, std in pairs)


def _seen(std: float, unit: float) -> str:
    """A standard deviation in a unit, or that there is none."""
    return NOT_SEEN if math.isinf(std) else significant(std / unit, 2)
