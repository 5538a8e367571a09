"""Who computes: processes of this machine, or the workers of a Dask cluster?

Both speak the interface of :mod:`concurrent.futures`. Every worker uses one thread for its linear algebra: many small
problems run side by side, and sums are added in the same order everywhere.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context
from typing import Any

from sixthlink.errors import Finding, InputError
from sixthlink.workflow.outcome import versions

__all__ = ["executor_for"]

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}

ANSWER_S, WORKERS_S = 10.0, 10.0
"""How long a scheduler may take to answer, and a first worker to appear [s]."""


@contextmanager
def executor_for(scheduler: str | None, workers: int | None) -> Iterator[tuple[Executor, int]]:
    """An executor and the number of trials that it computes at once.

    Args:
        scheduler: Address of a Dask scheduler, or None for processes of this machine.
        workers: Number of local processes; one per core when None.

    Raises:
        InputError: The cluster cannot be used.
    """
    if scheduler is not None:
        with _cluster(scheduler) as found:
            yield found
        return
    count = workers or os.cpu_count() or 1
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    pool = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_leave_interrupts_to_the_parent)
    try:
        yield pool, count
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _cluster(address: str) -> Iterator[tuple[Executor, int]]:
    try:
        distributed: Any = import_module("distributed")
    except ImportError as problem:
        cure = "pip install 'sixthlink[cluster]', or leave out --scheduler to use this machine's cores"
        raise _unusable(address, "needs the package distributed, which is not installed", cure) from problem
    try:
        client = distributed.Client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, ValueError) as problem:
        cure = "start one with 'dask scheduler', give the address that it prints, or leave out --scheduler"
        raise _unusable(address, f"does not answer ({problem})", cure) from problem
    try:
        count = _ready_workers(client, address)
        executor = client.get_executor(pure=False)
        try:
            yield executor, count
        finally:
            executor.shutdown(wait=False)
    finally:
        client.close()


def _ready_workers(client: Any, address: str) -> int:
    """Number of threads of the cluster's workers, all of which have the software of this process."""
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError as problem:
        cure = f"start some with 'dask worker {address}'"
        raise _unusable(address, "has no workers", cure) from problem
    cure = "install the same sixthlink, NumPy and SciPy on every worker as here"
    try:
        there = client.run(versions)
    except Exception as problem:  # whatever a worker's missing or broken installation raises
        raise _unusable(address, f"has workers that cannot run sixthlink ({problem})", cure) from problem
    other = {worker: found for worker, found in there.items() if found != versions()}
    if other:
        worker, found = next(iter(other.items()))
        raise _unusable(address, f"has a worker {worker} with {found} instead of {versions()}", cure)
    return sum(client.nthreads().values())


def _unusable(address: str, what: str, cure: str) -> InputError:
    return InputError([Finding("--scheduler", address, what, "a Dask scheduler with workers", cure)])
