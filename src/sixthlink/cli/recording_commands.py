"""Which commands work on a recording of shots?"""

from __future__ import annotations

import os
from pathlib import Path

import click

from sixthlink.cli.command import FILE, FOLDER, NOISE, command
from sixthlink.cli.console import EXIT_REFUSED, print_json, progress_bars

__all__ = ["calibrate", "compare", "detect", "simulate", "verify"]


@command()
@click.argument("out", type=FOLDER)
@click.option("--scenario", default="paper", show_default=True, help="Named scene: the paper's cell, or small.")
@click.option("--seed", default=0, show_default=True, help="Seed of every chance in the scene.")
@click.option("--no-images", is_flag=True, help="Write noisy pixels instead of images (seconds instead of minutes).")
@click.option(
    "--scale-placements",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Further ruler placements of kind scale, for calibration.",
)
@click.option("--tracker", is_flag=True, help="Also a laser tracker's record of the same arm, into OUT/tracker.")
def simulate(
    out: Path, *, scenario: str, seed: int, no_images: bool, scale_placements: int, tracker: bool, as_json: bool
) -> int:
    """Simulate a recording into OUT, and its truth into OUT/truth."""
    from sixthlink.workflow import simulate_folder

    with progress_bars(quiet=as_json) as progress:
        outcome = simulate_folder(
            out,
            scenario=scenario,
            seed=seed,
            images=not no_images,
            scale_placements=scale_placements,
            tracker=tracker,
            progress=progress,
        )
    files = {name: str(path) for name, path in outcome.files.items()}
    if as_json:
        print_json({"scenario": scenario, "seed": seed, "files": files})
    else:
        click.echo(f"simulated {scenario!r}, seed {seed}, into {out}; the truth is in {out / 'truth'}")
    return 0


@command()
@click.argument("recording", type=FOLDER)
@click.option("--no-cache", is_flag=True, help="Look at every image again, whatever was found in it before.")
@click.option("--workers", type=click.IntRange(min=1), help="Images at a time.  [default: one per processor]")
@click.option("--out", type=FOLDER, help="Folder for detections.csv; nothing is written without it.")
def detect(recording: Path, *, no_cache: bool, workers: int | None, out: Path | None, as_json: bool) -> int:
    """Find the target in every image of a RECORDING, and say what the images tell of the cameras.

    Names every image that shows nothing usable, and why; calibrates the lenses from these images alone, with their
    uncertainty; tells whether a given stereo calibration still fits. Exit code 1 where an image was refused or the
    stereo calibration is stale.
    """
    from sixthlink.cli.detection_summary import detection_as_dict, detection_summary
    from sixthlink.workflow import detect_folder

    with progress_bars(quiet=as_json) as progress:
        report, outcome = detect_folder(
            recording, out=out, cached=not no_cache, progress=progress, workers=workers or os.cpu_count() or 1
        )
    files = {name: str(path) for name, path in outcome.files.items()}
    if as_json:
        print_json(detection_as_dict(report) | {"files": files})
    else:
        click.echo(detection_summary(report, files))
    stale = any(check.stale for check in report.stereo)
    return EXIT_REFUSED if report.rejections or stale else 0


