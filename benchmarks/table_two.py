"""The paper's Table II on simulated cells: what does each way to calibrate leave of a 1234.15 mm ruler?

    python benchmarks/table_two.py [--images] [SEED ...]

For every cell: the nominal head on the nominal arm; the paper's chain (laser tracker, arm, head by eq. (11), ruler);
arm and head from the images alone; images and tracker in one problem; the floor, with everything true but the joints'
readings and the pixels. RMS error over 15 placements, mm.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from paper_cell import floor_rms_mm
from sixthlink.calibrate import SolveOptions
from sixthlink.measure import statistics
from sixthlink.progress import Silent
from sixthlink.workflow import arm_from_record, calibrate_folder, simulate_folder, verify_folder

TITLES = ("nominal", "paper's chain", "images only", "images and tracker", "floor", "images and tracker, stated")


def ruler_mm(cell: Path, out: Path, **wanted) -> tuple[float, float, float]:
    """RMS error of the ruler after and before, and the uncertainty that the calibration states."""
    calibrate_folder(cell, out=out, options=SolveOptions(), progress=Silent(), **wanted)
    check, _ = verify_folder(cell, result=out, arm=None, progress=Silent())
    length_m = check.standard.length_m
    after, before = (statistics(lengths, length_m).rms_m * 1e3 for lengths in (check.after_m, check.before_m))
    stated = 0.0 if check.std_m is None else float(np.sqrt(np.mean(check.std_m**2))) * 1e3
    return after, before, stated


def row(folder: Path, seed: int, *, images: bool) -> tuple[float, ...]:
    cell = folder / "cell"
    simulate_folder(
        cell, scenario="paper", seed=seed, images=images, scale_placements=0, tracker=True, progress=Silent()
    )
    arm_from_record(cell / "tracker", out=folder / "arm", arm=None, noise="estimated", progress=Silent())
    chain, nominal, _ = ruler_mm(cell, folder / "1", arm=folder / "arm" / "arm.yaml", solve="paper")
    alone, _, _ = ruler_mm(cell, folder / "2", arm=None, solve="joint")
    both, _, stated = ruler_mm(cell, folder / "3", arm=None, solve="joint", tracker=cell / "tracker")
    return nominal, chain, alone, both, floor_rms_mm(cell), stated


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seeds", nargs="*", type=int, default=list(range(10)))
    parser.add_argument("--images", action="store_true", help="render images instead of noisy pixels of 0.05 px")
    options = parser.parse_args()
    print(f"| seed | {' | '.join(TITLES)} |\n|{'---|' * (len(TITLES) + 1)}")
    rows = []
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(row(Path(folder), seed, images=options.images))
        print(f"| {seed} | " + " | ".join(f"{v:.4f}" for v in rows[-1]) + " |", flush=True)
    print("| mean | " + " | ".join(f"{v:.4f}" for v in np.mean(rows, axis=0)) + " |")


if __name__ == "__main__":
    main()
