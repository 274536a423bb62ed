"""Schema of a `reviewer` database, as migrations that `sqlite-utils migrate` also finds.

Each migration is a script in `sql/`. Every column carries a comment; `reviewer schema` turns them
into `db/README.md`. Masks are COCO run-lengths with size, area and box beside them
(`sql/mask_columns.sql`, put in place of `{MASK}`), so that no list ever decodes one. History (mask
revisions, audits) is append-only, which triggers hold.
"""

from __future__ import annotations

import sqlite3
from pathlib import Path

from sqlite_utils import Database, Migrations

migrations = Migrations("reviewer")
SCRIPTS = Path(__file__).parent / "sql"


@migrations()
def m001_first_schema(db: Database) -> None:
    """Create tables, triggers and views."""
    _run(db, "m001_first_schema")


@migrations()
def m002_effort(db: Database) -> None:
    """Keep the time of looking, and add up people's work."""
    _run(db, "m002_effort")


@migrations()
def m003_trainings(db: Database) -> None:
    """Keep which checkpoint was trained on what."""
    _run(db, "m003_trainings")


@migrations()
def m004_results(db: Database) -> None:
    """Keep the inputs of each result, labels, and how good an alignment looks."""
    _run(db, "m004_results")


@migrations()
def m005_found(db: Database) -> None:
    """List what was found, under names that people may change."""
    _run(db, "m005_found")


@migrations()
def m006_terms(db: Database) -> None:
    """Keep what the scores under any DoI rule are made of."""
    _run(db, "m006_terms")


@migrations()
def m007_reasons(db: Database) -> None:
    """Give verdicts a reason from a list that people edit."""
    _run(db, "m007_reasons")


@migrations()
def m008_approvals(db: Database) -> None:
    """Let ground truth be the revision that was approved or submitted, not the newest one."""
    _run(db, "m008_approvals")


@migrations()
def m009_door(db: Database) -> None:
    """Keep who is signed in, so that signing out ends it."""
    _run(db, "m009_door")


@migrations()
def m011_skips(db: Database) -> None:
    """Let verdicts be taken back, detections be doubted, and pairs be skipped as badly aligned."""
    _run(db, "m011_skips")


@migrations()
def m012_terms(db: Database) -> None:
    """Let a rule reject what the reference shows too."""
    _run(db, "m012_terms")


@migrations()
def m013_skipped(db: Database) -> None:
    """Leave skipped pairs out of the views of scores."""
    _run(db, "m013_skipped")


@migrations()
def m014_unseen(db: Database) -> None:
    """Keep how sure an alignment is, and leave out of the scores what a run has not seen."""
    _run(db, "m014_unseen")


@migrations()
def m015_sweeps(db: Database) -> None:
    """Keep which tiles of a pair a person has looked at from close by."""
    _run(db, "m015_sweeps")


def _run(db: Database, name: str) -> None:
    script = (SCRIPTS / f"{name}.sql").read_text(encoding="utf-8")
    mask = (SCRIPTS / "mask_columns.sql").read_text(encoding="utf-8").rstrip()
    statement = ""
    for line in script.replace("{MASK}", f"\n{mask}").splitlines(keepends=True):
        statement += line
        if _complete(statement):
            db.execute(statement.strip())
            statement = ""


def _complete(statement: str) -> bool:
    """Say whether a statement ended; `executescript` would commit the migration's transaction."""
    return bool(statement.strip()) and sqlite3.complete_statement(statement)
