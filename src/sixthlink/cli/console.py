"""How does the console show progress, results and errors?"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from sixthlink.errors import InputError, Interrupted, SixthlinkError
from sixthlink.progress import Progress, Silent

__all__ = [
    "EXIT_INPUT",
    "EXIT_INTERRUPTED",
    "EXIT_OK",
    "EXIT_OURS",
    "EXIT_REFUSED",
    "fail",
    "print_json",
    "progress_bars",
]

EXIT_OK, EXIT_REFUSED, EXIT_INPUT, EXIT_OURS = 0, 1, 2, 3
"""Accepted; done but a gate refuses; the input is at fault; our fault."""

EXIT_INTERRUPTED = 130
"""What shells report of a program that was stopped by Ctrl-C: long work that can be gone on with."""

SHOWN_FINDINGS = 100
"""Findings that a terminal is given to read; one mistake in a long table can make thousands."""


class _Bars:
    """Progress as one bar per stage on standard error."""

    def __init__(self, bars: Any) -> None:
        self._bars = bars
        self._tasks: dict[str, Any] = {}

    def step(self, stage: str, done: int, total: int) -> None:
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=total)
        self._bars.update(self._tasks[stage], completed=done, total=total)


@contextmanager
def progress_bars(*, quiet: bool) -> Iterator[Progress]:
    """Progress bars on standard error while the block runs; silent when ``quiet``.

    Off a terminal each finished stage prints one line instead.
    """
    if quiet:
        yield Silent()
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as RichProgress

    columns = (TextColumn("{task.description:<18}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with RichProgress(*columns, console=Console(stderr=True)) as bars:
        yield _Bars(bars)


def print_json(data: Any) -> None:
    """Print one JSON object on standard output."""
    click.echo(json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False))


def fail(problem: Exception, *, as_json: bool) -> None:
    """Say what went wrong and leave with the exit code that belongs to it."""
    ours = not isinstance(problem, SixthlinkError)
    if as_json:
        findings = [vars(f) for f in problem.findings] if isinstance(problem, InputError) else []
        print_json({"error": type(problem).__name__, "message": str(problem), "findings": findings})
    else:
        click.echo(_in_words(problem, ours=ours), err=True)
    if isinstance(problem, Interrupted):
        sys.exit(EXIT_INTERRUPTED)
    sys.exit(EXIT_OURS if ours else EXIT_INPUT)


def _in_words(problem: Exception, *, ours: bool) -> str:
    if ours:
        return (
            f"sixthlink failed: {type(problem).__name__}: {problem}\n"
            "This is a defect of sixthlink, not of your data; nothing was written. "
            "Run again with --debug for the traceback and report it."
        )
    if isinstance(problem, InputError):
        count = len(problem.findings)
        shown = "\n".join(str(finding) for finding in problem.findings[:SHOWN_FINDINGS])
        more = f", the first {SHOWN_FINDINGS} shown, all with --json" if count > SHOWN_FINDINGS else ""
        return f"{shown}\n{count} finding{'s' if count != 1 else ''}{more}; nothing was written."
    return str(problem) if isinstance(problem, Interrupted) else f"{problem}\nNothing was written."
