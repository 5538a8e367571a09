"""How good is an arm from a laser tracker, and how honest are its intervals?

    python benchmarks/tracker_arm.py [--seeds 20] [--coupling 0.001]

One row per simulated IRB 1400 (links off by 0.5 mm and 0.03°, coupling by 0.001, joints that repeat to 50 µrad, tracker
noise 0.02 mm, six sweeps of 120° and 60 free points): the error of the reflector's place, as the tracker would see it,
at 1,000 fresh poses all over the joint ranges; the worst axis; the coupling; then how many of the 95 % intervals of
parameters, reflectors and axes hold the truth.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from sixthlink.calibrate.arm import BLOCKS, link_parameters, optional_parameters, parameter_values
from sixthlink.calibrate.tracked_arm import TrackedArm, calibrate_arm_by_tracker
from sixthlink.files import load_arm
from sixthlink.geometry import Floats, inverse, transform_points
from sixthlink.progress import Silent
from sixthlink.robot import Arm, link_poses
from sixthlink.simulate import SCENARIOS, SimulatedTracking, TrackerSession, simulate_tracking

COVERAGE_95 = 1.959964


def errors_mm(found: TrackedArm, sim: SimulatedTracking, nominal: Arm, seed: int) -> Floats:
    """Distances of the reflector from where it would truly be seen, at poses that nobody measured."""
    spare = 0.04 * np.diff(nominal.limits, axis=1)[:, 0]
    q = np.random.default_rng(10_000 + seed).uniform(
        nominal.limits[:, 0] + spare, nominal.limits[:, 1] - spare, (1000, 6)
    )
    place = np.tile(found.reflectors[0].place_m, (len(q), 1))
    seen = transform_points(inverse(found.T_base_tracker), transform_points(link_poses(found.arm, q, 6), place))
    return np.linalg.norm(seen - sim.truth.seen_at(q, "R1", 6), axis=1) * 1e3


def inside(found: TrackedArm, sim: SimulatedTracking) -> Floats:
    """Whether 95 % intervals hold the truth, for every number that does not depend on where base and flange are put.

    d1, θ1 and the last link are conventions of frames; with them moves what they carry.
    """
    optional = (p for block in BLOCKS for p in optional_parameters(found.nominal, block))
    parameters = (*link_parameters(found.nominal), *optional)
    truth = dict(zip((p.name for p in parameters), parameter_values(sim.truth.arm, parameters), strict=True))
    own = {"theta1", "d1", "theta6", "d6", "a6", "alpha6"}
    rows = [abs(p.value - truth[p.name]) < COVERAGE_95 * p.std for p in found.joint.arm if p.free and p.name not in own]
    return np.array(rows, dtype=float)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--coupling", type=float, default=1e-3)
    options = parser.parse_args()
    nominal = load_arm("abb_irb1400", folder=Path())
    scenario = replace(SCENARIOS["paper"], coupling_sigma=options.coupling)
    rows, held, axes = [], [], []
    print(
        "| seed | mean [mm] | max [mm] | worst axis [mrad] | coupling error | held-out [mm] | nominal held-out [mm] |"
    )
    print("|---|---|---|---|---|---|---|")
    for seed in range(options.seeds):
        sim = simulate_tracking(scenario, TrackerSession(), nominal, seed=seed)
        found = calibrate_arm_by_tracker(sim.record, Silent())
        errors = errors_mm(found, sim, nominal, seed)
        off = [
            np.arccos(min(1.0, float(a.axis.direction @ t))) for a, t in zip(found.axes, sim.truth.axes, strict=True)
        ]
        true = sim.truth.arm.joint_map[nominal.own_steps[2], 1]
        coupling = abs(found.couplings[0].value - true)
        held.append(inside(found, sim))
        axes += [o / a.direction_std_rad for o, a in zip(off, found.axes, strict=True)]
        rows.append((errors.mean(), errors.max(), 1e3 * max(off), coupling, found.heldout.rms_m * 1e3))
        print(
            f"| {seed} | {errors.mean():.4f} | {errors.max():.4f} | {1e3 * max(off):.4f} | {coupling:.1e} | "
            f"{found.heldout.rms_m * 1e3:.4f} | {found.heldout_before.rms_m * 1e3:.4f} |",
            flush=True,
        )
    worst = np.max(rows, axis=0)
    print(f"| worst | {worst[0]:.4f} | {worst[1]:.4f} | {worst[2]:.4f} | {worst[3]:.1e} | {worst[4]:.4f} | |")
    share = np.concatenate(held)
    by_arm = np.array([h.mean() for h in held])
    print(
        f"\n95 % intervals of the arm's parameters hold the truth in {100 * share.mean():.1f} ± "
        f"{100 * by_arm.std(ddof=1) / np.sqrt(len(by_arm)):.1f} % of {len(share)}"
    )


if __name__ == "__main__":
    main()
