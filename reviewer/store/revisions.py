"""Mask revisions: append-only ground truth with an optimistic revision check."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from reviewer.errors import Conflict, InvalidInput, Locked
from reviewer.masks import Rle
from reviewer.records import MaskRevision
from reviewer.store.database import Store, mask_columns, require, utc_now
from reviewer.words import FINISHED, RevisionSource

SELECT = """
SELECT m.*, a.name AS annotator FROM {table} m
LEFT JOIN annotators a ON a.id = m.annotator_id
"""


def newest_revision(store: Store, pair_id: int) -> MaskRevision | None:
    """Return the newest revision of a pair, finished or not; None when it has none yet.

    The one that counts is `store.truth.truth_of_pair`.
    """
    query = SELECT.format(table="mask_revisions")
    row = (
        store.read()
        .execute(f"{query} WHERE m.pair_id = ? ORDER BY m.number DESC LIMIT 1", [pair_id])
        .fetchone()
    )
    return revision_of_row(row) if row else None


def newest_revisions(store: Store) -> dict[int, MaskRevision]:
    """Return the newest revision of every pair that has one, by pair id."""
    rows = store.read().execute(SELECT.format(table="newest_revisions"))
    return {row["pair_id"]: revision_of_row(row) for row in rows}


def list_revisions(store: Store, pair_id: int) -> list[MaskRevision]:
    """Return the history of a pair, oldest first."""
    query = SELECT.format(table="mask_revisions")
    rows = store.read().execute(f"{query} WHERE m.pair_id = ? ORDER BY m.number", [pair_id])
    return [revision_of_row(row) for row in rows]


def list_actions(store: Store, pair_id: int) -> list[dict[str, Any]]:
    """Return what people did to a pair, oldest first: its tool logs without the masks."""
    rows = store.read().execute(
        "SELECT tool_log FROM mask_revisions WHERE pair_id = ? ORDER BY number", [pair_id]
    )
    return [action for row in rows for action in json.loads(row["tool_log"])]


def revision_of_number(store: Store, pair_id: int, number: int) -> MaskRevision:
    """Return one revision of a pair.

    Raises:
        NotFound: when there is none of that number.
    """
    query = SELECT.format(table="mask_revisions")
    row = (
        store.read()
        .execute(f"{query} WHERE m.pair_id = ? AND m.number = ?", [pair_id, number])
        .fetchone()
    )
    return revision_of_row(require(row, f"pair {pair_id}: has no revision {number}"))


def add_revision(
    store: Store,
    pair_id: int,
    mask: Rle,
    *,
    parent: int,
    annotator_id: int | None,
    source: RevisionSource,
    ignore: Rle | None = None,
    active_seconds: float = 0.0,
    tool_log: Sequence[Mapping[str, Any]] = (),
) -> int:
    """Append ground truth made from revision `parent` (0 = none yet); return its number.

    Saying the same thing twice is one revision, so an answer that got lost can be asked for again.
    The pair becomes "in progress" for an annotator who had not begun it.

    Args:
        ignore: pixels not to score; None keeps the parent's, an empty mask clears them.

    Raises:
        NotFound: when the pair does not exist.
        InvalidInput: when the mask has another size than the live image.
        Conflict: when `parent` is not the newest revision.
        Locked: when the annotator has finished the pair.
    """

    def work(db: sqlite3.Connection) -> int:
        return _append(
            db, pair_id, mask, parent, annotator_id, source, ignore, active_seconds, tool_log
        )

    return store.write(work)


@dataclass(frozen=True, slots=True)
class NewRevision:
    """Ground truth to append to a pair, made from revision `parent`."""

    pair_id: int
    mask: Rle
    parent: int
    ignore: Rle


def add_revisions(store: Store, revisions: Sequence[NewRevision]) -> None:
    """Append imported ground truth to many pairs: to all of them, or to none.

    Raises:
        InvalidInput, Conflict: as `add_revision`.
    """

    def work(db: sqlite3.Connection) -> None:
        for new in revisions:
            _append(db, new.pair_id, new.mask, new.parent, None, "import", new.ignore, 0.0, ())

    store.write(work)


def _append(
    db: sqlite3.Connection,
    pair_id: int,
    mask: Rle,
    parent: int,
    annotator_id: int | None,
    source: RevisionSource,
    ignore: Rle | None,
    active_seconds: float,
    tool_log: Sequence[Mapping[str, Any]],
) -> int:
    pair = pair_row(db, pair_id)
    size = (pair["height"], pair["width"])
    for name, rle in (("mask", mask), ("ignore mask", ignore)):
        if rle is not None and (rle.height, rle.width) != size:
            raise InvalidInput(
                f"pair {pair['title']}: the {name} is {rle.width}x{rle.height},"
                f" but the live image is {size[1]}x{size[0]}"
            )
    _refuse_when_finished(db, pair_id, annotator_id, pair["title"])
    newest = newest_row(db, pair_id)
    number, kept = (newest["number"], newest["ignore_rle"]) if newest else (0, None)
    ignore_rle = kept if ignore is None else (ignore.counts if ignore.area else None)
    if newest and number == parent + 1:
        stored = (newest["annotator_id"], newest["rle"], newest["ignore_rle"])
        if stored == (annotator_id, mask.counts, ignore_rle):
            return int(number)
    if parent != number:
        raise Conflict(
            f"pair {pair['title']}: made from revision {parent}, but the newest is {number}"
        )
    insert_revision(
        db,
        pair_id,
        parent + 1,
        mask,
        source,
        annotator_id=annotator_id,
        ignore_rle=ignore_rle,
        active_seconds=active_seconds,
        tool_log=tool_log,
    )
    if annotator_id is not None:
        db.execute(
            "INSERT OR IGNORE INTO reviews (pair_id, annotator_id, state, updated_at)"
            " VALUES (?, ?, 'in_progress', ?)",
            [pair_id, annotator_id, utc_now()],
        )
    return parent + 1


def insert_revision(
    db: sqlite3.Connection,
    pair_id: int,
    number: int,
    mask: Rle,
    source: RevisionSource,
    *,
    annotator_id: int | None = None,
    ignore_rle: str | None = None,
    active_seconds: float = 0.0,
    tool_log: Sequence[Mapping[str, Any]] = (),
) -> None:
    """Write revision `number` inside a transaction of the writer; its parent is the one before."""
    db.execute(
        "INSERT INTO mask_revisions (pair_id, number, parent, annotator_id, source,"
        " height, width, rle, area, box_x, box_y, box_width, box_height,"
        " ignore_rle, active_seconds, tool_log, created_at)"
        " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
        [
            pair_id,
            number,
            number - 1,
            annotator_id,
            source,
            *mask_columns(mask),
            ignore_rle,
            active_seconds,
            json.dumps(list(tool_log), separators=(",", ":")),
            utc_now(),
        ],
    )


def newest_row(db: sqlite3.Connection, pair_id: int) -> sqlite3.Row | None:
    """Return the row of a pair's newest revision inside a transaction, None when it has none."""
    row: sqlite3.Row | None = db.execute(
        "SELECT * FROM mask_revisions WHERE pair_id = ? ORDER BY number DESC LIMIT 1", [pair_id]
    ).fetchone()
    return row


