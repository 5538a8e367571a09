"""Which commands are there? One function per command: parse, call the workflow, print."""

from __future__ import annotations

import os

import click

from sixthlink.cli.arm_commands import arm, compensate
from sixthlink.cli.first_commands import init, robots
from sixthlink.cli.recording_commands import calibrate, compare, detect, simulate, verify
from sixthlink.cli.study_command import study
from sixthlink.cli.target_command import target

__all__ = ["main"]

# The matrices are many and small: threads inside each product only wait for each other. Whoever wants them sets it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


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
      sixthlink arm my-tracker                     the arm from a laser tracker

    Exit codes: 0 accepted, 1 done but a gate refuses, 2 the input is at fault, 3 our fault.
    """  # noqa: D301 - click wants the backspace character itself


for _command in (init, robots, simulate, detect, calibrate, compare, verify, arm, compensate, study, target):
    main.add_command(_command)
