"""One thread that calls the models of one device, so that two clicks never compete for it.

Clicks come before previews, previews before work done ahead; within a kind, first come, first
served. A client's new request takes the place of its own one that still waits: that one is stale,
and its future is cancelled.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import dataclass
from enum import IntEnum
from threading import Condition, Thread
from typing import Any, TypeVar

Result = TypeVar("Result")
LOG = logging.getLogger(__name__)


class Urgency(IntEnum):
    """Who waits for it: a person, a hovering pointer, nobody yet."""

    CLICK = 0
    PREVIEW = 1
    AHEAD = 2


@dataclass(frozen=True, slots=True)
class _Job:
    urgency: Urgency
    client: Hashable
    work: Callable[[], Any]
    future: Future[Any]


class Worker:
    """The queue and its thread; `stop` it when done."""

    def __init__(self, name: str) -> None:
        self._waiting: list[_Job] = []
        self._ready = Condition()
        self._stopped = False
        self._thread = Thread(target=self._loop, name=name, daemon=True)
        self._thread.start()

    @property
    def stopped(self) -> bool:
        """Whether it takes no more work."""
        return self._stopped

    def submit(
        self, client: Hashable, urgency: Urgency, work: Callable[[], Result]
    ) -> Future[Result]:
        """Hand in work; what the client handed in before and still waits is dropped.

        Work done ahead is dropped only by the client's next work ahead.
        """
        future: Future[Result] = Future()
        ahead = urgency is Urgency.AHEAD
        with self._ready:
            if self._stopped:
                raise RuntimeError("the worker is stopped")
            stale = [
                job
                for job in self._waiting
                if job.client == client and (job.urgency is Urgency.AHEAD) == ahead
            ]
            for job in stale:
                self._waiting.remove(job)
                job.future.cancel()
            self._waiting.append(_Job(urgency, client, work, future))
            self._ready.notify()
        return future

    def stop(self) -> None:
        """Drop what waits, and wait for the work that is running."""
        with self._ready:
            self._stopped = True
            for job in self._waiting:
                job.future.cancel()
            self._waiting.clear()
            self._ready.notify()
        self._thread.join()

    def _loop(self) -> None:
        while (job := self._next()) is not None:
            if not job.future.set_running_or_notify_cancel():
                continue
            try:
                result = job.work()
            except BaseException as error:
                if job.urgency is Urgency.AHEAD:
                    LOG.warning("work ahead: %s", error)
                job.future.set_exception(error)
            else:
                job.future.set_result(result)

    def _next(self) -> _Job | None:
        with self._ready:
            self._ready.wait_for(lambda: self._waiting or self._stopped)
            if self._stopped:
                return None
            job = min(self._waiting, key=lambda waiting: waiting.urgency)
            self._waiting.remove(job)
            return job
