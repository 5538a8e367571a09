"""How long does the joint estimate take beside SciPy and Ceres on the same problem?

    .venv-peers/bin/python benchmarks/joint_times.py        (make bench)

Pose level: head, 20 free arm parameters and placements from N shots with known noise, the same whitened residuals, the
same start, analytic derivatives for all three; Ceres through pyceres, one cost function in Python per shot. Pixel
level: 50 stereo shots of 108 corners, all intrinsics and the stereo pose free. Ratios travel from machine to machine.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from sixthlink.calibrate import SolveOptions, calibrate_jointly, calibrate_rig, locate_targets
from sixthlink.calibrate.arm import link_parameters
from sixthlink.calibrate.head import HeadProblem
from sixthlink.calibrate.joint import HeadShots, JointData, estimate
from sixthlink.calibrate.joint.data import start_of
from sixthlink.calibrate.joint.problem import JointProblem, solve
from sixthlink.calibrate.observations import JointState, moved, whitened
from sixthlink.calibrate.rig_refinement import RigProblem, refine_rig
from sixthlink.camera import RigUnknowns, moved_rig, rig_pixels
from sixthlink.files import load_arm
from sixthlink.geometry import Floats, apply_motion, hat, inverse
from sixthlink.progress import Silent
from sixthlink.recording import selected
from sixthlink.robot import arm_with_values, flange_poses
from sixthlink.simulate import SCENARIOS, simulate_cell
from sixthlink.target import Chessboard

SIGMAS = np.repeat([2e-5, 5e-5], 3)
SCALES = {"joints": 1.0, "pixels": 1.0, "standard": 1.0}


def shots(number: int, placements: int, rng: np.random.Generator) -> JointData:
    """Shots around those of the paper's cell, with a fresh arm and fresh noise."""
    nominal = load_arm("abb_irb1400", folder=Path())
    board = Chessboard(columns=12, rows=9, square_m=0.02)
    cell = simulate_cell(replace(SCENARIOS["paper"], ruler_placements=0), nominal, board, seed=0, images=False)
    sigmas = np.where(nominal.turns, np.deg2rad(0.03), 5e-4)
    arm = arm_with_values(nominal, nominal.values + sigmas * rng.standard_normal(len(sigmas)))
    seen = cell.recording.joints[:50]
    q = seen[np.arange(number) % 50] + (0.1 * rng.standard_normal((number, 6)) if number > 50 else 0.0)
    numbers = np.arange(number) % placements
    Ts_base_target = apply_motion(cell.truth.Ts_base_placement["p1"], 0.2 * rng.standard_normal((placements, 6)))
    Ts_base_flange = flange_poses(arm, q + 50e-6 * rng.standard_normal(q.shape))
    Ts_head_target = inverse(Ts_base_flange @ cell.truth.T_flange_head) @ Ts_base_target[numbers]
    Ts_head_target = apply_motion(Ts_head_target, SIGMAS * rng.standard_normal((number, 6)))
    problem = HeadProblem(flange_poses(nominal, q), Ts_head_target, numbers)
    covariances = np.tile(np.diag(SIGMAS**2), (number, 1, 1))
    return JointData(nominal, HeadShots(q, problem, covariances=covariances))


def seconds(run: Callable[[], object], repeats: int = 3) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