@command()
@click.argument("recording", type=FOLDER)
@click.option(
    "--solve",
    type=click.Choice(["auto", "joint", "paper"]),
    default="auto",
    show_default=True,
    help="joint: arm, head and placements together, weighted by what makes the noise; paper: the head alone by "
    "eq. (11) with QPSO and polish; auto: joint where there are joint values and kinematics.",
)
@click.option(
    "--holdout", default=0, show_default=True, help="Calibration shots to keep out of the fit, to judge it by."
)
@NOISE
@click.option("--arm", type=FILE, help="Arm file that replaces the recording's own kinematics.")
@click.option("--tracker", type=FILE, help="A laser tracker's record of the same arm: one problem with the images.")
@click.option("--out", type=FOLDER, help="Folder for the result.  [default: RECORDING/result]")
@click.option("--seed", default=0, show_default=True, help="Seed of the swarms.")
@click.option("--swarms", type=click.IntRange(min=1), default=8, show_default=True, help="Independent swarms.")
@click.option("--particles", type=click.IntRange(min=2), default=40, show_default=True, help="Particles per swarm.")
@click.option("--iterations", type=click.IntRange(min=1), default=1000, show_default=True, help="Iterations per swarm.")
@click.option(
    "--rotation-length-m",
    type=click.FloatRange(min=0.0, min_open=True, max=1e6),
    default=1.0,
    show_default=True,
    help="Metres that one unit of a rotation entry counts in eq. (11); the paper's millimetres are 0.001.",
)
@click.option(
    "--observable-rest",
    is_flag=True,
    help="Where the motion cannot show the whole head (4-axis arms), solve what it shows and name the rest.",
)
def calibrate(
    recording: Path,
    *,
    solve: str,
    holdout: int,
    noise: str,
    arm: Path | None,
    tracker: Path | None,
    out: Path | None,
    seed: int,
    swarms: int,
    particles: int,
    iterations: int,
    rotation_length_m: float,
    observable_rest: bool,
    as_json: bool,
) -> int:
    """Calibrate a RECORDING folder, head and arm, or the arm alone from touches; leave result.json and report.html."""
    from sixthlink.calibrate import SolveOptions
    from sixthlink.cli.summaries import calibration_as_dict, calibration_summary
    from sixthlink.solvers import SwarmBudget
    from sixthlink.workflow import calibrate_folder

    budget = SwarmBudget(swarms, particles, iterations)
    options = SolveOptions(seed, budget, rotation_length_m, observable_rest, noise)
    with progress_bars(quiet=as_json) as progress:
        result, outcome = calibrate_folder(
            recording,
            out=out,
            arm=arm,
            options=options,
            progress=progress,
            solve=solve,
            holdout=holdout,
            tracker=tracker,
        )
    files = {name: str(path) for name, path in outcome.files.items()}
    if as_json:
        print_json(calibration_as_dict(result) | {"files": files})
    else:
        click.echo(calibration_summary(result, files))
    return 0 if result.accepted else EXIT_REFUSED


@command()
@click.argument("recording", type=FOLDER)
@click.option("--arm", type=FILE, help="Arm file that replaces the recording's own kinematics.")
@click.option("--seed", default=0, show_default=True, help="Seed of the dealing of the shots and of the swarms.")
def compare(recording: Path, *, arm: Path | None, seed: int, as_json: bool) -> int:
    """Run every solver on a RECORDING and judge each on shots and placements that it did not see."""
    from sixthlink.calibrate import SolveOptions
    from sixthlink.cli.summaries import comparison_as_dict, comparison_summary
    from sixthlink.workflow import compare_folder

    with progress_bars(quiet=as_json) as progress:
        scores = compare_folder(recording, arm=arm, options=SolveOptions(seed), progress=progress)
    if as_json:
        print_json(comparison_as_dict(scores))
    else:
        click.echo(comparison_summary(scores))
    return 0


@command()
@click.argument("recording", type=FOLDER)
@click.option("--result", type=FILE, help="result.json, or its folder.  [default: RECORDING/result]")
@click.option("--arm", type=FILE, help="Arm file that replaces the kinematics.")
@click.option("--limit-mm", type=float, help="Largest RMS length error that is accepted [mm]; beyond it exit code 1.")
def verify(recording: Path, *, result: Path | None, arm: Path | None, limit_mm: float | None, as_json: bool) -> int:
    """Measure the length standard of a RECORDING with a calibration: the proof of its accuracy.

    One row per placement, before (nominal head and arm) and after. Shots that the calibration has seen are refused.
    """
    from sixthlink.cli.summaries import check_as_dict, check_summary
    from sixthlink.measure import statistics
    from sixthlink.units import MM
    from sixthlink.workflow import verify_folder

    with progress_bars(quiet=as_json) as progress:
        check, outcome = verify_folder(recording, result=result, arm=arm, progress=progress)
    files = {name: str(path) for name, path in outcome.files.items()}
    rms_m = statistics(check.after_m, check.standard.length_m).rms_m
    accepted = limit_mm is None or rms_m <= limit_mm * MM
    if as_json:
        print_json(check_as_dict(check) | {"accepted": accepted, "files": files})
    else:
        click.echo(check_summary(check, files))
        if not accepted:
            click.echo(f"refused: RMS error {rms_m / MM:.4f} mm is beyond the limit of {limit_mm:g} mm")
    return 0 if accepted else EXIT_REFUSED
