"""Which stages are done for which pairs, and from which inputs: the cache of the pipeline.

A result's key is a hash of its inputs, settings and weights (`pipeline.plan`). A stage of a run has
done a pair when the key that is kept is the one it would have now; another run takes over a result
of the same key. What was imported or edited has a key that begins with "given:" and is believed.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.errors import NotFound
from reviewer.records import ObjectInstance
from reviewer.store.database import Store, utc_now
from reviewer.store.layers import (
    StoredAlignment,
    StoredDetection,
    StoredLabel,
    put_alignment,
    put_detection,
    put_labels,
    put_objects,
)
from reviewer.store.regions import StoredIntegration, put_integration
from reviewer.words import Stage

GIVEN = "given:"
# Regions have keys of their own and cost little: they are made again, not taken over.
LAYER_TABLES: dict[Stage, str] = {
    "align": "alignments",
    "detect": "detections",
    "label": "labels",
    "search": "objects",
}

Content = (
    StoredAlignment
    | StoredDetection
    | Sequence[StoredLabel]
    | Sequence[ObjectInstance]
    | StoredIntegration
)


@dataclass(frozen=True, slots=True)
class StageResult:
    """A stage's result for a pair; `key` names its inputs, `seconds` how long it took."""

    stage: Stage
    key: str
    seconds: float
    content: Content


def given_key(*parts: str | bytes) -> str:
    """Return the key of a result that no model made."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part if isinstance(part, bytes) else part.encode())
        digest.update(b"\0")
    return GIVEN + digest.hexdigest()[:32]


def stage_keys(store: Store, run_id: int, pair_ids: Sequence[int]) -> dict[int, dict[Stage, str]]:
    """Return the keys of what a run has, by pair and stage."""
    found: dict[int, dict[Stage, str]] = {pair_id: {} for pair_id in pair_ids}
    rows = store.read().execute(
        "SELECT pair_id, stage, key FROM results WHERE run_id = ?"
        " AND pair_id IN (SELECT value FROM json_each(?))",
        [run_id, json.dumps(list(pair_ids))],
    )
    for row in rows:
        found[row["pair_id"]][row["stage"]] = row["key"]
    return found


def finished_pairs(store: Store, run_id: int, stage: Stage) -> set[int]:
    """Return the ids of the pairs that a stage of a run has done."""
    query = "SELECT pair_id FROM results WHERE run_id = ? AND stage = ?"
    return {row["pair_id"] for row in store.read().execute(query, [run_id, stage])}


def save_results(
    store: Store,
    run_id: int,
    pair_id: int,
    results: Sequence[StageResult],
    failure: tuple[Stage, str] | None = None,
) -> None:
    """Write everything that was done for a pair, and its failure, in one transaction.

    Raises:
        Conflict: when people gave verdicts on regions that would be others now.
    """

    def work(db: sqlite3.Connection) -> None:
        for result in results:
            _put(db, run_id, pair_id, result)
        if failure is not None:
            stage, message = failure
            db.execute(
                "INSERT OR REPLACE INTO failures VALUES (?, ?, ?, ?, ?)",
                [run_id, pair_id, stage, message, utc_now()],
            )

    store.write(work)


def _put(db: sqlite3.Connection, run_id: int, pair_id: int, result: StageResult) -> None:
    content = result.content
    if isinstance(content, StoredAlignment):
        put_alignment(db, run_id, pair_id, content)
    elif isinstance(content, StoredDetection):
        put_detection(db, run_id, pair_id, content)
    elif isinstance(content, StoredIntegration):
        put_integration(db, run_id, pair_id, content)
    elif result.stage == "label":
        put_labels(db, run_id, pair_id, [c for c in content if isinstance(c, StoredLabel)])
    else:
        put_objects(db, run_id, pair_id, [c for c in content if isinstance(c, ObjectInstance)])
    _note(db, run_id, pair_id, result.stage, result.key, result.seconds)


def _note(
    db: sqlite3.Connection, run_id: int, pair_id: int, stage: Stage, key: str, seconds: float
) -> None:
    db.execute(
        "INSERT OR REPLACE INTO results VALUES (?, ?, ?, ?, ?)",
        [run_id, pair_id, stage, key, seconds],
    )
    db.execute(
        "DELETE FROM failures WHERE run_id = ? AND pair_id = ? AND stage = ?",
        [run_id, pair_id, stage],
    )


def take_over(store: Store, run_id: int, pair_id: int, stage: Stage, key: str) -> bool:
    """Copy a result of that key from another run; False where there is none."""
    if stage not in LAYER_TABLES:
        return False
    row = (
        store.read()
        .execute(
            "SELECT run_id, seconds FROM results WHERE pair_id = ? AND stage = ? AND key = ?"
            " AND run_id <> ? ORDER BY run_id LIMIT 1",
            [pair_id, stage, key, run_id],
        )
        .fetchone()
    )
    if row is None:
        return False
    table = LAYER_TABLES[stage]

    def work(db: sqlite3.Connection) -> None:
        columns = [
            c["name"]
            for c in db.execute(f"PRAGMA table_info({table})")
            if c["name"] not in ("id", "run_id")
        ]
        names = ", ".join(columns)
        db.execute(f"DELETE FROM {table} WHERE run_id = ? AND pair_id = ?", [run_id, pair_id])
        db.execute(
            f"INSERT INTO {table} (run_id, {names}) SELECT ?, {names} FROM {table}"
            " WHERE run_id = ? AND pair_id = ?",
            [run_id, row["run_id"], pair_id],
        )
        _note(db, run_id, pair_id, stage, key, row["seconds"])

    store.write(work)
    return True


def edit_label(
    store: Store, run_id: int, pair_id: int, number: int, label: str, annotator_id: int
) -> None:
    """Write a person's label in place of the parsed one, or one more; the search is then stale.

    Raises:
        NotFound: when the number is not one of the pair's labels, nor the next one.
    """

    def work(db: sqlite3.Connection) -> None:
        count = db.execute(
            "SELECT count(*) FROM labels WHERE run_id = ? AND pair_id = ?", [run_id, pair_id]
        ).fetchone()[0]
        if not 0 <= number <= count:
            raise NotFound(f"label {number}: pair {pair_id} has {count} labels in this run")
        db.execute(
            "INSERT INTO labels VALUES (?, ?, ?, NULL, '', ?, '', ?, ?)"
            " ON CONFLICT (run_id, pair_id, number) DO UPDATE SET label = excluded.label,"
            " annotator_id = excluded.annotator_id, edited_at = excluded.edited_at",
            [run_id, pair_id, number, label, annotator_id, utc_now()],
        )
        rows = db.execute(
            "SELECT component, label FROM labels WHERE run_id = ? AND pair_id = ? ORDER BY number",
            [run_id, pair_id],
        )
        key = given_key(json.dumps([list(row) for row in rows]))
        _note(db, run_id, pair_id, "label", key, 0.0)

    store.write(work)
