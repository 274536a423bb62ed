"""Browsers that are signed in. A row that is gone is signed out.

The key of a row is made by `app.door.sessions` from what stands in the cookie and the server's
token; neither can be found from it.
"""

from __future__ import annotations

import sqlite3
from datetime import datetime

from reviewer.store.database import Store, stamp, utc_now


def add_session(store: Store, key: str, annotator_id: int, *, oldest: datetime) -> None:
    """Note that a browser signed in, and drop sessions that began before `oldest`."""

    def work(db: sqlite3.Connection) -> None:
        db.execute("DELETE FROM sessions WHERE created_at < ?", [stamp(oldest)])
        db.execute("INSERT INTO sessions VALUES (?, ?, ?)", [key, annotator_id, utc_now()])

    store.write(work)


def person_of_session(store: Store, key: str, *, oldest: datetime) -> str | None:
    """Return the name of who signed in; None when there is no such session since `oldest`."""
    row = (
        store.read()
        .execute(
            "SELECT a.name FROM sessions s JOIN annotators a ON a.id = s.annotator_id"
            " WHERE s.key = ? AND s.created_at >= ?",
            [key, stamp(oldest)],
        )
        .fetchone()
    )
    return None if row is None else str(row["name"])


def end_session(store: Store, key: str) -> None:
    """Sign a browser out; one that is signed out already stays so."""
    store.write(lambda db: db.execute("DELETE FROM sessions WHERE key = ?", [key]))
