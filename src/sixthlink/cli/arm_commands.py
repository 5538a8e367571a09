"""Which commands work on an arm and a laser tracker's record?"""

from __future__ import annotations

from pathlib import Path

import click

from sixthlink.cli.command import FILE, FOLDER, NOISE, command
from sixthlink.cli.console import EXIT_REFUSED, print_json, progress_bars

__all__ = ["arm", "compensate"]


@command()
@click.argument("record", type=FILE)
@click.option("--arm", type=FILE, help="Arm file that replaces the record's own kinematics.")
@NOISE
@click.option("--out", type=FOLDER, help="Folder for the result.  [default: RECORD/result]")
def arm(record: Path, *, arm: Path | None, noise: str, out: Path | None, as_json: bool) -> int:
    """Calibrate an arm from a laser tracker's RECORD; leave arm.yaml, result.json and report.html.

    RECORD is a folder with tracker.yaml and the instrument's own tables: joint sweeps, free measurements, or both.

    \b
    Examples:
      sixthlink init my-tracker --tracker                      a commented record to fill in
      sixthlink arm my-tracker                                 circles, axes, kinematics, held-out error
      sixthlink calibrate cell --arm my-tracker/result/arm.yaml --solve paper    the head with the better arm
      sixthlink calibrate cell --tracker my-tracker            images and tracker in one problem
    """  # noqa: D301 - click wants the backspace character itself
    from sixthlink.cli.tracked_arm_summary import tracked_arm_summary
    from sixthlink.files import tracked_arm_as_dict
    from sixthlink.workflow import arm_from_record

    with progress_bars(quiet=as_json) as progress:
        result, read, outcome = arm_from_record(record, out=out, arm=arm, noise=noise, progress=progress)
    files = {name: str(path) for name, path in outcome.files.items()}
    if as_json:
        print_json(tracked_arm_as_dict(result, read) | {"files": files})
    else:
        click.echo(tracked_arm_summary(result, files))
    return 0 if result.accepted else EXIT_REFUSED


@command()
@click.argument("targets", type=FILE)
@click.option("--arm", type=FILE, required=True, help="The calibrated arm, for example result/arm.yaml.")
@click.option("--nominal", help="The arm as the controller believes it to be: a known robot's name, or an arm file.")
@click.option("--orientation", help="Orientation of the poses in TARGETS, for example quaternion-wxyz.")
@click.option("--out", type=FILE, required=True, help="Corrected table to write (CSV).")
def compensate(
    targets: Path, *, arm: Path, nominal: str | None, orientation: str | None, out: Path, as_json: bool
) -> int:
    """Correct programmed joint values for controllers that accept no new kinematics.

    TARGETS is a CSV with one row per target and a column per joint, named with its unit: q1_deg, q2_deg, ... The
    desired pose is where the nominal arm goes with them, or, with --orientation, the columns x_mm, y_mm, z_mm and
    those of the orientation. Every corrected row is put through the calibrated arm again.

    \b
    Example:
      sixthlink compensate program.csv --arm result/arm.yaml --nominal abb_irb1400 --out corrected.csv
    """  # noqa: D301 - click wants the backspace character itself
    from sixthlink.units import DEG, MM
    from sixthlink.workflow import compensate_table

    found, outcome = compensate_table(targets, arm=arm, nominal=nominal, orientation=orientation, out=out)
    (shift_m, turn_rad), (left_m, left_rad) = found.before.max(axis=0).tolist(), found.after.max(axis=0).tolist()
    if as_json:
        figures = {
            "before_max_m": shift_m,
            "before_max_rad": turn_rad,
            "after_max_m": left_m,
            "after_max_rad": left_rad,
        }
        files = {name: str(path) for name, path in outcome.files.items()}
        print_json({"targets": len(found.joints), **figures, "files": files})
    else:
        click.echo(
            f"{len(found.joints)} targets corrected: off by up to {shift_m / MM:.4f} mm and {turn_rad / DEG:.4f}° "
            f"before, {left_m / MM:.1e} mm and {left_rad / DEG:.1e}° after, by the calibrated arm's forward kinematics"
        )
        click.echo(f"wrote {out}")
    return 0
