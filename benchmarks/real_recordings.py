"""What do real recordings say: scatter, held-out error, the weight ℓ, and what the robot does for a weak lens?

    python benchmarks/real_recordings.py

Reads ../shared/data. Scatter is measured on the shots that made the answer; held-out errors on shots that did not,
ten folds, with the lens of a single camera fitted on all shots (the folds share it).
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from sixthlink.calibrate import (
    RigCalibration,
    SolveOptions,
    SolverScore,
    calibrate_rig,
    locate_targets,
    problem_of_recording,
)
from sixthlink.calibrate.half_turns import half_turn_transform, opposite_readings
from sixthlink.calibrate.head import HeadProblem, compare_solvers, head_problem, objective, scatter, solve_certified
from sixthlink.detect import detect
from sixthlink.files import image_reader, read_recording
from sixthlink.progress import Silent
from sixthlink.recording import Recording, flange_poses_of

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from recordings import CONVERTERS

DATA = Path(__file__).parents[2] / "shared" / "data"
LENGTHS_M = (1e-3, 0.1, 1.0)


def from_images_alone(recording: Recording, cameras: RigCalibration) -> HeadProblem:
    """The shots with the lens as the images alone determine it."""
    target = recording.target
    found = locate_targets(cameras.rig, target.points_m, cameras.detections, recording.ids, half_turn=target.half_turn)
    placements = np.zeros(len(found.shots), dtype=np.int64)
    flanges = flange_poses_of(recording)[found.shots]
    problem = head_problem(recording.mount, flanges, found.Ts_head_target, placements)
    if target.half_turn is None:
        return problem
    H = half_turn_transform(target.points_m, target.half_turn)
    turned = opposite_readings(problem, H)[:, None, None]
    inner = np.where(turned, problem.Ts_inner @ H, problem.Ts_inner)
    return HeadProblem(problem.Ts_outer, inner, placements)


def scatter_text(problem: HeadProblem, length_m: float) -> str:
    found = scatter(problem, solve_certified(objective(problem, length_m))[0])
    return f"{found.rms_translation_m * 1e3:.3f} mm / {np.rad2deg(found.rms_rotation_rad):.3f}°"


def heldout_text(score: SolverScore) -> str:
    return f"{score.heldout_translation_m * 1e3:.3f} mm / {np.rad2deg(score.heldout_rotation_rad):.3f}°"


def main() -> None:
    print("| recording | shots | ℓ = 1 mm | ℓ = 0.1 m | ℓ = 1 m | held-out, ℓ = 1 m | held-out, best closed form |")
    print("|---|---|---|---|---|---|---|")
    notes = []
    with tempfile.TemporaryDirectory() as folder:
        for convert in CONVERTERS:
            path = convert(DATA, Path(folder))
            recording, cameras = read_recording(path), None
            if recording.Ts_head_target is None:
                detections, _ = detect(recording, image_reader(path, recording))
                cameras = calibrate_rig(recording, detections)
                std = cameras.cameras[0].std
                alone = scatter_text(from_images_alone(recording, cameras), 1.0)
                point = f"principal point ± {std[2]:.1f}, {std[3]:.1f} px"
                notes.append(f"{recording.name}, lens from the images alone: {alone} ({point})")
            problem = problem_of_recording(recording, cameras, SolveOptions())
            scores = compare_solvers(problem, seed=0, progress=Silent())
            ours = next(s for s in scores if s.name == "certified-metres")
            closed = [s for s in scores if not s.failure and not s.name.startswith(("certified", "qpso"))]
            best = min(closed, key=lambda s: s.heldout_translation_m)
            columns = [scatter_text(problem, length_m) for length_m in LENGTHS_M]
            columns += [heldout_text(s) for s in (ours, best)]
            columns[-1] += f" ({best.name})"
            print(f"| {recording.name} | {len(problem.placements)} | " + " | ".join(columns) + " |")
    print("\n" + "\n".join(notes))


if __name__ == "__main__":
    main()
