"""Pairs that are skipped as badly aligned: a state of the pair, for everybody.

A skipped pair counts in no score and no audit: the views of scores leave it out, and whoever reads
anything else that counts says `NOT_SKIPPED` in the query.
Exports leave it out unless they are told otherwise.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.store.database import Store, utc_now

BADLY_ALIGNED = "badly aligned"

NOT_SKIPPED = "pair_id NOT IN (SELECT pair_id FROM skips)"


@dataclass(frozen=True, slots=True)
class Skip:
    """Who skipped a pair and why; `audits` are the rejections that came with it."""

    pair_id: int
    title: str
    annotator: str
    reason: str
    audits: tuple[int, ...]


SKIPS = """
SELECT k.pair_id, s.name || '/' || p.name AS title, n.name AS annotator, k.reason, k.audits
FROM skips k JOIN pairs p ON p.id = k.pair_id JOIN splits s ON s.id = p.split_id
JOIN annotators n ON n.id = k.annotator_id"""


def skip_of_pair(store: Store, pair_id: int) -> Skip | None:
    """Return the skip of a pair, None where it is not skipped."""
    row = store.read().execute(f"{SKIPS} WHERE k.pair_id = ?", [pair_id]).fetchone()
    return _skip(row) if row else None


def list_skips(store: Store, splits: Sequence[str] = ()) -> list[Skip]:
    """Return the skips of some splits, or of all, by split and pair."""
    marks = ", ".join("?" * len(splits))
    only = f" WHERE s.name IN ({marks})" if splits else ""
    rows = store.read().execute(f"{SKIPS}{only} ORDER BY s.name, p.name", list(splits))
    return [_skip(row) for row in rows]


def count_skips(store: Store) -> int:
    """Return how many pairs are skipped."""
    return int(store.read().execute("SELECT count(*) FROM skips").fetchone()[0])


def skipped_line(count: int) -> str:
    """Return the sentence that says how many pairs are left out, "" for none."""
    return f"{count} pair{'s' * (count != 1)} skipped as {BADLY_ALIGNED}" if count else ""


def insert_skip(
    db: sqlite3.Connection, pair_id: int, annotator: int, reason: str, audits: Sequence[int]
) -> None:
    """Write a skip inside a transaction of the writer."""
    db.execute(
        "INSERT INTO skips VALUES (?, ?, ?, ?, ?)",
        [pair_id, annotator, reason, json.dumps(list(audits)), utc_now()],
    )


def delete_skip(db: sqlite3.Connection, pair_id: int) -> None:
    """Take a skip away inside a transaction of the writer."""
    db.execute("DELETE FROM skips WHERE pair_id = ?", [pair_id])


def _skip(row: sqlite3.Row) -> Skip:
    return Skip(
        row["pair_id"],
        row["title"],
        row["annotator"],
        row["reason"],
        tuple(json.loads(row["audits"])),
    )
