"""What does a study say in a terminal, and as JSON?"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from sixthlink.study import PointSummary, Quantity, Study
from sixthlink.units import MM

__all__ = ["groups", "study_as_dict", "study_summary"]

_FIGURE = {"m": (MM, "mm"), "rad": (1e-3, "mrad"), "px": (1.0, "px")}
"""What a unit is divided by for people, and its name then."""


def study_summary(study: Study, points: Sequence[PointSummary], files: Mapping[str, str]) -> str:
    """Every cell in a table of groups and five verdicts."""
    lines: list[str] = []
    for summary in points:
        s = study.scenarios[summary.point]
        lines += [
            f"cell {summary.point + 1}: {s.placements} placements of {s.poses} shots, {s.pixel_noise_px:g} px, "
            f"{1e6 * s.joint_repeatability_rad:g} µrad; {summary.trials} recordings from {study.source}, "
            f"noise {study.noise}" + (f", control {study.control}" if study.control != "none" else ""),
            f"{'':<22}{'count':>6}{'RMS error':>14}{'reported':>11}{'bound':>11}{'coverage, %':>14}{'efficiency':>21}",
            *(_group_line(title, group) for title, group in groups(summary.quantities)),
            f"joints' noise found {summary.joint_noise.value:.4f} ± {summary.joint_noise.standard_error:.4f} of the "
            f"true one; {summary.rejected.value:.4f} good shots per recording called wrong",
            *(f"{'passed ' if v.passed else 'REFUSED'}  {v.name}: {v.message}" for v in summary.verdicts),
            "",
        ]
    return "\n".join([*lines, *(f"wrote {path}" for path in files.values())])


def study_as_dict(study: Study, points: Sequence[PointSummary]) -> dict[str, Any]:
    """The same for machines, every quantity by itself."""
    return {
        "trials": study.trials,
        "seed": study.seed,
        "noise": study.noise,
        "control": study.control,
        "source": study.source,
        "passed": all(p.passed for p in points),
        "points": [asdict(p) | {"passed": p.passed, "scenario": asdict(study.scenarios[p.point])} for p in points],
    }


def groups(quantities: Sequence[Quantity]) -> Iterator[tuple[str, list[Quantity]]]:
    """Quantities of one kind and unit."""
    groups: dict[str, list[Quantity]] = {}
    for q in quantities:
        kind = q.name.partition(".")[0]
        kind = kind if kind in ("head", "lens", "arm", "length") else "placement"
        size = {"m": "positions", "rad": "angles", "px": "pixels"}.get(q.unit, "")
        title = {"arm": {"m": "arm lengths", "rad": "arm angles"}.get(q.unit, "arm"), "length": "ruler lengths"}
        groups.setdefault(title.get(kind, f"{kind} {size}".strip()), []).append(q)
    yield from groups.items()


def _group_line(title: str, group: Sequence[Quantity]) -> str:
    factor, unit = _FIGURE.get(group[0].unit, (1.0, ""))
    rms, std, bound = (
        float(np.sqrt(np.mean([getattr(q, name) ** 2 for q in group]))) / factor
        for name in ("rms_error", "std", "bound_std")
    )
    coverage = [100 * q.coverage.value for q in group]
    efficiency = [q.efficiency.value for q in group]
    return (
        f"{title:<22}{len(group):>6}{rms:>9.4f} {unit:<4}{std:>11.4f}{bound:>11.4f}"
        f"{min(coverage):>8.1f}-{max(coverage):<5.1f}{np.mean(efficiency):>9.3f} (min {min(efficiency):.3f})"
    )
