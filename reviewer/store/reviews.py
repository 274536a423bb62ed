"""People: annotators, and the state of a pair for each of them."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence

from reviewer.errors import Conflict, InvalidInput
from reviewer.masks import empty_rle
from reviewer.store.database import Store, utc_now
from reviewer.store.revisions import insert_revision, newest_row, pair_row
from reviewer.texts import clean_text
from reviewer.words import REVIEW_STATES, ReviewState


def known_annotator(store: Store, name: str) -> int:
    """Return the key of an annotator, 0 (nobody's) for one who has not written anything yet.

    Raises:
        InvalidInput: when the name is none (`clean_name`).
    """
    row = store.read().execute(_PERSON, [clean_name(name)]).fetchone()
    return int(row["id"]) if row else 0


def annotator_id(store: Store, name: str) -> int:
    """Return the key of an annotator who writes, adding a new name.

    Raises:
        InvalidInput: when the name is none (`clean_name`).
    """
    known = known_annotator(store, name)
    if known:
        return known

    def work(db: sqlite3.Connection) -> int:
        row = [clean_name(name), utc_now()]
        db.execute("INSERT OR IGNORE INTO annotators (name, created_at) VALUES (?, ?)", row)
        return int(db.execute(_PERSON, row[:1]).fetchone()["id"])

    return store.write(work)


_PERSON = "SELECT id FROM annotators WHERE name = ?"


def clean_name(name: str) -> str:
    """Return an annotator's name as it is kept.

    Raises:
        InvalidInput: when it is blank, longer than 80 characters, or cannot be read.
    """
    return clean_text(name, "annotator name", longest=80, least=1)


def review_state(store: Store, pair_id: int, annotator: int) -> ReviewState:
    """Return the state of a pair for an annotator; no row means "todo"."""
    row = (
        store.read()
        .execute(
            "SELECT state FROM reviews WHERE pair_id = ? AND annotator_id = ?",
            [pair_id, annotator],
        )
        .fetchone()
    )
    return row["state"] if row else "todo"


def set_review_state(
    store: Store,
    pair_id: int,
    annotator: int,
    state: ReviewState,
    *,
    seen: int | None = None,
    active_seconds: float = 0.0,
) -> None:
    """Set the state of a pair for an annotator, and add seconds of work that changed no mask.

    `seen` is the revision the person looked at: a newer one that they have not seen is a conflict.

    "submitted" and "approved" need ground truth to speak of; "confirmed_empty" writes an all-zero
    mask as a new revision in the same transaction.

    Raises:
        InvalidInput: when the state is unknown.
        NotFound: when the pair does not exist.
        Conflict: when a mask is submitted that does not exist, or `seen` is not the newest.
    """
    if state not in REVIEW_STATES:
        raise InvalidInput(f"review state: {state!r} is not one of {', '.join(REVIEW_STATES)}")

    def work(db: sqlite3.Connection) -> None:
        pair, newest = pair_row(db, pair_id), newest_row(db, pair_id)
        number = newest["number"] if newest else 0
        if seen is not None and seen != number:
            raise Conflict(
                f"pair {pair['title']}: you looked at revision {seen}, but the newest is {number}"
            )
        if state in ("submitted", "approved") and not newest:
            raise Conflict(
                f"pair {pair['title']}: has no mask to submit; draw one, or confirm it empty"
            )
        if state == "confirmed_empty" and (newest is None or newest["area"] > 0):
            number += 1
            insert_revision(
                db,
                pair_id,
                number,
                empty_rle(pair["height"], pair["width"]),
                "confirmed_empty",
                annotator_id=annotator,
                ignore_rle=newest["ignore_rle"] if newest else None,
            )
        if active_seconds:
            db.execute(
                "INSERT INTO looking_times VALUES (?, ?, ?) ON CONFLICT DO UPDATE SET"
                " seconds = seconds + excluded.seconds",
                [pair_id, annotator, active_seconds],
            )
        if state == "todo":
            db.execute(
                "DELETE FROM reviews WHERE pair_id = ? AND annotator_id = ?", [pair_id, annotator]
            )
            return
        db.execute(
            "INSERT INTO reviews (pair_id, annotator_id, state, revision, updated_at)"
            " VALUES (?, ?, ?, ?, ?) ON CONFLICT (pair_id, annotator_id) DO UPDATE SET"
            " state = excluded.state, revision = excluded.revision,"
            " updated_at = excluded.updated_at",
            [pair_id, annotator, state, number, utc_now()],
        )

    store.write(work)


def pairs_in_state(store: Store, states: Sequence[str]) -> set[int]:
    """Return the pairs that somebody has in one of these states."""
    marks = ", ".join("?" * len(states))
    rows = store.read().execute(
        f"SELECT DISTINCT pair_id FROM reviews WHERE state IN ({marks})", list(states)
    )
    return {row["pair_id"] for row in rows}