def pair_row(db: sqlite3.Connection, pair_id: int) -> sqlite3.Row:
    """Return title, height and width of a pair inside a transaction.

    Raises:
        NotFound: when there is none of that id.
    """
    return require(
        db.execute(
            "SELECT s.name || '/' || p.name AS title, i.height, i.width FROM pairs p"
            " JOIN splits s ON s.id = p.split_id JOIN images i ON i.id = p.live_id WHERE p.id = ?",
            [pair_id],
        ).fetchone(),
        f"pair {pair_id}: does not exist",
    )


def _refuse_when_finished(
    db: sqlite3.Connection, pair_id: int, annotator_id: int | None, title: str
) -> None:
    row = db.execute(
        "SELECT state FROM reviews WHERE pair_id = ? AND annotator_id IS ?",
        [pair_id, annotator_id],
    ).fetchone()
    if row and row["state"] in FINISHED:
        raise Locked(f"pair {title}: is {row['state']} and locked; reopen it to change the mask")


def revision_of_row(row: sqlite3.Row) -> MaskRevision:
    """Return the revision of a row of `SELECT`."""
    return MaskRevision(
        row["pair_id"],
        row["number"],
        rle_of_row(row),
        row["ignore_rle"],
        row["source"],
        row["annotator"],
        row["active_seconds"],
        row["created_at"],
        tuple(json.loads(row["tool_log"])),
    )


def rle_of_row(row: sqlite3.Row) -> Rle:
    """Return the mask of a row that has the mask columns."""
    box = (row["box_x"], row["box_y"], row["box_width"], row["box_height"])
    return Rle(row["height"], row["width"], row["rle"], row["area"], box)
