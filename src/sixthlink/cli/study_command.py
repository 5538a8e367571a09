"""Which command judges the uncertainties?"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from sixthlink.cli.command import FILE, command
from sixthlink.cli.console import EXIT_REFUSED, print_json, progress_bars
from sixthlink.cli.study_options import study_options

__all__ = ["study"]


@command()
@click.argument("table", type=FILE)
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
