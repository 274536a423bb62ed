"""Runs: executions of the pipeline with all their settings; listed, compared, deleted."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from reviewer.errors import Conflict, NotFound
from reviewer.records import Run
from reviewer.store.database import Store, utc_now
from reviewer.texts import clean_text


def open_run(
    store: Store,
    name: str,
    members: Mapping[str, str],
    settings: Mapping[str, Any],
    versions: Mapping[str, str],
) -> Run:
    """Return the run of that name, made if it is new.

    Args:
        members: registry names under "aligner", "detector", "segmenter".

    Raises:
        Conflict: when a run of that name has other settings.
    """
    text = json.dumps(settings, sort_keys=True)

    def work(db: sqlite3.Connection) -> int:
        row = db.execute("SELECT id, settings FROM runs WHERE name = ?", [name]).fetchone()
        if row:
            stored = json.loads(row["settings"])
            if stored != json.loads(text):
                differing = _differing(stored, json.loads(text))
                raise Conflict(
                    f"run {name}: exists with another {', '.join(differing)};"
                    " give this one a name of its own with --name"
                )
            return int(row["id"])
        key = db.execute(
            "INSERT INTO runs (name, aligner, detector, segmenter, settings, versions, created_at)"
            " VALUES (?, ?, ?, ?, ?, ?, ?)",
            [
                name,
                members["aligner"],
                members["detector"],
                members["segmenter"],
                text,
                json.dumps(versions, sort_keys=True),
                utc_now(),
            ],
        ).lastrowid
        assert key is not None
        return key

    key = store.write(work)
    return next(run for run in list_runs(store) if run.id == key)


def complete_settings(store: Store, run_id: int, settings: Mapping[str, Any]) -> None:
    """Complete a run's record with missing settings; the caller knows that nothing else differs."""
    text = json.dumps(settings, sort_keys=True)
    store.write(lambda db: db.execute("UPDATE runs SET settings = ? WHERE id = ?", [text, run_id]))


def _differing(
    stored: Mapping[str, Any], wanted: Mapping[str, Any], above: str = ""
) -> Iterator[str]:
    """Yield which settings differ, those of a member by its own name, with both values."""
    for key in sorted({*stored, *wanted}):
        first, second = stored.get(key), wanted.get(key)
        if isinstance(first, dict) and isinstance(second, dict):
            yield from _differing(first, second, f"{above}{key} ")
        elif first != second:
            yield f"{above}{key} ({first}, not {second})"


def list_runs(store: Store) -> list[Run]:
    """Return all runs, oldest first."""
    return [
        Run(
            row["id"],
            row["name"],
            row["aligner"],
            row["detector"],
            row["segmenter"],
            json.loads(row["settings"]),
            row["created_at"],
        )
        for row in store.read().execute("SELECT * FROM runs ORDER BY id")
    ]


def clean_run_name(name: str) -> str:
    """Return the name of a new run as it is kept.

    Raises:
        InvalidInput: when it is blank, longer than 400 characters, or cannot be read.
    """
    return clean_text(name, "run name", longest=400, least=1, fold=False)


def run_of_name(store: Store, name: str) -> Run:
    """Return a run.

    Raises:
        NotFound: when there is none of that name.
    """
    runs = list_runs(store)
    for run in runs:
        if run.name == name:
            return run
    raise NotFound(f"run {name}: does not exist; there are {', '.join(r.name for r in runs)}")


def run_or_newest(store: Store, name: str | None) -> Run:
    """Return the named run, or the newest one.

    Raises:
        NotFound: when there is none of that name, or no run at all.
    """
    if name:
        return run_of_name(store, name)
    known = list_runs(store)
    if not known:
        raise NotFound("there is no run yet; run `reviewer run`, or import layers")
    return known[-1]


@dataclass(frozen=True, slots=True)
class StageSummary:
    """A stage of a run: pairs done and failed, mean seconds per pair that it computed itself."""

    stage: str
    done: int
    failed: int
    mean_seconds: float


@dataclass(frozen=True, slots=True)
class RunFailure:
    """A pair that a stage could not do."""

    pair: str
    stage: str
    message: str
    created_at: str


def run_summary(store: Store, run_id: int) -> list[StageSummary]:
    """Return what each stage of a run has done, in the order of the pipeline."""
    rows = store.read().execute(
        "WITH s (stage, place) AS"
        " (VALUES ('align', 1), ('detect', 2), ('label', 3), ('search', 4), ('integrate', 5))"
        " SELECT s.stage, count(r.pair_id) AS done, coalesce(avg(r.seconds), 0) AS mean,"
        " (SELECT count(*) FROM failures f WHERE f.run_id = :run AND f.stage = s.stage) AS failed"
        " FROM s LEFT JOIN results r ON r.stage = s.stage AND r.run_id = :run"
        " GROUP BY s.stage ORDER BY s.place",
        {"run": run_id},
    )
    return [StageSummary(row["stage"], row["done"], row["failed"], row["mean"]) for row in rows]


def run_failures(store: Store, run_id: int) -> list[RunFailure]:
    """Return the pairs that a run could not do, by name."""
    rows = store.read().execute(
        "SELECT s.name || '/' || p.name AS pair, f.stage, f.message, f.created_at FROM failures f"
        " JOIN pairs p ON p.id = f.pair_id JOIN splits s ON s.id = p.split_id"
        " WHERE f.run_id = ? ORDER BY 1, 2",
        [run_id],
    )
    return [RunFailure(*row) for row in rows]


def delete_run(store: Store, name: str, *, with_verdicts: bool = False) -> None:
    """Delete a run and all its layers, regions, predictions and scores; ground truth stays.

    Raises:
        NotFound: when there is none of that name.
        Conflict: when people gave verdicts in it, unless `with_verdicts` says so.
    """
    run = run_of_name(store, name)

    def work(db: sqlite3.Connection) -> None:
        verdicts = db.execute(
            "SELECT count(*) FROM audits a JOIN regions g ON g.id = a.region_id WHERE g.run_id = ?",
            [run.id],
        ).fetchone()[0]
        if verdicts and not with_verdicts:
            raise Conflict(
                f"run {name}: holds {verdicts} verdicts of people, which would be gone too;"
                " say --with-verdicts if that is wanted"
            )
        # The triggers keep single verdicts from being lost; a whole run goes on purpose. They are
        # put back in the same transaction.
        guards = db.execute(
            "SELECT name, sql FROM sqlite_master WHERE name IN ('audits_last', 'withdrawals_last')"
        ).fetchall()
        for guard in guards:
            db.execute(f"DROP TRIGGER {guard['name']}")
        db.execute("DELETE FROM runs WHERE id = ?", [run.id])
        for guard in guards:
            db.execute(guard["sql"])

    store.write(work)
