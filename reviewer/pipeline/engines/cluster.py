"""Engine `ray`: the pairs of a run on the machines of a Ray cluster (`pip install reviewer[ray]`).

Every worker is an actor with models of its own and one pair in hand, so it is known which pair a
lost worker was at: it is tried once more, then recorded. Images and checkpoints are read where the
work is done: they must lie under the same paths there (a shared file system).
"""

from __future__ import annotations

import logging
import os
import secrets
import socket
import sys
from collections.abc import Iterable, Iterator
from typing import Any

from reviewer.errors import InvalidInput, ReviewerError
from reviewer.pipeline.engines import LateWorker, lost
from reviewer.pipeline.settings import PipelineSettings
from reviewer.pipeline.work import PairReport, PairTask

TRIES = 2


class RayEngine:
    """A number of actors on a cluster."""

    def __init__(self, settings: PipelineSettings, workers: int, address: str | None) -> None:
        """Connect to a cluster, or start one on this machine when `address` is None.

        Raises:
            InvalidInput: when Ray is not installed, or no cluster answers at the address.
        """
        # Ray reports its use to its makers otherwise; a lab's data set is nobody's business.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        if address is None and "ray" not in sys.modules and "RAY_AUTH_MODE" not in os.environ:
            # Even a cluster of one machine listens on the network: only we get in. Ray reads this
            # when it is imported, so a program that has done so decides for itself.
            os.environ["RAY_AUTH_MODE"] = "token"
            os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))
        try:
            import ray
        except ImportError as error:
            raise InvalidInput(
                "--engine ray: Ray is not installed; pip install 'reviewer[ray]', or use"
                " --engine local"
            ) from error
        self._ray = ray
        self._settings = settings
        self._workers = workers
        if ray.is_initialized():
            return
        try:
            _knock(address)
            ray.init(
                address=address,
                num_cpus=workers if address is None else None,
                include_dashboard=False if address is None else None,
                log_to_driver=False,
                logging_level=logging.ERROR,
            )
        except (OSError, ValueError, RuntimeError) as error:
            raise InvalidInput(f"--address {address}: no Ray cluster answers, {error}") from error

    def outcomes(self, tasks: Iterable[PairTask]) -> Iterator[PairReport]:
        """Yield one outcome per task."""
        source = iter(tasks)
        idle = [self._start() for _ in range(self._workers)]
        busy: dict[Any, tuple[Any, PairTask, int]] = {}
        again: list[tuple[PairTask, int]] = []
        try:
            while True:
                while idle:
                    task, tries = again.pop() if again else (next(source, None), 0)
                    if task is None:
                        break
                    actor = idle.pop()
                    busy[actor.do.remote(task)] = actor, task, tries + 1
                if not busy:
                    return
                (done, *_), _ = self._ray.wait(list(busy), num_returns=1)
                actor, task, tries = busy.pop(done)
                outcome = self._read(done)
                if outcome is not None:
                    idle.append(actor)
                    yield outcome
                    continue
                idle.append(self._start())
                if tries < TRIES:
                    again.append((task, tries))
                else:
                    yield lost(task, "Ray worker")
        finally:
            for actor in [*idle, *(entry[0] for entry in busy.values())]:
                self._ray.kill(actor)

    def _read(self, reference: Any) -> PairReport | None:
        """Return an outcome; None when its worker was lost."""
        errors = self._ray.exceptions
        try:
            outcome: PairReport = self._ray.get(reference)
        except errors.RayTaskError as error:
            cause = error.cause
            if isinstance(cause, ReviewerError):
                raise cause from error
            raise
        except (errors.RayActorError, errors.ObjectLostError, errors.OutOfMemoryError):
            return None
        return outcome

    def _start(self) -> Any:
        gpus = 1 if self._ray.cluster_resources().get("GPU", 0) else 0
        actor = self._ray.remote(num_cpus=1, num_gpus=gpus, max_restarts=0)(LateWorker)
        return actor.remote(self._settings.record())


def _knock(address: str | None) -> None:
    """Raise OSError when nothing listens at host:port: Ray itself would try for many minutes."""
    host, colon, port = (address or "").removeprefix("ray://").rpartition(":")
    if colon and port.isdigit():
        socket.create_connection((host, int(port)), timeout=5).close()
