"""With which commands does somebody begin?"""

from __future__ import annotations

from pathlib import Path

import click

from sixthlink.cli.command import FOLDER, command
from sixthlink.cli.console import print_json

__all__ = ["init", "robots"]


@command()
@click.argument("folder", type=FOLDER)
@click.option("--tracker", is_flag=True, help="A laser tracker's record instead: tracker.yaml and points.csv.")
def init(folder: Path, *, tracker: bool, as_json: bool) -> int:
    """Write a commented skeleton of a recording into FOLDER: recording.yaml and shots.csv."""
    from sixthlink.files import write_skeleton, write_tracker_skeleton

    files = write_tracker_skeleton(folder) if tracker else write_skeleton(folder)
    if as_json:
        print_json({"files": [str(f) for f in files]})
    else:
        click.echo("\n".join(f"wrote {f}" for f in files))
        beside, then = ("the instrument's tables", "arm") if tracker else ("the images", "calibrate")
        click.echo(f"Fill them in, put {beside} beside them, then: sixthlink {then} {folder}")
    return 0


@command()
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
