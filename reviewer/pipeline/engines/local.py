"""Engine `local`: this process, threads around one GPU, or several processes.

Several processes are for processors: each has models of its own and its share of the cores. A GPU
has one set of models, which threads keep busy.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from reviewer.pipeline.engines import LateWorker, lost
from reviewer.pipeline.members import Members
from reviewer.pipeline.settings import PipelineSettings
from reviewer.pipeline.work import PairReport, PairTask, PairWorker

AHEAD = 2
"""Tasks that wait for each worker, so that none waits for the store."""


class InProcess:
    """One pair after the other, or `threads` at a time around the same models."""

    def __init__(self, settings: PipelineSettings, members: Members, threads: int = 1) -> None:
        self._worker = PairWorker(settings, members)
        self._threads = threads

    def outcomes(self, tasks: Iterable[PairTask]) -> Iterator[PairReport]:
        """Yield one outcome per task."""
        if self._threads == 1:
            yield from map(self._worker.do, tasks)
            return
        with ThreadPoolExecutor(self._threads) as pool:
            pending: set[Future[PairReport]] = set()
            for task in tasks:
                pending.add(pool.submit(self._worker.do, task))
                if len(pending) >= AHEAD * self._threads:
                    done, pending = wait(pending, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in done)
            yield from (future.result() for future in pending)


class Processes:
    """Several processes; one that dies is replaced, and the pair that killed it is found."""

    def __init__(self, settings: PipelineSettings, workers: int) -> None:
        self._settings = settings
        self._workers = workers

    def outcomes(self, tasks: Iterable[PairTask]) -> Iterator[PairReport]:
        """Yield one outcome per task."""
        source = iter(tasks)
        suspects: list[PairTask] = []
        more = True
        while more:
            more = yield from self._until_broken(source, suspects)
            # Which of the pairs in hand it was is not told: each is done in a process of its own.
            while suspects:
                yield self._alone(suspects.pop())

    def _until_broken(
        self, source: Iterator[PairTask], suspects: list[PairTask]
    ) -> Generator[PairReport, None, bool]:
        """Yield outcomes until all tasks are done (return False) or a process died (True)."""
        pending: dict[Future[PairReport], PairTask] = {}
        with self._pool(self._workers) as pool:
            try:
                for task in source:
                    pending[_submit(pool, task, suspects)] = task
                    if len(pending) >= AHEAD * self._workers:
                        yield from _finished(pending)
                while pending:
                    yield from _finished(pending)
            except BrokenProcessPool:
                suspects.extend(pending.values())
                return True
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
        return False

    def _alone(self, task: PairTask) -> PairReport:
        with self._pool(1) as pool:
            try:
                return pool.submit(_do, task).result()
            except BrokenProcessPool:
                return lost(task, "worker process")

    def _pool(self, workers: int) -> ProcessPoolExecutor:
        threads = max(1, (os.cpu_count() or 1) // self._workers)
        return ProcessPoolExecutor(
            workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_begin,
            initargs=(self._settings.record(), threads),
        )


def _submit(pool: Executor, task: PairTask, suspects: list[PairTask]) -> Future[PairReport]:
    try:
        return pool.submit(_do, task)
    except BrokenProcessPool:
        suspects.append(task)
        raise


def _finished(pending: dict[Future[PairReport], PairTask]) -> Iterator[PairReport]:
    """Wait for at least one outcome; a future leaves `pending` only when its outcome is read."""
    done, _ = wait(pending, return_when=FIRST_COMPLETED)
    for future in done:
        outcome = future.result()
        del pending[future]
        yield outcome


_worker: LateWorker | None = None


def _begin(settings: dict[str, Any], threads: int) -> None:
    """Prepare a worker process."""
    global _worker
    _worker = LateWorker(settings)
    # Before torch is imported here.
    os.environ["OMP_NUM_THREADS"] = str(threads)
    import cv2

    cv2.setNumThreads(threads)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent tells us when to stop
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Exit when the parent is gone: a killed run must not leave workers behind."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _do(task: PairTask) -> PairReport:
    assert _worker is not None, "a worker process begins with _begin"
    return _worker.do(task)
