"""Runs and what their stages leave behind: alignments, detections, objects, regions, predictions.

Each stage writes one pair in one transaction, so a killed run resumes with the pair it was at.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from reviewer.doi import Region
from reviewer.errors import Conflict, NotFound
from reviewer.masks import Rle
from reviewer.records import Method, ObjectInstance, Run, StoredRegion
from reviewer.store.database import Store, mask_columns, require, utc_now
from reviewer.store.revisions import rle_of_row

Stage = Literal["align", "detect", "search", "integrate"]
STAGES: tuple[Stage, ...] = ("align", "detect", "search", "integrate")
STAGE_TABLE: dict[Stage, str] = {
    "align": "alignments",
    "detect": "detections",
    "search": "searches",
    "integrate": "predictions",
}


@dataclass(frozen=True, slots=True)
class StoredAlignment:
    """An alignment as stored; `pipeline.fields` turns flow bytes back into arrays."""

    flow: bytes
    flow_stride: int
    valid: Rle
    residual_before: float
    residual_after: float
    seconds: float


@dataclass(frozen=True, slots=True)
class StoredDetection:
    """M_o, and the probability map as a grey PNG where there is one."""

    probability_png: bytes | None
    threshold: float
    mask: Rle
    seconds: float


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
                differing = sorted(
                    k for k in {*stored, *settings} if stored.get(k) != settings.get(k)
                )
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


def finished_pairs(store: Store, run_id: int, stage: Stage) -> set[int]:
    """Return the ids of the pairs that a stage of a run has done."""
    query = f"SELECT DISTINCT pair_id FROM {STAGE_TABLE[stage]} WHERE run_id = ?"
    return {row["pair_id"] for row in store.read().execute(query, [run_id])}


def save_alignment(store: Store, run_id: int, pair_id: int, alignment: StoredAlignment) -> None:
    """Write the alignment of a pair, in place of an earlier one."""
    valid = alignment.valid
    values = [
        run_id,
        pair_id,
        alignment.flow,
        alignment.flow_stride,
        valid.counts,
        valid.area / (valid.height * valid.width),
        alignment.residual_before,
        alignment.residual_after,
        alignment.seconds,
    ]

    def work(db: sqlite3.Connection) -> None:
        db.execute("INSERT OR REPLACE INTO alignments VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", values)
        _forget_failure(db, run_id, pair_id, "align")

    store.write(work)


def load_alignment(store: Store, run_id: int, pair_id: int) -> StoredAlignment | None:
    """Return the alignment of a pair, None where the stage has not run."""
    row = (
        store.read()
        .execute(
            "SELECT a.*, i.height, i.width FROM alignments a JOIN pairs p ON p.id = a.pair_id"
            " JOIN images i ON i.id = p.live_id WHERE a.run_id = ? AND a.pair_id = ?",
            [run_id, pair_id],
        )
        .fetchone()
    )
    if row is None:
        return None
    area = round(row["valid_fraction"] * row["height"] * row["width"])
    valid = Rle(row["height"], row["width"], row["valid_rle"], area, (0, 0, 0, 0))
    return StoredAlignment(
        row["flow"],
        row["flow_stride"],
        valid,
        row["residual_before"],
        row["residual_after"],
        row["seconds"],
    )


def save_detection(store: Store, run_id: int, pair_id: int, detection: StoredDetection) -> None:
    """Write M_o of a pair, in place of an earlier one."""
    values = [
        run_id,
        pair_id,
        detection.probability_png,
        detection.threshold,
        *mask_columns(detection.mask),
        detection.seconds,
    ]

    def work(db: sqlite3.Connection) -> None:
        db.execute(
            f"INSERT OR REPLACE INTO detections VALUES ({', '.join('?' * len(values))})", values
        )
        _forget_failure(db, run_id, pair_id, "detect")

    store.write(work)


def load_detection(store: Store, run_id: int, pair_id: int) -> StoredDetection | None:
    """Return M_o of a pair, None where the stage has not run."""
    row = (
        store.read()
        .execute("SELECT * FROM detections WHERE run_id = ? AND pair_id = ?", [run_id, pair_id])
        .fetchone()
    )
    if row is None:
        return None
    return StoredDetection(row["probability"], row["threshold"], rle_of_row(row), row["seconds"])


def save_objects(
    store: Store,
    run_id: int,
    pair_id: int,
    objects: Sequence[ObjectInstance],
    seconds: float,
) -> None:
    """Write all instances of a pair (both sides), in place of earlier ones."""

    def work(db: sqlite3.Connection) -> None:
        db.execute("DELETE FROM objects WHERE run_id = ? AND pair_id = ?", [run_id, pair_id])
        db.executemany(
            "INSERT INTO objects (run_id, pair_id, side, number, label, score, height, width, rle,"
            " area, box_x, box_y, box_width, box_height)"
            " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [
                [run_id, pair_id, o.side, o.number, o.label, o.score, *mask_columns(o.mask)]
                for o in objects
            ],
        )
        db.execute("INSERT OR REPLACE INTO searches VALUES (?, ?, ?)", [run_id, pair_id, seconds])
        _forget_failure(db, run_id, pair_id, "search")

    store.write(work)


def load_objects(store: Store, run_id: int, pair_id: int) -> list[ObjectInstance]:
    """Return the instances of a pair: live ones first, each side by number."""
    rows = store.read().execute(
        "SELECT * FROM objects WHERE run_id = ? AND pair_id = ? ORDER BY side, number",
        [run_id, pair_id],
    )
    return [
        ObjectInstance(row["side"], row["number"], row["label"], row["score"], rle_of_row(row))
        for row in rows
    ]


def save_integration(
    store: Store, run_id: int, pair_id: int, regions: Sequence[Region], base: Rle, final: Rle
) -> None:
    """Write the regions and both predictions (M_o and with DoI) of a pair."""

    def work(db: sqlite3.Connection) -> None:
        db.execute("DELETE FROM regions WHERE run_id = ? AND pair_id = ?", [run_id, pair_id])
        for number, region in enumerate(regions):
            x0, y0, x1, y1 = region.box_xyxy or (0, 0, 0, 0)
            db.execute(
                "INSERT INTO regions (run_id, pair_id, number, objects, components, overlap_px,"
                " f_b, iou, doi, choice, inspect, reason, box_x, box_y, box_width, box_height)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    run_id,
                    pair_id,
                    number,
                    json.dumps(region.object_indices),
                    json.dumps(region.component_indices),
                    region.overlap_px,
                    region.f_b,
                    region.iou,
                    region.doi,
                    region.choice,
                    int(region.inspect),
                    region.reason,
                    x0,
                    y0,
                    x1 - x0,
                    y1 - y0,
                ],
            )
        for method, rle in (("base", base), ("doi", final)):
            put_prediction(db, run_id, pair_id, method, rle)
        _forget_failure(db, run_id, pair_id, "integrate")

    store.write(work)


def load_regions(store: Store, run_id: int, pair_id: int) -> list[StoredRegion]:
    """Return the regions of a pair by number, each with its newest verdict."""
    rows = store.read().execute(
        "SELECT g.*, d.verdict, d.annotator, d.labels FROM regions g"
        " JOIN doi_decisions d ON d.region_id = g.id"
        " WHERE g.run_id = ? AND g.pair_id = ? ORDER BY g.number",
        [run_id, pair_id],
    )
    return [_region(row) for row in rows]


def region_of_id(store: Store, region_id: int) -> tuple[int, int]:
    """Return (run id, pair id) of a region.

    Raises:
        NotFound: when the region does not exist.
    """
    row = require(
        store.read()
        .execute("SELECT run_id, pair_id FROM regions WHERE id = ?", [region_id])
        .fetchone(),
        f"region {region_id}: does not exist",
    )
    return row["run_id"], row["pair_id"]


def load_prediction(store: Store, run_id: int, pair_id: int, method: Method) -> Rle | None:
    """Return a final mask of a run, None where there is none."""
    row = (
        store.read()
        .execute(
            "SELECT * FROM predictions WHERE run_id = ? AND pair_id = ? AND method = ?",
            [run_id, pair_id, method],
        )
        .fetchone()
    )
    return rle_of_row(row) if row else None


def load_final_mask(store: Store, run_id: int, pair_id: int) -> Rle | None:
    """Return what a run says in the end: the audited mask where people gave verdicts, else the one
    with DoI; None before either."""
    audited = load_prediction(store, run_id, pair_id, "audited")
    return audited or load_prediction(store, run_id, pair_id, "doi")


def save_failure(store: Store, run_id: int, pair_id: int, stage: Stage, message: str) -> None:
    """Record that a stage could not do a pair; its earlier result stays."""
    values = [run_id, pair_id, stage, message, utc_now()]
    store.write(
        lambda db: db.execute("INSERT OR REPLACE INTO failures VALUES (?, ?, ?, ?, ?)", values)
    )


def put_prediction(
    db: sqlite3.Connection, run_id: int, pair_id: int, method: str, rle: Rle
) -> None:
    """Write a final mask inside a transaction of the writer."""
    values = [run_id, pair_id, method, *mask_columns(rle)]
    db.execute(
        f"INSERT OR REPLACE INTO predictions VALUES ({', '.join('?' * len(values))})", values
    )


def _forget_failure(db: sqlite3.Connection, run_id: int, pair_id: int, stage: Stage) -> None:
    db.execute(
        "DELETE FROM failures WHERE run_id = ? AND pair_id = ? AND stage = ?",
        [run_id, pair_id, stage],
    )


def _region(row: sqlite3.Row) -> StoredRegion:
    x, y, width, height = row["box_x"], row["box_y"], row["box_width"], row["box_height"]
    region = Region(
        tuple(json.loads(row["objects"])),
        tuple(json.loads(row["components"])),
        row["overlap_px"],
        row["f_b"],
        row["iou"],
        row["doi"],
        row["choice"],
        bool(row["inspect"]),
        row["reason"],
        (x, y, x + width, y + height) if width else None,
    )
    return StoredRegion(
        row["id"], row["number"], region, row["labels"] or "", row["verdict"], row["annotator"]
    )