class Flat:
    """The problem as one vector of unknowns, for solvers that know no blocks."""

    def __init__(self, problem: JointProblem, start: JointState) -> None:
        self.problem, self.start = problem, start
        self.P = len(start.Ts_stand_target)
        self.G = problem.columns.size

    def state(self, x: Floats) -> JointState:
        """The state at a vector of unknowns."""
        return moved(self.start, self.problem.columns, x[: self.G], [("placements", x[self.G :].reshape(-1, 6))])

    def rows(self, x: Floats) -> tuple[Floats, Floats]:
        """Whitened residuals and their dense Jacobian."""
        state = self.state(x)
        white = whitened(self.problem.observations[0].linearised(state, self.problem.columns), SCALES)
        J = np.zeros((len(white.residuals), len(x)))
        J[:, : self.G] = white.shared
        for k in range(6):
            J[np.arange(len(J)), self.G + 6 * white.blocks + k] = white.own[:, k]
        prior = np.zeros((len(self.problem.prior), len(x)))
        prior[:, : self.G] = self.problem.prior
        residual = np.concatenate(
            [white.residuals, self.problem.prior[:, self.problem.columns.arm_slice] @ state.arm_step]
        )
        return residual, np.concatenate([J, prior])

    def scipy(self) -> Floats:
        """The answer of SciPy's least_squares."""
        x0 = np.zeros(self.G + 6 * self.P)
        return least_squares(
            lambda x: self.rows(x)[0], x0, jac=lambda x: self.rows(x)[1], x_scale="jac", method="trf"
        ).x

    def ceres(self) -> Floats:
        """The answer of Ceres."""
        import pyceres

        columns, G = self.problem.columns, self.G
        observed = self.problem.observations[0]
        shared, own = np.zeros(G), [np.zeros(6) for _ in range(self.P)]

        class Shot(pyceres.CostFunction):
            def __init__(self, flat: Flat, shot: int) -> None:
                super().__init__()
                self.set_num_residuals(6)
                self.set_parameter_block_sizes([G, 6])
                p = int(observed.placements[shot])
                self.start = replace(flat.start, Ts_stand_target=flat.start.Ts_stand_target[p : p + 1])
                self.one = replace(
                    observed,
                    joints=observed.joints[shot : shot + 1],
                    Ts_head_target=observed.Ts_head_target[shot : shot + 1],
                    placements=np.zeros(1, dtype=np.int64),
                    noises={n: v[shot : shot + 1] for n, v in observed.noises.items()},
                )

            def Evaluate(self, parameters, residuals, jacobians) -> bool:
                state = moved(self.start, columns, parameters[0], [("placements", parameters[1][None])])
                white = whitened(self.one.linearised(state, columns), SCALES)
                residuals[:] = white.residuals
                if jacobians is not None:
                    for k, J in enumerate((white.shared, white.own)):
                        if jacobians[k] is not None:
                            jacobians[k][:] = J.ravel()
                return True

        problem = pyceres.Problem()
        for shot in range(len(observed.joints)):
            problem.add_residual_block(Shot(self, shot), None, [shared, own[int(observed.placements[shot])]])
        prior = pyceres.factors.NormalPrior(np.zeros(G), np.diag(self.prior_variances()))
        problem.add_residual_block(prior, None, [shared])
        options = pyceres.SolverOptions()
        options.linear_solver_type = pyceres.LinearSolverType.DENSE_SCHUR
        summary = pyceres.SolverSummary()
        pyceres.solve(options, problem, summary)
        return np.concatenate([shared, *own])

    def prior_variances(self) -> Floats:
        """The maker's tolerances; as good as nothing for the head."""
        variances = np.full(self.G, 1e6)
        variances[self.problem.columns.arm_slice] = [p.sigma**2 for p in self.problem.columns.arm]
        return variances


