"""Two of twenty shots are wrong: are they named, and what does the mistake cost?

    python benchmarks/wrong_shots.py [TRIALS]

Twenty shots of the paper's cell (2 placements of 10), fresh arm errors and fresh noise per trial; two shots read from
the board's other end, exchanged with each other, or tilted by 5°. The error is where the camera stands relative to the
first shot, RMS over the shots, beside that of the same trial without mistakes.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint import Estimate, HeadShots, JointData, estimate
from sixthlink.files import load_arm
from sixthlink.geometry import Floats, apply_motion, exp_rotation, inverse, motion_between
from sixthlink.robot import Arm, arm_with_values, flange_poses
from sixthlink.simulate import SCENARIOS, SimulatedCell, simulate_cell
from sixthlink.target import Chessboard

SIGMAS = np.repeat([2e-5, 5e-5], 3)
SHOTS = 20


def camera_error_m(cell: SimulatedCell, found: Estimate, arm: Arm) -> float:
    q = cell.recording.joints[:SHOTS]
    Ts_found = flange_poses(found.fit.state.arm, q) @ found.fit.state.X
    Ts_true = flange_poses(arm, q) @ cell.truth.T_flange_head
    moved = motion_between(inverse(Ts_true[:1]) @ Ts_true, inverse(Ts_found[:1]) @ Ts_found)
    return float(np.sqrt(np.mean(np.sum(moved[:, :3] ** 2, axis=1))))


def spoilt(kind: str, Ts: Floats, bad: np.ndarray, rng: np.random.Generator) -> Floats:
    Ts = Ts.copy()
    if kind == "read from the other end":
        Ts[bad] = Ts[bad] @ np.array([[-1.0, 0, 0, 0.22], [0, -1, 0, 0.16], [0, 0, 1, 0], [0, 0, 0, 1]])
    elif kind == "exchanged":
        Ts[bad] = Ts[bad[::-1]]
    else:
        axes = rng.standard_normal((2, 3))
        axes *= np.deg2rad(5.0) / np.linalg.norm(axes, axis=1, keepdims=True)
        Ts[bad, :3, :3] = exp_rotation(axes) @ Ts[bad, :3, :3]
    return Ts


def main() -> None:
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    nominal = load_arm("abb_irb1400", folder=Path())
    plan = replace(SCENARIOS["paper"], placements=2, poses=SHOTS // 2)
    cell = simulate_cell(plan, nominal, Chessboard(columns=12, rows=9, square_m=0.02), seed=1, images=False)
    q, placements = cell.recording.joints[:SHOTS], np.repeat([0, 1], SHOTS // 2)
    Ts_base_target = np.stack([cell.truth.Ts_base_placement[p] for p in ("p1", "p2")])[placements]
    sigmas = np.where(nominal.turns, np.deg2rad(0.03), 5e-4)
    covariances = np.tile(np.diag(SIGMAS**2), (SHOTS, 1, 1))

    def found(Ts_head_target: Floats) -> Estimate:
        problem = HeadProblem(flange_poses(nominal, q), Ts_head_target, placements)
        return estimate(JointData(nominal, HeadShots(q, problem, covariances=covariances)))

    print("| mistake | both named | good shots named | error, mm | without, mm | ratio |\n|---|---|---|---|---|---|")
    for kind in ("read from the other end", "exchanged", "tilted by 5°"):
        rng = np.random.default_rng(0)
        named, falsely, wrong_m, clean_m = 0, 0, [], []
        for _ in range(trials):
            arm = arm_with_values(nominal, nominal.values + sigmas * rng.standard_normal(len(sigmas)))
            Ts_base_flange = flange_poses(arm, q + 50e-6 * rng.standard_normal(q.shape))
            Ts = inverse(Ts_base_flange @ cell.truth.T_flange_head) @ Ts_base_target
            Ts = apply_motion(Ts, SIGMAS * rng.standard_normal((SHOTS, 6)))
            bad = np.sort(rng.choice(SHOTS, 2, replace=False))
            with_mistakes, without = found(spoilt(kind, Ts, bad, rng)), found(Ts)
            out = set(np.flatnonzero(~with_mistakes.kept[0]).tolist())
            named += set(bad.tolist()) <= out
            falsely += bool(out - set(bad.tolist()))
            wrong_m.append(camera_error_m(cell, with_mistakes, arm))
            clean_m.append(camera_error_m(cell, without, arm))
        means = np.mean(wrong_m) * 1e3, np.mean(clean_m) * 1e3
        print(
            f"| {kind} | {named} of {trials} | {falsely} of {trials} | {means[0]:.4f} | {means[1]:.4f} | "
            f"{means[0] / means[1]:.3f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
