"""Where the pairs of a run are done: in this process, in several, or on a Ray cluster.

An engine takes tasks one by one as it has room for them, so a million pairs need no more memory
than a few, and yields each outcome as soon as it is there. Only the caller writes to the store.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Protocol

from reviewer.pipeline.members import build_members
from reviewer.pipeline.settings import PipelineSettings
from reviewer.pipeline.work import PairReport, PairTask, PairWorker


class Engine(Protocol):
    """Does tasks, in any order."""

    def outcomes(self, tasks: Iterable[PairTask]) -> Iterator[PairReport]:
        """Yield one outcome per task.

        Raises:
            InvalidInput: when the run's models cannot be built where the work is done.
        """
        ...


class LateWorker:
    """Does tasks in its own process; the first one builds the models, so errors are told."""

    def __init__(self, settings: dict[str, Any]) -> None:
        """Take a run's settings as a record, which can be sent to any process."""
        self._settings = settings
        self._worker: PairWorker | None = None

    def do(self, task: PairTask) -> PairReport:
        """Do one task."""
        if self._worker is None:
            settings = PipelineSettings.of_record(self._settings)
            self._worker = PairWorker(settings, build_members(settings))
        return self._worker.do(task)


def lost(task: PairTask, what: str) -> PairReport:
    """Return the outcome of a task that killed its worker."""
    stage = task.todo[0][0]
    reason = f"the {what} died over this pair, twice: out of memory, or a crash in a library"
    return PairReport(task.pair, failure=(stage, reason))
