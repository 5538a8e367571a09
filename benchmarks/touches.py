"""Calibrated at one place by touching two sockets, how well is the 50 mm between them read at the others?

    python benchmarks/touches.py

Reads ../shared/data/mukca_two_socket_50mm. Every robot is calibrated at each of its places in turn, the distance of
the sockets there taken as 50.0 ± 0.1 mm, and reads the gauge at the others, whose distance it is not told.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from sixthlink.calibrate import SolveOptions
from sixthlink.progress import Silent
from sixthlink.workflow import calibrate_folder, verify_folder

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from recordings import MUKCA, mukca

DATA = Path(__file__).parents[2] / "shared" / "data"


def rows(robot: str, out: Path) -> list[tuple[str, float]]:
    found = []
    for place in sorted(p.name for p in (DATA / "mukca_two_socket_50mm" / robot).iterdir()):
        folder = mukca(DATA, out, robot, place)
        arm, _ = calibrate_folder(folder, out=None, arm=None, options=SolveOptions(), progress=Silent())
        check, _ = verify_folder(folder, result=None, arm=None, progress=Silent())
        for k, read in enumerate(check.placements):
            error = (check.after_m[k] - check.standard.length_m) * 1e3
            text = f"| {robot} | {place} | {read} | {(check.before_m[k] - check.standard.length_m) * 1e3:+.3f} "
            text += f"| {error:+.3f} | {check.std_m[k] * 1e3:.3f} | {'yes' if check.inside_95[k] else 'NO'} "
            text += f"| {arm.rms_before_m * 1e3:.2f} → {arm.rms_after_m * 1e3:.2f} |"
            found.append((text, error))
    return found


def main() -> None:
    print("| robot | calibrated at | read at | nominal arm | error | std | 50.0 inside 95 % | touches RMS |")
    print("|---|---|---|---|---|---|---|---|")
    worst = []
    with tempfile.TemporaryDirectory() as folder:
        for robot in MUKCA:
            found = rows(robot, Path(folder))
            print("\n".join(text for text, _ in found), flush=True)
            worst.append(f"{robot} {max(abs(error) for _, error in found):.3f}")
    print("\nworst error, mm: " + ", ".join(worst))


if __name__ == "__main__":
    main()
