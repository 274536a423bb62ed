"""Verdicts on regions: given, taken back, given again; append-only.

Each change is written together with the final mask that follows from it (`pipeline.stored` composes
it), so that the two never disagree.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.errors import NotFound
from reviewer.masks import Rle
from reviewer.store.database import Store, require, utc_now
from reviewer.store.regions import put_prediction
from reviewer.words import Verdict


@dataclass(frozen=True, slots=True)
class Audit:
    """A verdict as it is kept; `stands` until its person takes it back."""

    id: int
    region_id: int
    run_id: int
    pair_id: int
    annotator_id: int
    stands: bool


def audit_of_id(store: Store, audit_id: int) -> Audit:
    """Return a verdict.

    Raises:
        NotFound: when it does not exist.
    """
    found = audits_of_ids(store, [audit_id])
    if not found:
        raise NotFound(f"verdict {audit_id}: does not exist")
    return found[0]


def audits_of_ids(store: Store, audits: Sequence[int]) -> list[Audit]:
    """Return those of the verdicts that exist, by key."""
    rows = store.read().execute(
        "SELECT a.id, a.region_id, g.run_id, g.pair_id, a.annotator_id,"
        " EXISTS (SELECT 1 FROM standing_audits s WHERE s.id = a.id) AS stands"
        " FROM audits a JOIN regions g ON g.id = a.region_id"
        " WHERE a.id IN (SELECT value FROM json_each(?)) ORDER BY a.id",
        [json.dumps(list(audits))],
    )
    return [
        Audit(
            row["id"],
            row["region_id"],
            row["run_id"],
            row["pair_id"],
            row["annotator_id"],
            bool(row["stands"]),
        )
        for row in rows
    ]


def add_audit(
    store: Store,
    region_id: int,
    annotator: int,
    verdict: Verdict,
    audited: Rle,
    *,
    reason: str = "",
    comment: str = "",
) -> int:
    """Append a verdict on a region's decision, with the final mask that follows from it.

    Raises:
        NotFound: when the region does not exist.
    """

    def work(db: sqlite3.Connection) -> int:
        row = require(
            db.execute("SELECT run_id, pair_id FROM regions WHERE id = ?", [region_id]).fetchone(),
            f"region {region_id}: does not exist",
        )
        audit_id = insert_audit(db, region_id, annotator, verdict, reason, comment)
        put_audited(db, row["run_id"], row["pair_id"], audited)
        return audit_id

    return store.write(work)


def verdicts_if(store: Store, audits: Sequence[int], *, stands: bool) -> dict[int, Verdict | None]:
    """Return the verdict that each region of these would have if they stood, or did not."""
    rows = store.read().execute(
        "WITH these AS (SELECT value AS id FROM json_each(:ids))"
        " SELECT DISTINCT a.region_id, (SELECT b.verdict FROM audits b"
        " WHERE b.region_id = a.region_id AND CASE WHEN b.id IN these THEN :stands"
        " ELSE EXISTS (SELECT 1 FROM standing_audits s WHERE s.id = b.id) END"
        " ORDER BY b.id DESC LIMIT 1) AS verdict"
        " FROM audits a WHERE a.id IN these",
        {"ids": json.dumps(list(audits)), "stands": int(stands)},
    )
    return {row["region_id"]: row["verdict"] for row in rows}


def insert_audit(
    db: sqlite3.Connection,
    region_id: int,
    annotator: int,
    verdict: Verdict,
    reason: str,
    comment: str,
) -> int:
    """Append a verdict inside a transaction of the writer; return its key."""
    cursor = db.execute(
        "INSERT INTO audits (region_id, annotator_id, verdict, reason, comment, created_at)"
        " VALUES (?, ?, ?, ?, ?, ?)",
        [region_id, annotator, verdict, reason, comment, utc_now()],
    )
    assert cursor.lastrowid is not None, "SQLite numbers every inserted row"
    return cursor.lastrowid


def insert_withdrawals(
    db: sqlite3.Connection, audits: Sequence[int], annotator: int, *, withdrawn: bool
) -> None:
    """Note inside a transaction of the writer that verdicts are taken back, or given again."""
    db.executemany(
        "INSERT INTO withdrawals (audit_id, withdrawn, annotator_id, created_at)"
        " VALUES (?, ?, ?, ?)",
        [[audit, int(withdrawn), annotator, utc_now()] for audit in audits],
    )


def put_audited(db: sqlite3.Connection, run_id: int, pair_id: int, audited: Rle | None) -> None:
    """Write the final mask after verdicts; None where no verdict stands any more."""
    if audited is not None:
        put_prediction(db, run_id, pair_id, "audited", audited)
        return
    db.execute(
        "DELETE FROM predictions WHERE run_id = ? AND pair_id = ? AND method = 'audited'",
        [run_id, pair_id],
    )
