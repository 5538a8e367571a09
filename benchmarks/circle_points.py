"""How well does a sweep show its joint's axis, how honest are its intervals, and how often is a good one blamed?

Prints the figures of docs/theory/circle_points.md:

    python benchmarks/circle_points.py [--trials 500] [--real FOLDER OF rosi_positioner_2axis]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from sixthlink.calibrate.tracker import AxisFit, fit_axis, sweep_of
from sixthlink.geometry import Floats, Line, common_normal, exp_rotation, moved_line, transform, transform_points

NOISE_M, RADIUS_M, JOINT_RAD = 2e-5, 0.8, 2.5e-5


def sweep(rng: np.random.Generator, arc_deg: float, points: int) -> tuple[Floats, Floats, Line]:
    """Points, joint angles and true axis of a joint that stands anywhere; even steps, its angles repeat to 0.02 mm."""
    T_tracker_joint = transform(exp_rotation(rng.uniform(-2, 2, 3)), rng.uniform(-3, 3, 3))
    q = np.linspace(0.0, np.deg2rad(arc_deg), points)
    circle = np.column_stack([RADIUS_M * np.cos(q), RADIUS_M * np.sin(q), 0.0 * q])
    seen = transform_points(T_tracker_joint, circle) + NOISE_M * rng.normal(size=circle.shape)
    axis = moved_line(T_tracker_joint, Line(np.zeros(3), np.array([0.0, 0.0, 1.0])))
    return seen, q + JOINT_RAD * rng.normal(size=points), axis


def covered(fit: AxisFit, truth: Line) -> Floats:
    """Whether the 95 % intervals of shift (2), tilt (2), height and radius hold the truth."""
    cosine = truth.direction @ fit.axis.direction
    tilt = fit.frame[:2] @ truth.direction / cosine
    gap = truth.point_m - fit.axis.point_m
    shift = fit.frame[:2] @ (gap - truth.direction * (gap @ fit.axis.direction) / cosine)
    height = (truth.point_m - fit.circles[0].centre_m) @ fit.axis.direction
    off = np.r_[shift, tilt, height, RADIUS_M - fit.circles[0].radius_m]
    return np.abs(off) < fit.expansion() * np.sqrt(np.diag(fit.covariance))


def row(arc_deg: float, points: int, trials: int, *, stated: bool) -> str:
    errors, stated_rad, inside, blamed = [], [], np.zeros(6), 0
    for seed in range(trials):
        seen, angles, truth = sweep(np.random.default_rng(seed), arc_deg, points)
        fit = fit_axis(sweep_of(seen, angles_rad=angles, noise_m=NOISE_M if stated else None))
        errors.append(float(common_normal(fit.axis, truth).angle_rad) * 1e3)
        stated_rad.append(fit.direction_uncertainty_rad * 1e3)
        inside += covered(fit, truth)
        blamed += bool(fit.findings)
    shares = 100.0 * inside / trials
    coverage = f"{shares.min():.1f} to {shares.max():.1f} %"
    return (
        f"| {arc_deg:.0f}° | {points} | {'stated' if stated else 'unknown'} | {np.mean(stated_rad):.3f} | "
        f"{np.mean(errors):.3f} | {np.quantile(errors, 0.95):.3f} | {coverage} | {blamed} |"
    )


def positioner(folder: Path) -> str:
    """The thirteen sweeps of a real positioner's second joint."""
    table = np.genfromtxt(folder / "measurements.csv", delimiter=",", names=True)
    points_m = np.column_stack([table["x_mm"], table["y_mm"], table["z_mm"]]) * 1e-3
    stops = np.round(table["j1_rad"], 2)
    fits = [fit_axis(sweep_of(points_m[stops == s], angles_rad=table["j2_rad"][stops == s])) for s in np.unique(stops)]
    rms = 1e3 * np.sqrt(np.mean(np.concatenate([f.deviations_m for f in fits]) ** 2, axis=0))
    radius = 1e3 * np.mean([f.circles[0].radius_m for f in fits])
    kept = sum(int(f.kept.sum()) for f in fits)
    slight = sum(any(x.kind == "slight path" for x in f.findings) for f in fits)
    each = [1e3 * f.radial_rms_m for f in fits]
    return (
        f"{len(fits)} sweeps, {kept} of {len(stops)} points, radius {radius:.1f} mm, radial {rms[0]:.3f} mm RMS "
        f"({min(each):.3f} to {max(each):.3f} a sweep), above {rms[1]:.3f} mm RMS, {slight} slight paths, "
        f"{sum(f.usable for f in fits)} usable"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=500)
    parser.add_argument("--real", type=Path)
    arguments = parser.parse_args()
    trials = arguments.trials
    if arguments.real:
        print(positioner(arguments.real))
    print(f"{trials} sweeps a row, radius {RADIUS_M} m, noise {NOISE_M * 1e3} mm per coordinate\n")
    print(
        "| arc | points | noise | stated direction [mrad] | mean error [mrad] | 95 % below [mrad] | coverage | blamed |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for arc_deg, points, stated in (
        (31, 30, True),
        (60, 30, True),
        (120, 5, False),
        (120, 8, True),
        (120, 12, True),
        (120, 12, False),
        (120, 20, True),
        (120, 30, True),
        (330, 12, False),
        (330, 30, True),
    ):
        print(row(arc_deg, points, trials, stated=stated), flush=True)


if __name__ == "__main__":
    main()
