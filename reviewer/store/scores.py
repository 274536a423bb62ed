"""Pixel counts: which ones are stale, where they are written, and how they are read pooled."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass, fields

from reviewer.masks import Rle, rle_beside
from reviewer.metrics import Counts
from reviewer.records import Score
from reviewer.store.database import Store
from reviewer.store.revisions import rle_of_row
from reviewer.store.skips import NOT_SKIPPED
from reviewer.words import Method, Standing

COUNTS = tuple(field.name for field in fields(Counts))
TRUTH = "t.rle AS t_rle, t.area AS t_area, t.ignore_rle, a.valid_rle"
"""In a query over `ground_truth t` and `alignments a`: what a prediction is held against."""


@dataclass(frozen=True, slots=True)
class StaleScore:
    """A prediction whose counts are missing or belong to an older revision.

    Attributes:
        valid: pixels that the run has seen; None where it has no alignment.
    """

    run_id: int
    pair_id: int
    method: Method
    prediction: Rle
    revision: int
    truth: Rle
    ignore: Rle | None
    valid: Rle | None


@dataclass(frozen=True, slots=True)
class PairScore:
    """Fresh counts of one method on one pair, with what it can be grouped by."""

    run: str
    method: Method
    split: str
    workspace: str | None
    object_group: int | None
    pair_id: int
    counts: Counts


@dataclass(frozen=True, slots=True)
class MaskPair:
    """A prediction, the ground truth of its pair, and what of it is scored.

    Attributes:
        valid: pixels that the run has seen; None where it has no alignment.
    """

    run: str
    method: Method
    prediction: Rle
    truth: Rle
    ignore: Rle | None
    valid: Rle | None


def mask_pair_keys(
    store: Store, run: str | None = None, standings: Sequence[Standing] = ()
) -> list[tuple[int, int, Method]]:
    """Return (run id, pair id, method) of every prediction of a pair with ground truth that is not
    skipped.

    Args:
        standings: see `pair_scores`.
    """
    rows = store.read().execute(
        "SELECT p.run_id, p.pair_id, p.method FROM predictions p JOIN runs r ON r.id = p.run_id"
        " WHERE (?1 IS NULL OR r.name = ?1)"
        " AND p.pair_id IN (SELECT pair_id FROM ground_truth WHERE ?2 = '[]'"
        " OR standing IN (SELECT value FROM json_each(?2)))"
        f" AND p.{NOT_SKIPPED} ORDER BY 1, 2, 3",
        [run, json.dumps(list(standings))],
    )
    return [(row["run_id"], row["pair_id"], row["method"]) for row in rows]


def mask_pair(store: Store, run_id: int, pair_id: int, method: Method) -> MaskPair:
    """Return a prediction with the ground truth of its pair."""
    row = (
        store.read()
        .execute(
            f"SELECT p.*, r.name, {TRUTH} FROM predictions p"
            " JOIN runs r ON r.id = p.run_id JOIN ground_truth t ON t.pair_id = p.pair_id"
            " LEFT JOIN alignments a ON a.run_id = p.run_id AND a.pair_id = p.pair_id"
            " WHERE p.run_id = ? AND p.pair_id = ? AND p.method = ?",
            [run_id, pair_id, method],
        )
        .fetchone()
    )
    return MaskPair(row["name"], method, rle_of_row(row), *_truth_of_row(row))


def _truth_of_row(row: sqlite3.Row) -> tuple[Rle, Rle | None, Rle | None]:
    truth = Rle(row["height"], row["width"], row["t_rle"], row["t_area"], (0, 0, 0, 0))
    return truth, rle_beside(truth, row["ignore_rle"]), rle_beside(truth, row["valid_rle"])


def stale_scores(store: Store, pair_id: int | None = None) -> list[StaleScore]:
    """Return the predictions to count again, of one pair or of all."""
    query = f"""
    SELECT p.*, t.number AS revision, {TRUTH}
    FROM predictions p JOIN ground_truth t ON t.pair_id = p.pair_id
    LEFT JOIN alignments a ON a.run_id = p.run_id AND a.pair_id = p.pair_id
    LEFT JOIN scores s ON s.run_id = p.run_id AND s.pair_id = p.pair_id AND s.method = p.method
    WHERE (s.revision IS NULL OR s.revision <> t.number) AND (?1 IS NULL OR p.pair_id = ?1)
    """
    found = []
    for row in store.read().execute(query, [pair_id]):
        found.append(
            StaleScore(
                row["run_id"],
                row["pair_id"],
                row["method"],
                rle_of_row(row),
                row["revision"],
                *_truth_of_row(row),
            )
        )
    return found


def save_scores(store: Store, scores: Sequence[tuple[StaleScore, Counts]]) -> None:
    """Write counts in one transaction."""
    rows = [
        [s.run_id, s.pair_id, s.method, s.revision, *(getattr(c, name) for name in COUNTS)]
        for s, c in scores
    ]
    marks = ", ".join("?" * (4 + len(COUNTS)))
    store.write(lambda db: db.executemany(f"INSERT OR REPLACE INTO scores VALUES ({marks})", rows))


def split_scores(store: Store, run: str | None = None) -> list[Score]:
    """Return counts pooled per run, method and split, without skipped pairs."""
    rows = store.read().execute(
        "SELECT * FROM split_scores WHERE ?1 IS NULL OR run = ?1 ORDER BY run, method, split",
        [run],
    )
    return [_score(row) for row in rows]


def pair_counts(store: Store, run_id: int, pair_id: int) -> dict[Method, Counts]:
    """Return the fresh counts of one pair by method, also of one that is skipped."""
    rows = store.read().execute(
        "SELECT s.* FROM scores s JOIN ground_truth t"
        " ON t.pair_id = s.pair_id AND t.number = s.revision"
        " WHERE s.run_id = ? AND s.pair_id = ?",
        [run_id, pair_id],
    )
    return {row["method"]: _counts(row) for row in rows}


def pair_scores(
    store: Store, run: str | None = None, standings: Sequence[Standing] = ()
) -> list[PairScore]:
    """Return the fresh counts of every pair that is not skipped, of one run or all.

    Args:
        standings: only pairs whose ground truth stands by one of these; all of them where empty.
    """
    rows = store.read().execute(
        "SELECT v.*, s.workspace, s.object_group FROM pair_scores v JOIN splits s"
        " ON s.name = v.split WHERE (?1 IS NULL OR v.run = ?1)"
        " AND (?2 = '[]' OR v.standing IN (SELECT value FROM json_each(?2)))"
        " ORDER BY v.run, v.method, v.pair_id",
        [run, json.dumps(list(standings))],
    )
    return [
        PairScore(
            row["run"],
            row["method"],
            row["split"],
            row["workspace"],
            row["object_group"],
            row["pair_id"],
            _counts(row),
        )
        for row in rows
    ]


def _score(row: sqlite3.Row) -> Score:
    return Score(row["run"], row["method"], row["split"], row["pairs"], _counts(row))


def _counts(row: sqlite3.Row) -> Counts:
    return Counts(**{name: row[name] for name in COUNTS})
