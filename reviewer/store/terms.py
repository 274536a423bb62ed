"""Terms of pairs and outcomes of regions: which are out of date, and how they are stored."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from reviewer.metrics import Counts
from reviewer.store.database import Store
from reviewer.store.skips import NOT_SKIPPED


@dataclass(frozen=True, slots=True)
class StaleTerms:
    """A pair whose terms are missing, or belong to another revision or another integration."""

    pair_id: int
    revision: int
    key: str


@dataclass(frozen=True, slots=True)
class StoredTerms:
    """Terms of a pair as JSON text, see `evaluation.terms`."""

    pair_id: int
    split: str
    truth_px: int
    terms: str


def stale_terms(store: Store, run_id: int, pair_id: int | None = None) -> list[StaleTerms]:
    """Return the pairs of a run (or the one) whose terms are to be made again."""
    # Two queries rather than one with an OR, which no index would serve.
    one = "" if pair_id is None else " AND r.pair_id = ?"
    rows = store.read().execute(
        "SELECT r.pair_id, t.number, r.key FROM results r JOIN ground_truth t USING (pair_id)"
        " LEFT JOIN pair_terms k ON k.run_id = r.run_id AND k.pair_id = r.pair_id"
        " WHERE r.run_id = ? AND r.stage = 'integrate'"
        f" AND (k.revision IS NULL OR k.revision <> t.number OR k.key <> r.key){one}",
        [run_id] if pair_id is None else [run_id, pair_id],
    )
    return [StaleTerms(*row) for row in rows]


def save_terms(
    store: Store,
    run_id: int,
    found: Sequence[tuple[StaleTerms, int, str, Mapping[int, Mapping[str, Counts]]]],
) -> None:
    """Write (pair, scored changed pixels, terms, outcomes by region id) in one transaction."""

    def work(db: sqlite3.Connection) -> None:
        for pair, truth_px, terms, regions in found:
            db.execute(
                "INSERT OR REPLACE INTO pair_terms VALUES (?, ?, ?, ?, ?, ?)",
                [run_id, pair.pair_id, pair.revision, pair.key, truth_px, terms],
            )
            db.executemany(
                "INSERT OR REPLACE INTO region_outcomes VALUES (?, ?, ?, ?, ?, ?)",
                [
                    [region_id, outcome, pair.revision, c.tp, c.fp, c.fn]
                    for region_id, outcomes in regions.items()
                    for outcome, c in outcomes.items()
                ],
            )

    store.write(work)


def load_terms(store: Store, run_id: int) -> list[StoredTerms]:
    """Return the terms of a run that are up to date, by split and pair, without skipped pairs."""
    rows = store.read().execute(
        "SELECT k.pair_id, s.name, k.truth_px, k.terms FROM pair_terms k"
        " JOIN pairs p ON p.id = k.pair_id JOIN splits s ON s.id = p.split_id"
        " JOIN ground_truth t ON t.pair_id = k.pair_id AND t.number = k.revision"
        f" WHERE k.run_id = ? AND k.{NOT_SKIPPED} ORDER BY s.name, p.name",
        [run_id],
    )
    return [StoredTerms(*row) for row in rows]


def region_outcomes(store: Store, run_id: int, pair_id: int) -> dict[int, dict[str, Counts]]:
    """Return what each outcome of a pair's regions would give, by region id and outcome."""
    rows = store.read().execute(
        "SELECT o.* FROM region_outcomes o JOIN regions g ON g.id = o.region_id"
        " WHERE g.run_id = ? AND g.pair_id = ?",
        [run_id, pair_id],
    )
    found: dict[int, dict[str, Counts]] = {}
    for row in rows:
        counts = Counts(row["tp"], row["fp"], row["fn"])
        found.setdefault(row["region_id"], {})[row["outcome"]] = counts
    return found
