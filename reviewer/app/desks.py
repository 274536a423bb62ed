"""Desks: what one person looks at in one browser window.

A desk joins a Viser client (queue and map) with its workbench frame. It holds the state that both
are drawn from: filters, run, open pair. It is locked until the frame has checked in through the
gateway with a signed-in session; a frame without a Viser client around it gets a desk of its own.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import RLock
from typing import Any

from reviewer.app.details import choose_run
from reviewer.records import ReviewState
from reviewer.store.database import Store
from reviewer.store.queue import Order, QueueEntry, list_queue
from reviewer.store.reviews import annotator_id

Send = Callable[[dict[str, Any]], None]
EVERYTHING = 100_000


@dataclass(slots=True)
class Desk:
    """State of a desk, and the two sides that are told of changes.

    Attributes:
        annotator: None while locked.
        redraw: redraws the Viser side, given what changed ("unlock", "queue", "pair", "theme").
        send: sends a message to the workbench frame.
    """

    store: Store
    annotator: str | None = None
    run: str | None = None
    split: str | None = None
    state: ReviewState | None = None
    order: Order = "name"
    pair_id: int | None = None
    dark: bool = True
    window_width: int = 0
    redraw: Callable[[str], None] = lambda what: None
    send: Send = lambda message: None
    lock: RLock = field(default_factory=RLock)

    @property
    def annotator_id(self) -> int:
        """The annotator's key; only a desk that is unlocked has one."""
        assert self.annotator is not None, "a locked desk has no annotator"
        return annotator_id(self.store, self.annotator)

    def check_in(self, annotator: str, send: Send) -> None:
        """Take a signed-in frame: unlock, and tell the frame what to show."""
        with self.lock:
            first = self.annotator is None
            self.annotator, self.send = annotator, send
            if self.run is None:
                run = choose_run(self.store, None)
                self.run = run.name if run else None
            if self.pair_id is None:
                entries = self.entries()
                self.pair_id = entries[0].id if entries else None
        send({"type": "ready", "annotator": annotator, "run": self.run, "pair": self.pair_id})
        self.redraw("unlock" if first else "pair")

    def entries(self) -> list[QueueEntry]:
        """Return the whole queue under the desk's filters."""
        run = choose_run(self.store, self.run)
        entries, _ = list_queue(
            self.store,
            self.annotator_id,
            run_id=run.id if run else None,
            split=self.split,
            state=self.state,
            order=self.order,
            limit=EVERYTHING,
        )
        return entries

    def open_pair(self, pair_id: int) -> None:
        """Show a pair in the frame, the queue and the map."""
        with self.lock:
            self.pair_id = pair_id
        self.send({"type": "open", "pair": pair_id, "run": self.run})
        self.redraw("pair")

    def showing(self, pair_id: int) -> None:
        """Note that the frame opened a pair by itself."""
        with self.lock:
            self.pair_id = pair_id
        self.redraw("pair")

    def step(self, by: int) -> None:
        """Open the next (by = 1) or the previous pair (-1) of the queue; stop at its ends."""
        ids = [entry.id for entry in self.entries()]
        if not ids:
            return
        here = ids.index(self.pair_id) if self.pair_id in ids else (-1 if by > 0 else len(ids))
        there = here + by
        if 0 <= there < len(ids):
            self.open_pair(ids[there])
        else:
            self.send({"type": "end", "by": by})

    def neighbours(self, count: int) -> list[int]:
        """Return the ids of the next pairs, which the frame loads ahead."""
        ids = [entry.id for entry in self.entries()]
        here = ids.index(self.pair_id) if self.pair_id in ids else -1
        return ids[here + 1 : here + 1 + count]

    def filter(self, **changes: Any) -> None:
        """Change split, state, order or run, and redraw."""
        with self.lock:
            for name, value in changes.items():
                setattr(self, name, value)
        if "run" in changes:
            self.send({"type": "open", "pair": self.pair_id, "run": self.run})
        self.redraw("queue")


class Desks:
    """All desks by their nonce; thread-safe."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._desks: dict[str, Desk] = {}
        self._lock = RLock()

    def create(self) -> tuple[str, Desk]:
        """Make a locked desk; its nonce cannot be guessed."""
        nonce, desk = secrets.token_urlsafe(24), Desk(self._store)
        with self._lock:
            self._desks[nonce] = desk
        return nonce, desk

    def find(self, nonce: str) -> Desk | None:
        """Return the desk of a nonce."""
        with self._lock:
            return self._desks.get(nonce)

    def remove(self, nonce: str) -> None:
        """Forget a desk whose Viser client left."""
        with self._lock:
            self._desks.pop(nonce, None)
