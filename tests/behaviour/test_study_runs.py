"""A study is the same table here, on a cluster, and stopped and gone on with."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from distributed import LocalCluster

from sixthlink.cli.main import main
from sixthlink.errors import InputError, Interrupted
from sixthlink.files import read_study
from sixthlink.progress import Silent
from sixthlink.study import Study
from sixthlink.workflow import named_study, run_study, workers

TRIALS = 4
LOOPBACK = {
    "host": "127.0.0.1",
    "dashboard_address": "127.0.0.1:0",  # any free port: a cluster of somebody else may hold the usual one
    "worker_dashboard_address": None,
    "scheduler_kwargs": {"dashboard": False},
}


def asked(**other) -> Study:
    return named_study(scenario="small", **{"trials": TRIALS, "poses": (4, 5), **other})


@pytest.fixture(scope="module")
def table(tmp_path_factory) -> Path:
    """The table of an uninterrupted study by a local process."""
    path = tmp_path_factory.mktemp("study") / "local.csv"
    run_study(path, asked(), progress=Silent(), workers=1)
    return path


class StopsAfter:
    """Ctrl-C after so many trials."""

    def __init__(self, trials: int) -> None:
        self.trials = trials

    def step(self, stage: str, done: int, total: int) -> None:
        if stage == "trials" and done == self.trials:
            raise KeyboardInterrupt


def trials_of(path: Path) -> set[tuple[int, int]]:
    return {(row.point, row.trial) for row in read_study(path)[1]}


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """Address of a scheduler on the loopback address, with one worker process."""
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, **LOOPBACK) as started:
        yield started.scheduler_address


def test_a_dask_cluster_gives_the_same_table_bit_for_bit(table, cluster, tmp_path):
    path = tmp_path / "dask.csv"
    run_study(path, asked(), progress=Silent(), scheduler=cluster)
    assert path.read_bytes() == table.read_bytes()


def test_stopped_here_and_gone_on_with_on_a_cluster_is_the_same_table(table, cluster, tmp_path):
    path = tmp_path / "stopped.csv"
    with pytest.raises(Interrupted, match="the same command goes on"):
        run_study(path, asked(), progress=StopsAfter(3), workers=1)
    kept = trials_of(path)
    assert len(kept) == 3
    with path.open("ab") as file:  # and the power went while the next trial was written
        file.write(b"0,3,head.x,m,0.0,1.25e-0")
    assert trials_of(path) == kept
    run_study(path, asked(), progress=Silent(), scheduler=cluster)
    assert path.read_bytes() == table.read_bytes()


def test_a_scheduler_without_workers_is_said_so(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "WORKERS_S", 0.3)
    with LocalCluster(n_workers=0, processes=True, **LOOPBACK) as idle:
        address = idle.scheduler_address
        with pytest.raises(InputError, match=f"has no workers.*start some with 'dask worker {address}'"):
            run_study(tmp_path / "t.csv", asked(), progress=Silent(), scheduler=address)


def test_a_finished_table_is_only_judged(table, tmp_path):
    copy = tmp_path / "copy.csv"
    copy.write_bytes(table.read_bytes())
    done = CliRunner().invoke(
        main, ["study", str(copy), "--scenario", "small", "--trials", "2", "--poses", "4", "--poses", "5", "--json"]
    )
    found = json.loads(done.stdout)
    assert done.exit_code == (0 if found["passed"] else 1)
    assert [p["trials"] for p in found["points"]] == [2, 2]
    assert {"coverage", "chi2", "mahalanobis", "efficiency", "settled"} == {
        v["name"] for v in found["points"][0]["verdicts"]
    }
    assert copy.read_bytes() == table.read_bytes()
    told = CliRunner().invoke(
        main, ["study", str(copy), "--scenario", "small", "--trials", "4", "--poses", "4", "--poses", "5"]
    )
    assert "ruler lengths" in told.output
    assert "efficiency" in told.output


def test_the_table_of_another_study_is_left_alone(table):
    before = table.read_bytes()
    with pytest.raises(InputError, match="seed: is 0 in the table, expected 1 as asked for now; name another table"):
        run_study(table, asked(seed=1), progress=Silent())
    assert table.read_bytes() == before


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "# sixthlink study {\n", "# sixthlink study {}\npoint\n", "\x00"])
def test_any_other_file_is_left_alone(tmp_path, text):
    path = tmp_path / "mine.csv"
    path.write_text(text)
    with pytest.raises(InputError, match="name a file that a study wrote"):
        run_study(path, asked(), progress=Silent())
    assert path.read_text() == text


def test_a_scheduler_that_does_not_answer_is_said_so(tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "ANSWER_S", 0.3)
    with pytest.raises(InputError, match=r"tcp://127\.0\.0\.1:1: does not answer.*start one with 'dask scheduler'"):
        run_study(tmp_path / "t.csv", asked(), progress=Silent(), scheduler="tcp://127.0.0.1:1")
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'sixthlink\[cluster\]'"):
        run_study(tmp_path / "t.csv", asked(), progress=Silent(), scheduler="tcp://127.0.0.1:1")


def test_what_cannot_be_studied_is_said_so(tmp_path):
    with pytest.raises(InputError, match=r"'nowhere' is unknown, expected one of"):
        named_study(scenario="nowhere", trials=1)
    with pytest.raises(InputError, match=r"does not exist.*create it"):
        run_study(tmp_path / "no" / "t.csv", asked(), progress=Silent())