def pose_level(numbers: tuple[int, ...], *, with_ceres: bool) -> None:
    rng = np.random.default_rng(0)
    print("| shots | placements | solve, s | with noise and verdicts, s | SciPy / solve | Ceres / solve | apart |")
    print("|---|---|---|---|---|---|---|")
    for number in numbers:
        placements = max(5, number // 100)
        data = shots(number, placements, rng)
        found = estimate(data, noise="stated", parameters=link_parameters(data.arm))
        state, _ = start_of(data)
        start = replace(state, arm_step=np.zeros(len(found.problem.columns.arm)))
        ours = seconds(lambda p=found.problem, s=start: solve(p, s, SCALES))
        whole = seconds(lambda d=data: estimate(d), 1 if number > 1000 else 3)
        answer = solve(found.problem, start, SCALES).state
        ratios, differences = ["-", "-"], []
        if number <= 500:
            flat = Flat(found.problem, start)
            for k, peer in enumerate((flat.scipy, flat.ceres) if with_ceres else (flat.scipy,)):
                ratios[k] = f"{seconds(peer, 1) / ours:.0f}"
                differences.append(np.abs(flat.state(peer()).X - answer.X).max())
        apart = f"{max(differences):.0e}" if differences else "-"
        print(
            f"| {number} | {placements} | {ours:.4f} | {whole:.3f} | {ratios[0]} | {ratios[1]} | {apart} |", flush=True
        )


def pixel_level() -> None:
    """50 stereo shots of 108 corners: cameras, then arm, head, lenses and placements."""
    nominal = load_arm("abb_irb1400", folder=Path())
    board = Chessboard(columns=12, rows=9, square_m=0.02)
    recording = simulate_cell(SCENARIOS["paper"], nominal, board, seed=0, images=False).recording
    cameras = calibrate_rig(recording, recording.pixels)
    seen = cameras.detections
    calibrating = seen.shots < 50
    names, slots = np.unique(seen.shots[calibrating], return_inverse=True)
    targets = locate_targets(cameras.rig, cameras.points_m, selected(seen, calibrating), recording.ids)
    problem = RigProblem(
        slots,
        seen.cameras[calibrating],
        seen.points[calibrating],
        board.points_m[seen.points[calibrating]],
        seen.pixels[calibrating],
        seen.sigmas_px[calibrating],
        RigUnknowns(np.ones((2, 9), dtype=bool), np.array([False, True])),
        np.full((2, 9), np.inf),
    )
    G, S = problem.unknowns.size, len(names)
    rng = np.random.default_rng(0)
    start = moved_rig(
        cameras.rig, problem.unknowns, np.r_[rng.normal(0, 1, 4), np.zeros(5), rng.normal(0, 1, 4), np.zeros(11)]
    )
    starts = apply_motion(targets.Ts_head_target, 1e-3 * rng.standard_normal((S, 6)))

    def rows(x: Floats) -> tuple[Floats, Floats]:
        rig, Ts = moved_rig(start, problem.unknowns, x[:G]), apply_motion(starts, x[G:].reshape(-1, 6))[slots]
        lever = (Ts[:, :3, :3] @ problem.points_target[:, :, None])[:, :, 0]
        pixels, by_point, by_rig, _ = rig_pixels(rig, problem.cameras, lever + Ts[:, :3, 3], problem.unknowns)
        J = np.zeros((*pixels.shape, len(x)))
        J[:, :, :G] = by_rig
        own = np.concatenate([by_point, -by_point @ hat(lever)], axis=2)
        for k in range(6):
            J[np.arange(len(J)), :, G + 6 * slots + k] = own[:, :, k]
        weight = 1.0 / problem.sigmas_px[:, None]
        return ((pixels - problem.pixels) * weight).ravel(), (J * weight[:, :, None]).reshape(-1, len(x))

    ours = seconds(lambda: refine_rig(problem, start, starts))
    x0 = np.zeros(G + 6 * S)
    peer = seconds(lambda: least_squares(lambda x: rows(x)[0], x0, jac=lambda x: rows(x)[1], x_scale="jac"), 1)
    whole = seconds(lambda: calibrate_jointly(recording, cameras, SolveOptions(), Silent()), 1)
    print(
        f"50 stereo shots of 108 corners, {G} unknowns of the cameras: {ours:.3f} s, SciPy {peer / ours:.0f} times that"
    )
    print(f"the same with arm, head, lenses, noise, verdicts and the choice of optional blocks: {whole:.2f} s")


if __name__ == "__main__":
    pose_level((50, 500, 5000), with_ceres="--without-ceres" not in sys.argv)
    pixel_level()
