"""Where the pairs of a run are done: in this process, in several, or on a Ray cluster.

An engine takes tasks one by one as it has room for them, so a million pairs need no more memory
than a few, and yields each outcome as soon as it is there. Only the caller writes to the store.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Literal, Protocol

from reviewer.pipeline.work import PairOutcome, PairTask

EngineName = Literal["local", "ray"]


class Engine(Protocol):
    """Does tasks, in any order."""

    def outcomes(self, tasks: Iterable[PairTask]) -> Iterator[PairOutcome]:
        """Yield one outcome a task.

        Raises:
            InvalidInput: when the run's models cannot be built where the work is done.
        """
        ...


def lost(task: PairTask, what: str) -> PairOutcome:
    """Return the outcome of a task that takes its worker down with it."""
    stage = task.todo[0][0]
    reason = f"the {what} died over this pair, twice: out of memory, or a crash in a library"
    return PairOutcome(task.pair, failure=(stage, reason))
