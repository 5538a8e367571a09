"""How is a study computed, here or on a cluster, stopped, taken up again, and the same in the end?

Every trial follows from the study's seed and its own number, so it does not matter where, when and in which turn it is
computed. A finished trial goes to the table at once; a table that is there already is gone on with.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sixthlink.errors import Finding, InputError, Interrupted
from sixthlink.files import append_trial, load_arm, read_study, write_study
from sixthlink.progress import Progress
from sixthlink.simulate import SCENARIOS
from sixthlink.study import Plan, PointSummary, Row, Study, grid, planned, run_trial, summaries
from sixthlink.workflow.outcome import Outcome, versions
from sixthlink.workflow.workers import executor_for

__all__ = ["named_study", "run_study"]

ROBOT = "abb_irb1400"
"""The arm that the scenarios' distances suit."""

WAITING_PER_WORKER = 4
"""Trials that wait for each worker: none is idle, and little is lost when the study is stopped."""


def named_study(
    *,
    scenario: str,
    trials: int,
    placements: Sequence[int] = (),
    poses: Sequence[int] = (),
    pixel_noises_px: Sequence[float] = (),
    repeatabilities_urad: Sequence[float] = (),
    noise: str = "known",
    control: str = "none",
    source: str = "poses",
    seed: int = 0,
) -> Study:
    """A study of a named scenario, or of every combination of other numbers in it.

    Raises:
        InputError: The scenario is unknown.
    """
    if scenario not in SCENARIOS:
        what, expected = f"{scenario!r} is unknown", f"one of {sorted(SCENARIOS)}"
        raise InputError([Finding("--scenario", "scenario", what, expected, "choose one of them")])
    cells = grid(
        SCENARIOS[scenario],
        poses=poses,
        placements=placements,
        pixel_noises_px=pixel_noises_px,
        joint_repeatabilities_rad=[1e-6 * r for r in repeatabilities_urad],
    )
    return Study(cells, trials, seed, noise, control, source)


def run_study(
    out: Path,
    study: Study,
    *,
    progress: Progress,
    workers: int | None = None,
    scheduler: str | None = None,
) -> tuple[tuple[PointSummary, ...], Outcome]:
    """Compute what is missing of a study, and judge it.

    Args:
        out: Table that is written, or gone on with.
        study: What is studied.
        progress: Listener.
        workers: Local processes; one per core when None.
        scheduler: Address of a Dask scheduler whose workers compute instead of local processes.

    Returns:
        One summary per cell, and the table.

    Raises:
        InputError: The table belongs to another study, the cluster cannot be used, or the arm does not reach a cell.
        Interrupted: The user stopped the study, or the workers were lost; every finished trial is in the table.
    """
    settings = _settings(study)
    rows = _kept(out, settings)
    done = {(row.point, row.trial) for row in rows}
    missing = [(p, t) for t in range(study.trials) for p in range(len(study.scenarios)) if (p, t) not in done]
    if missing:
        plans = _plans(study, progress)
        write_study(out, settings, rows)
        total = study.trials * len(study.scenarios)
        try:
            with executor_for(scheduler, workers) as (executor, width):
                for finished in _computed(executor, width * WAITING_PER_WORKER, plans, study, missing):
                    append_trial(out, finished)
                    rows.extend(finished)
                    done.add((finished[0].point, finished[0].trial))
                    progress.step("trials", len({d for d in done if d[1] < study.trials}), total)
        except (KeyboardInterrupt, CancelledError, BrokenExecutor) as stop:
            what = "stopped" if isinstance(stop, KeyboardInterrupt) else "the workers were lost"
            raise Interrupted(
                f"{what}; {out} keeps {len(done)} finished trials, and the same command goes on from there"
            ) from stop
        write_study(out, settings, rows)
    return summaries((row for row in rows if row.trial < study.trials), study.source), Outcome({"table": out})


def _settings(study: Study) -> dict[str, Any]:
    """What makes two trials of one number the same trial: everything but how many there are."""
    told = asdict(study) | {"robot": ROBOT, "versions": versions()}
    del told["trials"]
    settings: dict[str, Any] = json.loads(json.dumps(told))
    return settings


def _kept(out: Path, settings: dict[str, Any]) -> list[Row]:
    """Finished trials of the table, if there is one."""
    if not out.exists():
        if not out.parent.is_dir():
            finding = Finding(str(out), "folder", "does not exist", "an existing folder for the table", "create it")
            raise InputError([finding])
        return []
    found, rows = read_study(out)
    differing = sorted(k for k in found.keys() | settings.keys() if found.get(k) != settings.get(k))
    if differing:
        raise InputError(
            [
                Finding(
                    str(out),
                    key,
                    f"is {_short(found.get(key))} in the table",
                    f"{_short(settings.get(key))} as asked for now",
                    "name another table, or ask for the same study",
                )
                for key in differing
            ]
        )
    return rows


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:80]}..."


def _plans(study: Study, progress: Progress) -> list[Plan]:
    arm = load_arm(ROBOT, folder=Path())
    plans = []
    for k, scenario in enumerate(study.scenarios, start=1):
        try:
            plans.append(planned(scenario, arm, seed=study.seed))
        except ValueError as problem:
            finding = Finding(
                "study", f"cell {k}", str(problem), "a cell that the arm can serve", "change its numbers or the seed"
            )
            raise InputError([finding]) from problem
        progress.step("cells", k, len(study.scenarios))
    return plans


def _computed(
    executor: Executor, waiting: int, plans: Sequence[Plan], study: Study, missing: Sequence[tuple[int, int]]
) -> Iterator[tuple[Row, ...]]:
    """Rows of the missing trials, as they become ready; a bounded number is under way at any time."""
    todo = iter(missing)
    under_way: set[Future[tuple[Row, ...]]] = set()
    while True:
        for point, trial in todo:
            under_way.add(executor.submit(run_trial, plans[point], study, point, trial))
            if len(under_way) >= waiting:
                break
        if not under_way:
            return
        ready, under_way = wait(under_way, return_when=FIRST_COMPLETED)
        for future in ready:
            yield future.result()
