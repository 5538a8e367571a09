"""What can be asked of a study?"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

__all__ = ["study_options"]

_POSITIVE = click.IntRange(min=1)
_SIZE = click.FloatRange(min=0.0, min_open=True)

_OPTIONS = (
    click.option("--trials", type=_POSITIVE, default=100, show_default=True, help="Recordings per cell."),
    click.option("--scenario", default="paper", show_default=True, help="Named scene to begin with."),
    click.option("--placements", type=_POSITIVE, multiple=True, help="Board placements.  [default: the scene's]"),
    click.option("--poses", type=_POSITIVE, multiple=True, help="Shots per placement.  [default: the scene's]"),
    click.option(
        "--pixel-noise-px",
        "pixel_noises_px",
        type=_SIZE,
        multiple=True,
        help="Noise of a pixel coordinate.  [default: the scene's]",
    ),
    click.option(
        "--repeatability-urad",
        "repeatabilities_urad",
        type=_SIZE,
        multiple=True,
        help="Noise of a joint [µrad].  [default: the scene's]",
    ),
    click.option(
        "--noise",
        type=click.Choice(["known", "estimated"]),
        default="known",
        show_default=True,
        help="Whether the estimator is told the joints' noise or finds it.",
    ),
    click.option(
        "--control",
        type=click.Choice(["none", "weights-wrong-by-two", "unwhitened"]),
        default="none",
        show_default=True,
        help="Weigh wrongly on purpose: the verdicts must refuse.",
    ),
    click.option(
        "--from",
        "source",
        type=click.Choice(["poses", "pixels"]),
        default="poses",
        show_default=True,
        help="Draw target poses with the noise of their pixels (fast), or pixels, and calibrate the cameras too.",
    ),
    click.option("--seed", default=0, show_default=True, help="Seed of every chance in the study."),
    click.option("--workers", type=_POSITIVE, help="Local processes.  [default: one per core]"),
    click.option("--scheduler", help="Address of a Dask scheduler whose workers compute, like tcp://127.0.0.1:8786."),
)


def study_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of a study."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
