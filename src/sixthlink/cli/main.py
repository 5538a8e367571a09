"""Which commands are there? One function per command: parse, call the workflow, print."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from sixthlink.cli.console import EXIT_REFUSED, fail, print_json, progress_bars
from sixthlink.cli.study_options import study_options

__all__ = ["main"]

# The matrices are many and small: threads inside each product only wait for each other. Whoever wants them sets it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_FOLDER = click.Path(path_type=Path, file_okay=False)
_FILE = click.Path(path_type=Path)


def _command(**settings: Any) -> Callable[[Callable[..., int]], click.Command]:
    """A command with ``--json`` and ``--debug`` that turns errors into messages and exit codes."""

    def decorate(function: Callable[..., int]) -> click.Command:
        @main.command(**settings)
        @click.option("--json", "as_json", is_flag=True, help="Print one JSON object on standard output, nothing else.")
        @click.option("--debug", is_flag=True, help="Show the traceback of an error.")
        @functools.wraps(function)
        def run(*, as_json: bool, debug: bool, **options: Any) -> None:
            try:
                code = function(as_json=as_json, **options)
            except Exception as problem:
                if debug:
                    raise
                fail(problem, as_json=as_json)
            else:
                raise SystemExit(code)

        return run

    return decorate


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="sixthlink")
def main() -> None:
    """Calibrate a camera or stereo head as the last link of a robot arm, and prove it on a length standard.

    \b
    A first result, from nothing:
      sixthlink simulate cell --scenario paper     a simulated recording with its truth
      sixthlink calibrate cell                     cell/result/result.json and report.html
      sixthlink verify cell                        the ruler, before and after

    \b
    Your own robot:
      sixthlink init my-cell                       a commented recording to fill in

    Exit codes: 0 accepted, 1 done but a gate refuses, 2 the input is at fault, 3 our fault.
    """  # noqa: D301 - click wants the backspace character itself


@_command()
@click.argument("folder", type=_FOLDER)
def init(folder: Path, *, as_json: bool) -> int:
    """Write a commented skeleton of a recording into FOLDER: recording.yaml and shots.csv."""
    from sixthlink.files import write_skeleton

    files = write_skeleton(folder)
    if as_json:
        print_json({"files": [str(f) for f in files]})
    else:
        click.echo("\n".join(f"wrote {f}" for f in files))
        click.echo("Fill them in, put the images beside them, then: sixthlink calibrate " + str(folder))
    return 0


@_command()
def robots(*, as_json: bool) -> int:
    """List the robots that sixthlink knows by name, with the source of their numbers."""
    from sixthlink.files import load_arm, maker_names

    arms = {name: load_arm(name, folder=Path()) for name in maker_names()}
    if as_json:
        print_json({"robots": [{"name": n, "title": a.name, "source": a.source} for n, a in arms.items()]})
    else:
        for name, arm in arms.items():
            click.echo(f"{name:<18}{arm.name} ({len(arm.joints)} joints)\n{'':<18}{arm.source}")
    return 0


@_command()
@click.argument("out", type=_FOLDER)
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
def simulate(out: Path, *, scenario: str, seed: int, no_images: bool, scale_placements: int, as_json: bool) -> int:
    """Simulate a recording into OUT, and its truth into OUT/truth."""
    from sixthlink.workflow import simulate_folder

    with progress_bars(quiet=as_json) as progress:
        outcome = simulate_folder(
            out,
            scenario=scenario,
            seed=seed,
            images=not no_images,
            scale_placements=scale_placements,
            progress=progress,
        )
    files = {name: str(path) for name, path in outcome.files.items()}
    if as_json:
        print_json({"scenario": scenario, "seed": seed, "files": files})
    else:
        click.echo(f"simulated {scenario!r}, seed {seed}, into {out}; the truth is in {out / 'truth'}")
    return 0


@_command()
@click.argument("recording", type=_FOLDER)
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
@click.option(
    "--noise",
    type=click.Choice(["estimated", "stated"]),
    default="estimated",
    show_default=True,
    help="Joint repeatability: estimated from the residuals, or as the robot's file states it.",
)
@click.option("--arm", type=_FILE, help="Arm file that replaces the recording's own kinematics.")
@click.option("--out", type=_FOLDER, help="Folder for the result.  [default: RECORDING/result]")
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
            recording, out=out, arm=arm, options=options, progress=progress, solve=solve, holdout=holdout
        )
    files = {name: str(path) for name, path in outcome.files.items()}
    if as_json:
        print_json(calibration_as_dict(result) | {"files": files})
    else:
        click.echo(calibration_summary(result, files))
    return 0 if result.accepted else EXIT_REFUSED


@_command()
@click.argument("recording", type=_FOLDER)
@click.option("--arm", type=_FILE, help="Arm file that replaces the recording's own kinematics.")
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


@_command()
@click.argument("recording", type=_FOLDER)
@click.option("--result", type=_FILE, help="result.json, or its folder.  [default: RECORDING/result]")
@click.option("--arm", type=_FILE, help="Arm file that replaces the kinematics.")
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


@_command()
@click.argument("table", type=_FILE)
@study_options
def study(table: Path, *, workers: int | None, scheduler: str | None, as_json: bool, **wanted: Any) -> int:
    """Simulate many recordings, estimate each, and judge the uncertainties: every number goes to TABLE (CSV).

    \b
    Three questions, each answered with its Monte Carlo standard error:
      coverage     do 93-97 % of the 95 % intervals contain the truth?
      chi2         are the residuals as large as the noise says, 0.98-1.02?
      efficiency   Cramér-Rao bound over mean square error, at least 0.95?
    With few trials the limits are as wide as four standard errors.

    \b
    Examples:
      sixthlink study paper.csv --trials 2000                      the paper's cell
      sixthlink study shots.csv --poses 5 --poses 10 --poses 20    error against number of shots
      sixthlink study wrong.csv --control unwhitened               must be refused: exit code 1
      sixthlink study big.csv --scheduler tcp://10.0.0.1:8786      on a Dask cluster

    Options that may be given several times span a grid of cells. Ctrl-C loses nothing (exit code 130): the same
    command goes on, more --trials add to the table, and the finished table is the same wherever it was computed.
    """  # noqa: D301 - click wants the backspace character itself
    from sixthlink.cli.study_summary import study_as_dict, study_summary
    from sixthlink.workflow import named_study, run_study

    asked = named_study(**wanted)
    with progress_bars(quiet=as_json) as progress:
        points, outcome = run_study(table, asked, progress=progress, workers=workers, scheduler=scheduler)
    files = {name: str(path) for name, path in outcome.files.items()}
    if as_json:
        print_json(study_as_dict(asked, points) | {"files": files})
    else:
        click.echo(study_summary(asked, points, files))
    return 0 if all(p.passed for p in points) else EXIT_REFUSED
