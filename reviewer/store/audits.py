"""Verdicts on regions: given, taken back, given again; append-only.

Each change is written together with the final mask that follows from it (`pipeline.stored` composes
it), so that the two never disagree.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from reviewer.masks import Rle
from reviewer.records import Verdict
from reviewer.store.database import Store, require, utc_now
from reviewer.store.regions import put_prediction


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
    row = require(
        store.read()
        .execute(
            "SELECT a.id, a.region_id, g.run_id, g.pair_id, a.annotator_id,"
            " EXISTS (SELECT 1 FROM standing_audits s WHERE s.id = a.id) AS stands"
            " FROM audits a JOIN regions g ON g.id = a.region_id WHERE a.id = ?",
            [audit_id],
        )
        .fetchone(),
        f"verdict {audit_id}: does not exist",
    )
    return Audit(
        row["id"],
        row["region_id"],
        row["run_id"],
        row["pair_id"],
        row["annotator_id"],
        bool(row["stands"]),
    )


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


def verdicts_if(
    store: Store, audits: Iterable[int], *, stands: bool
) -> Mapping[int, Verdict | None]:
    """Return the verdict that each region of these would have if they stood, or did not."""
    found: dict[int, Verdict | None] = {}
    ids = list(audits)
    marks = ", ".join("?" * len(ids))
    standing = (
        f"(b.id IN ({marks}) OR b.id IN (SELECT id FROM standing_audits))"
        if stands
        else f"b.id IN (SELECT id FROM standing_audits) AND b.id NOT IN ({marks})"
    )
    rows = store.read().execute(
        f"SELECT DISTINCT a.region_id, (SELECT b.verdict FROM audits b"
        f" WHERE b.region_id = a.region_id AND {standing} ORDER BY b.id DESC LIMIT 1) AS verdict"
        f" FROM audits a WHERE a.id IN ({marks})",
        [*ids, *ids],
    )
    for row in rows:
        found[row["region_id"]] = row["verdict"]
    return found


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
    db: sqlite3.Connection, audits: Iterable[int], annotator: int, *, withdrawn: bool
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
