"""What was found: the regions that the final masks hold, and the names people give them."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.errors import NotFound
from reviewer.geometry import Pose2
from reviewer.store.database import Store, require, utc_now
from reviewer.store.skips import NOT_SKIPPED
from reviewer.texts import clean_text
from reviewer.words import Choice, Verdict

LONGEST_NAME = 200


@dataclass(frozen=True, slots=True)
class Find:
    """Something that was found.

    Attributes:
        labels: what the segmenter searched for, comma-separated, "" without a label.
        given_name: what a person calls it, None = nobody did.
        outcome: "adopt" for an object, "keep" for the detector's components.
        box_xyxy: on the live image, pixels.
        stamp: of the live image, seconds; None without poses.
        viewpoint: where the live image was taken; None without poses.
    """

    region_id: int
    run: str
    split: str
    pair: str
    pair_id: int
    labels: str
    given_name: str | None
    outcome: Choice
    doi: float
    inspect: bool
    verdict: Verdict | None
    box_xyxy: tuple[int, int, int, int]
    stamp: float | None
    viewpoint: Pose2 | None


def list_finds(store: Store, run_id: int, *, kept: bool = False) -> list[Find]:
    """Return what a run found, by split and pair, without skipped pairs.

    Args:
        kept: also what the detector says without an object for it.
    """
    rows = store.read().execute(
        "SELECT * FROM found WHERE run_id = ? AND (? OR outcome = 'adopt')"
        f" AND {NOT_SKIPPED}"
        " ORDER BY split, pair, region_id",
        [run_id, kept],
    )
    return [_find(row) for row in rows]


def finds_version(store: Store, run_id: int) -> tuple[int | str | None, ...]:
    """Return what changes whenever the finds of a run may have: far cheaper than listing them."""
    row = (
        store.read()
        .execute(
            "SELECT (SELECT max(id) FROM regions WHERE run_id = ?1) AS region,"
            " (SELECT max(id) FROM audits) AS audit,"
            " (SELECT max(id) FROM withdrawals) AS withdrawal,"
            " (SELECT max(created_at) FROM found_names) AS named,"
            " (SELECT count(*) FROM found_names) AS names,"
            " (SELECT max(created_at) FROM skips) AS skipped,"
            " (SELECT count(*) FROM skips) AS skips,"
            " (SELECT max(edited_at) FROM labels WHERE run_id = ?1) AS edited",
            [run_id],
        )
        .fetchone()
    )
    return (run_id, *row)


def find_of_region(store: Store, region_id: int) -> Find:
    """Return one find.

    Raises:
        NotFound: when the region does not exist, was rejected, or its pair is skipped.
    """
    query = f"SELECT * FROM found WHERE region_id = ? AND {NOT_SKIPPED}"
    row = store.read().execute(query, [region_id]).fetchone()
    return _find(require(row, f"region {region_id}: is not among what was found"))


def name_finds(store: Store, region_ids: Sequence[int], name: str, annotator_id: int) -> None:
    """Give finds a name; "" takes a given name away.

    Raises:
        NotFound: when a region does not exist.
        InvalidInput: when the name is too long, or cannot be read.
    """
    name = clean_text(name, "name", longest=LONGEST_NAME)
    ids = json.dumps(list(region_ids))

    def work(db: sqlite3.Connection) -> None:
        found = db.execute(
            "SELECT count(*) FROM regions WHERE id IN (SELECT value FROM json_each(?))", [ids]
        ).fetchone()[0]
        if found != len(set(region_ids)):
            raise NotFound("what was found: a region does not exist any more; list it again")
        db.execute(
            "DELETE FROM found_names WHERE region_id IN (SELECT value FROM json_each(?))", [ids]
        )
        if name:
            db.execute(
                "INSERT INTO found_names SELECT value, ?, ?, ? FROM json_each(?)",
                [name, annotator_id, utc_now(), ids],
            )

    store.write(work)


def _find(row: sqlite3.Row) -> Find:
    x, y = row["box_x"], row["box_y"]
    pose = None if row["x"] is None else Pose2(row["x"], row["y"], row["theta"])
    return Find(
        row["region_id"],
        row["run"],
        row["split"],
        row["pair"],
        row["pair_id"],
        row["labels"] or "",
        row["given_name"],
        row["outcome"],
        row["doi"],
        bool(row["inspect"]),
        row["verdict"],
        (x, y, x + row["box_width"], y + row["box_height"]),
        row["stamp"],
        pose,
    )
