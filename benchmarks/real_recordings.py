"""What do real recordings say: scatter, held-out error, the weight ℓ, and what the robot does for a weak lens?

    python benchmarks/real_recordings.py

Reads ../shared/data. Scatter is measured on the shots that made the answer; held-out errors on shots that did not, in
ten folds dealt ten times over, with the lens of a single camera fitted on all shots (the folds share it). Differences
between two solvers are paired: the shots are drawn anew 2,000 times, both solvers judged on the same ones.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from sixthlink.calibrate import (
    RigCalibration,
    SolveOptions,
    calibrate_cameras,
    locate_targets,
    problem_of_recording,
)
from sixthlink.calibrate.head import HeadProblem, head_problem, objective, scatter, solve_certified
from sixthlink.calibrate.head.closed_form import CLOSED_FORMS
from sixthlink.calibrate.head.compare import LIKELIEST, heldout_errors, solvers
from sixthlink.calibrate.turns import readings, turn_transforms
from sixthlink.detect import detect
from sixthlink.files import image_reader, read_recording
from sixthlink.geometry import Floats
from sixthlink.recording import Recording, flange_poses_of

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from recordings import CONVERTERS

DATA = Path(__file__).parents[2] / "shared" / "data"
LENGTHS_M = (1e-3, 0.1, 1.0)
DEALS = 10
DRAWS = 2000


def from_images_alone(recording: Recording, cameras: RigCalibration) -> HeadProblem:
    """The shots with the lens as the images alone determine it."""
    target = recording.target
    found = locate_targets(cameras.rig, target.points_m, cameras.detections, recording.ids, turn=target.turn)
    placements = np.zeros(len(found.shots), dtype=np.int64)
    flanges = flange_poses_of(recording)[found.shots]
    problem = head_problem(recording.mount, flanges, found.Ts_head_target, placements)
    renamed = turn_transforms(target.points_m, target.turn)
    return HeadProblem(problem.Ts_outer, problem.Ts_inner @ renamed[readings(problem, renamed)], placements)


def scatter_text(problem: HeadProblem, length_m: float) -> str:
    found = scatter(problem, solve_certified(objective(problem, length_m))[0])
    return f"{found.rms_translation_m * 1e3:.3f} mm / {np.rad2deg(found.rms_rotation_rad):.3f}°"


def heldout_squares(problem: HeadProblem) -> dict[str, Floats]:
    """Squared held-out errors ``(N, 2)`` [mm², degree²] of every solver but the swarms, mean over the deals."""
    found = {}
    for name, solver in solvers(0).items():
        if not name.startswith("qpso"):
            deals = [heldout_errors(problem, solver, seed) for seed in range(DEALS)]
            errors = np.array([np.stack([t * 1e3, np.rad2deg(r)], axis=1) for t, r in deals])
            found[name] = np.mean(errors**2, axis=0)
    return found


def root(squares: Floats) -> Floats:
    return np.sqrt(squares.mean(axis=-2))


def beside(ours: Floats, other: Floats) -> list[str]:
    """Change of RMS from other to ours in percent, with the 95 % interval over draws of the shots."""
    drawn = np.random.default_rng(0).integers(len(ours), size=(DRAWS, len(ours)))
    change = 100.0 * (root(ours) / root(other) - 1.0)
    low, high = np.percentile(100.0 * (root(ours[drawn]) / root(other[drawn]) - 1.0), [2.5, 97.5], axis=0)
    return [f"{c:+.2f} ({lo:+.1f} to {hi:+.1f})" for c, lo, hi in zip(change, low, high, strict=True)]


def heldout_rows(name: str, squares: dict[str, Floats]) -> str:
    """One row: both proven answers, and the likeliest one beside the closed forms that did best."""
    ours = squares[LIKELIEST]
    by_position, by_turn = (min(CLOSED_FORMS, key=lambda m: root(squares[m])[k]) for k in range(2))
    cells = [f"{root(squares[s])[0]:.3f} mm / {root(squares[s])[1]:.4f}°" for s in (LIKELIEST, "certified-metres")]
    cells += [f"{by_position} {root(squares[by_position])[0]:.3f} mm / {root(squares[by_position])[1]:.4f}°"]
    cells += beside(ours, squares[by_position])
    cells += [f"{by_turn} {root(squares[by_turn])[1]:.4f}°: {beside(ours, squares[by_turn])[1]}"]
    return f"| {name} | " + " | ".join(cells) + " |"


def main() -> None:
    print("| recording | shots | ℓ = 1 mm | ℓ = 0.1 m | ℓ = 1 m |\n|---|---|---|---|---|")
    notes, heldout = [], []
    with tempfile.TemporaryDirectory() as folder:
        for convert in CONVERTERS:
            path = convert(DATA, Path(folder))
            recording, cameras = read_recording(path), None
            if recording.Ts_head_target is None:
                detections, _ = detect(recording, image_reader(path, recording))
                cameras = calibrate_cameras(recording, detections)
                std = cameras.cameras[0].std
                alone = scatter_text(from_images_alone(recording, cameras), 1.0)
                point = f"principal point ± {std[2]:.1f}, {std[3]:.1f} px"
                notes.append(f"{recording.name}, lens from the images alone: {alone} ({point})")
            problem = problem_of_recording(recording, cameras, SolveOptions())
            columns = [scatter_text(problem, length_m) for length_m in LENGTHS_M]
            print(f"| {recording.name} | {len(problem.placements)} | " + " | ".join(columns) + " |")
            heldout.append(heldout_rows(recording.name, heldout_squares(problem)))
    print("\n| recording | certified | ℓ = 1 m | best closed form in position | position, % | turn, % | best in turn |")
    print("|---|---|---|---|---|---|---|\n" + "\n".join(heldout))
    print("\n" + "\n".join(notes))


if __name__ == "__main__":
    main()
