"""What do all commands have in common?"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from sixthlink.cli.console import fail

__all__ = ["FILE", "FOLDER", "NOISE", "command"]

FOLDER = click.Path(path_type=Path, file_okay=False)
FILE = click.Path(path_type=Path)


def command(**settings: Any) -> Callable[[Callable[..., int]], click.Command]:
    """A command with ``--json`` and ``--debug`` that turns errors into messages and exit codes."""

    def decorate(function: Callable[..., int]) -> click.Command:
        @click.command(cls=click.Command, **settings)
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


NOISE = click.option(
    "--noise",
    type=click.Choice(["estimated", "stated"]),
    default="estimated",
    show_default=True,
    help="Joint repeatability: estimated from the residuals, or as the robot's file states it.",
)
