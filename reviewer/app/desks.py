"""Desks: what one person sees in one browser window.

A desk joins a Viser client (queue and map) with its workbench frame. It holds the state that both
are drawn from: filters, run, open pair. It is locked until the frame has checked in through the
gateway with a signed-in session; a frame without a Viser client around it gets a desk of its own.

The queue of a desk is a snapshot, renewed when a filter changes: a pair that leaves the filter by
being worked on stays where it is, so "next" is always the one after it.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import RLock
from typing import Any

from reviewer.app.endpoints.details import choose_run
from reviewer.app.endpoints.frame_messages import Filtered, Joining, Ready, ToFrame
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.pairs import list_splits, pair_ids, pair_of_id
from reviewer.store.queue import QueueEntry, list_queue
from reviewer.store.reviews import annotator_id, known_annotator
from reviewer.store.runs import list_runs
from reviewer.version import VERSION
from reviewer.words import PairState, QueueOrder, TeamState

Send = Callable[[ToFrame], None]
EVERYTHING = 100_000
LOADED_AHEAD = 2


@dataclass(slots=True)
class Desk:
    """State of a desk, and the two sides that are notified of changes.

    Attributes:
        annotator: None while locked.
        pair_id: the pair that was asked for last; shown_id: the one that the frame shows.
        only: pairs that the queue is narrowed to, by something else than a filter; None = all.
        ids: the queue: pair ids in order, under the filters.
        queue_width: of the docked queue, CSS pixels; 0 = not known.
        redraw: redraws the Viser side, given what changed: "unlock", "queue", "pair", "change" or
            "theme".
        send: sends a message to the workbench frame.
    """

    store: Store
    annotator: str | None = None
    run: str | None = None
    split: str | None = None
    state: PairState | None = None
    team: TeamState | None = None
    order: QueueOrder = "name"
    only: frozenset[int] | None = None
    pair_id: int | None = None
    shown_id: int | None = None
    ids: list[int] = field(default_factory=list)
    dark: bool = True
    queue_width: int = 0
    redraw: Callable[[str], None] = lambda what: None
    send: Send = lambda message: None
    lock: RLock = field(default_factory=RLock)

    @property
    def annotator_id(self) -> int:
        """The annotator's key to look things up by; only a desk that is unlocked has one."""
        assert self.annotator is not None, "a locked desk has no annotator"
        return known_annotator(self.store, self.annotator)

    @property
    def author_id(self) -> int:
        """The key under which the annotator writes; made when it is asked for first."""
        assert self.annotator is not None, "a locked desk has no annotator"
        return annotator_id(self.store, self.annotator)

    @property
    def chosen_run(self) -> Run | None:
        """The run to look at: the chosen one, else the newest."""
        return choose_run(self.store, self.run)

    def check_in(self, annotator: str, send: Send, left: Joining | None = None) -> None:
        """Take a signed-in frame: unlock, and tell the frame what to show.

        A desk that knows no pair yet (after a restart of the server, or of Viser) is `fresh`, and
        goes on where the frame was. The pair that the frame has open is always its own to say.
        """
        with self.lock:
            first, fresh = self.annotator is None, self.pair_id is None
            self.annotator, self.send = annotator, send
            if left is not None:
                self._take_up(left, fresh)
            run = self.chosen_run
            self.run = run.name if run else None
            self.renew()
            if self.pair_id is None and self.ids:
                self.pair_id = self.ids[0]
            ready = Ready(
                type="ready",
                version=VERSION,
                store=self.store.identity,
                annotator=annotator,
                run=self.run,
                pair=self.pair_id,
                fresh=fresh,
            )
        send(ready)
        self.redraw("unlock" if first else "queue")

    def _take_up(self, left: Joining, fresh: bool) -> None:
        """Continue where a frame is; what this database does not know is ignored."""
        known = left.store == self.store.identity
        if known and left.pair in pair_ids(self.store):
            self.pair_id = left.pair
        if not fresh:
            return
        self.dark, self.queue_width = left.dark, left.queue
        if not known:
            return
        self.state, self.team, self.order = left.state, left.team, left.order
        if left.split in {split.name for split in list_splits(self.store)}:
            self.split = left.split
        if left.run in {run.name for run in list_runs(self.store)}:
            self.run = left.run

    def renew(self) -> None:
        """Take a new snapshot of the queue under the filters."""
        found = [entry.id for entry in self.entries(limit=EVERYTHING)]
        self.ids = [key for key in found if self.only is None or key in self.only]

    def entries(self, pair_ids: list[int] | None = None, limit: int = 1000) -> list[QueueEntry]:
        """Return entries as they are now: of the named pairs in that order, or by the filters."""
        run = self.chosen_run
        named = pair_ids is not None
        found, _ = list_queue(
            self.store,
            self.annotator_id,
            run_id=run.id if run else None,
            split=None if named else self.split,
            state=None if named else self.state,
            team=None if named else self.team,
            order=self.order,
            pair_ids=pair_ids,
            limit=limit,
        )
        if pair_ids is not None:
            place = {pair_id: k for k, pair_id in enumerate(pair_ids)}
            found.sort(key=lambda entry: place[entry.id])
        return found

    def open_pair(self, pair_id: int) -> None:
        """Show a pair in the frame, the queue and the map."""
        pair_of_id(self.store, pair_id)
        with self.lock:
            self.pair_id = pair_id
        # Queue and map follow when the frame shows the pair: it has the thread to itself till then.
        self.send({"type": "open", "pair": pair_id, "run": self.run})

    def showing(self, pair_id: int) -> list[int]:
        """Record what the frame shows, and tell it what to preload; return that, too."""
        with self.lock:
            moved, self.shown_id = self.shown_id != pair_id, pair_id
            self.pair_id = pair_id
            here = self.ids.index(pair_id) if pair_id in self.ids else -1
            ahead = self.ids[here + 1 : here + 1 + LOADED_AHEAD]
        self.send({"type": "ahead", "pairs": ahead})
        if moved:
            self.redraw("pair")
        return ahead

    def step(self, by: int) -> None:
        """Open the next (by = 1) or the previous pair (-1) of the queue; stop at its ends."""
        with self.lock:
            ids = self.ids
            outside = -1 if by > 0 else len(ids)
            there = by + (ids.index(self.pair_id) if self.pair_id in ids else outside)
        if 0 <= there < len(ids):
            self.open_pair(ids[there])
        else:
            self.send({"type": "end", "by": by})

    def filter(self, **changes: Any) -> None:
        """Change split, state, order or run, take a new snapshot, and redraw.

        Raises:
            NotFound: when a run is named that does not exist; nothing changes then.
        """
        if changes.get("run"):
            choose_run(self.store, changes["run"])
        with self.lock:
            for name, value in changes.items():
                setattr(self, name, value)
            self.renew()
            filtered = Filtered(
                type="queue", split=self.split, state=self.state, team=self.team, order=self.order
            )
        self.send(filtered)
        if "run" in changes:
            self.send({"type": "open", "pair": self.pair_id, "run": self.run})
        self.redraw("queue")


class Desks:
    """All desks by their nonce; thread-safe."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._desks: dict[str, Desk] = {}
        self._taken: list[Desk] = []
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

    def enter(self, desk: Desk) -> None:
        """A person is at a desk now; all who are at theirs are told who is."""
        with self._lock:
            self._taken.append(desk)
            self._tell()

    def leave(self, desk: Desk) -> None:
        """A person has left a desk."""
        with self._lock:
            self._taken = [other for other in self._taken if other is not desk]
            self._tell()

    def _tell(self) -> None:
        names = sorted({desk.annotator for desk in self._taken if desk.annotator})
        for desk in self._taken:
            desk.send({"type": "here", "names": names})

    def remove(self, nonce: str) -> None:
        """Forget a desk whose Viser client left."""
        with self._lock:
            self._desks.pop(nonce, None)
