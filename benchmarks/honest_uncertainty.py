"""Do the uncertainties of the joint estimate hold in thousands of simulated recordings of the paper's cell?

Run: python benchmarks/honest_uncertainty.py [FOLDER] [TRIALS]; the tables stay in FOLDER, and a second run goes on.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.cli.study_summary import groups, study_summary
from sixthlink.progress import Silent
from sixthlink.simulate import SCENARIOS
from sixthlink.study import PointSummary, Study
from sixthlink.workflow import named_study, run_study

CASES = (
    ("known", "none"),
    ("estimated", "none"),
    ("known", "weights-wrong-by-two"),
    ("known", "unwhitened"),
)
SHOTS = (5, 10, 20, 40)


def main(folder: Path, trials: int) -> None:
    folder.mkdir(exist_ok=True)
    print("| noise | control | coverage, % | from-to, % | χ² per dof | distance² | efficiency | lowest | verdict | s |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    found = {}
    for noise, control in CASES:
        study = named_study(scenario="paper", trials=trials, noise=noise, control=control)
        (summary,), seconds = computed(folder / f"{noise}_{control}.csv", study)
        found[noise, control] = summary
        print(f"| {noise} | {control} | {row(summary)} | {seconds:.0f} |", flush=True)
    print("\nnoise known, no control:\n")
    print("| unknowns | count | RMS error | reported | bound | coverage, % | efficiency |")
    print("|---|---|---|---|---|---|---|")
    for title, group in groups(found["known", "none"].quantities):
        factor, unit = (1e-3, "mm") if group[0].unit == "m" else (1e-3, "mrad")
        rms, std, bound = (
            np.sqrt(np.mean([getattr(q, name) ** 2 for q in group])) / factor
            for name in ("rms_error", "std", "bound_std")
        )
        coverage, efficiency = [100 * q.coverage.value for q in group], [q.efficiency.value for q in group]
        print(
            f"| {title} | {len(group)} | {rms:.4f} {unit} | {std:.4f} | {bound:.4f} "
            f"| {min(coverage):.1f}-{max(coverage):.1f} | {np.mean(efficiency):.4f} (lowest {min(efficiency):.4f}) |"
        )
    shots(folder, max(trials // 10, 20))
    pixels(folder, max(trials // 20, 20))


def pixels(folder: Path, trials: int) -> None:
    paper = SCENARIOS["paper"]
    cells = (replace(paper, print_sigma_m=0.0), paper)
    study = Study(cells, trials, source="pixels")
    points, seconds = computed(folder / "pixels.csv", study)
    print(f"\nfrom pixels, cameras calibrated in every recording; a perfect print, then 5 µm; {seconds:.0f} s:\n")
    print(study_summary(study, points, {}))


def shots(folder: Path, trials: int) -> None:
    study = named_study(scenario="paper", trials=trials, poses=SHOTS, noise="estimated")
    points, seconds = computed(folder / "shots.csv", study)
    print(f"\nerror against number of shots, {trials} recordings each, noise estimated, {seconds:.0f} s:\n")
    print("| shots | ruler RMS error, mm | reported, mm | joints' noise found | coverage, % | χ² per dof |")
    print("|---|---|---|---|---|---|")
    for point, summary in zip(study.scenarios, points, strict=True):
        lengths = [q for q in summary.quantities if q.name.startswith("length.")]
        rms, std = (1e3 * np.sqrt(np.mean([getattr(q, name) ** 2 for q in lengths])) for name in ("rms_error", "std"))
        print(
            f"| {point.placements} × {point.poses} | {rms:.4f} | {std:.4f} | {summary.joint_noise.value:.3f} "
            f"| {100 * summary.coverage.value:.2f} ± {100 * summary.coverage.standard_error:.2f} "
            f"| {summary.chi2_per_dof.value:.4f} ± {summary.chi2_per_dof.standard_error:.4f} |"
        )


def computed(table: Path, study: Study) -> tuple[Sequence[PointSummary], float]:
    started = time.perf_counter()
    points = run_study(table, study, progress=Silent())[0]
    return points, time.perf_counter() - started


def row(s: PointSummary) -> str:
    coverage = [100 * q.coverage.value for q in s.quantities]
    lowest = min(s.quantities, key=lambda q: q.efficiency.value)
    refused = ", ".join(v.name for v in s.verdicts if not v.passed)
    return (
        f"{100 * s.coverage.value:.2f} ± {100 * s.coverage.standard_error:.2f} "
        f"| {min(coverage):.1f}-{max(coverage):.1f} "
        f"| {s.chi2_per_dof.value:.4f} ± {s.chi2_per_dof.standard_error:.4f} "
        f"| {s.mahalanobis2_per_dof.value:.4f} ± {s.mahalanobis2_per_dof.standard_error:.4f} "
        f"| {s.efficiency.value:.4f} | {lowest.efficiency.value:.4f} ± {lowest.efficiency.standard_error:.4f} "
        f"| {'refused: ' + refused if refused else 'passed'}"
    )


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "study"), int(sys.argv[2]) if len(sys.argv) > 2 else 2000)
