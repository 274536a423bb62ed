"""What the stages of a run leave of a pair: alignment, change mask M_o, labels, objects.

`load_*` read one pair; `put_*` write inside a transaction of the writer, in place of what was
there. Who writes is `store.results`, which also stores the key of its inputs.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.masks import Rle
from reviewer.records import ObjectInstance
from reviewer.store.database import Store, mask_columns
from reviewer.store.revisions import rle_of_row

DOUBT = """trim(
    coalesce((SELECT a.doubt FROM alignments a WHERE a.pair_id = p.id AND a.run_id = :run), '')
    || '; ' ||
    coalesce((SELECT d.doubt FROM detections d WHERE d.pair_id = p.id AND d.run_id = :run), ''),
    '; ')"""
"""In a query over `pairs p`: why the results of `:run` are doubted."""


@dataclass(frozen=True, slots=True)
class StoredAlignment:
    """An alignment as stored; `pipeline.fields` turns flow bytes back into arrays.

    Attributes:
        residual_before, residual_after: mean absolute grey difference, 0..255.
        backward_px: median forward-backward error, pixels; None where there is no way back.
        doubt: why it looks badly aligned, "" = it does not.
        confidence_png: how sure it is on the samples of the flow, 255 = surely; None where the
            aligner does not say.
    """

    flow: bytes
    flow_stride: int
    valid: Rle
    residual_before: float
    residual_after: float
    backward_px: float | None = None
    doubt: str = ""
    confidence_png: bytes | None = None


@dataclass(frozen=True, slots=True)
class StoredDetection:
    """M_o, the probability map as a grey PNG where there is one, and why it is doubted or ""."""

    probability_png: bytes | None
    threshold: float
    mask: Rle
    doubt: str = ""


@dataclass(frozen=True, slots=True)
class StoredLabel:
    """A labeller's answer about a component of M_o (None: the whole mask), and the search term.

    Attributes:
        raw: the labeller's words.
        label: the object's name, "" = nothing to search.
        note: why the label is empty.
        edited_by: the annotator who wrote `label`, None = nobody.
    """

    component: int | None
    raw: str
    label: str
    note: str = ""
    edited_by: str | None = None


def put_alignment(
    db: sqlite3.Connection, run_id: int, pair_id: int, alignment: StoredAlignment
) -> None:
    """Write an alignment."""
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
        alignment.backward_px,
        alignment.doubt,
        alignment.confidence_png,
    ]
    db.execute(f"INSERT OR REPLACE INTO alignments VALUES ({_marks(values)})", values)


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
        row["backward_px"],
        row["doubt"],
        row["confidence"],
    )


def put_detection(
    db: sqlite3.Connection, run_id: int, pair_id: int, detection: StoredDetection
) -> None:
    """Write M_o."""
    mask = mask_columns(detection.mask)
    values = [
        run_id,
        pair_id,
        detection.probability_png,
        detection.threshold,
        *mask,
        detection.doubt,
    ]
    db.execute(f"INSERT OR REPLACE INTO detections VALUES ({_marks(values)})", values)


def load_detection(store: Store, run_id: int, pair_id: int) -> StoredDetection | None:
    """Return M_o of a pair, None where the stage has not run."""
    row = (
        store.read()
        .execute("SELECT * FROM detections WHERE run_id = ? AND pair_id = ?", [run_id, pair_id])
        .fetchone()
    )
    if row is None:
        return None
    return StoredDetection(row["probability"], row["threshold"], rle_of_row(row), row["doubt"])


def pair_doubt(store: Store, run_id: int, pair_id: int) -> str:
    """Return why a run's results suggest that the pair cannot be compared, "" if they do not."""
    query = f"SELECT {DOUBT} FROM pairs p WHERE p.id = :pair"
    row = store.read().execute(query, {"run": run_id, "pair": pair_id}).fetchone()
    return row[0] if row else ""


def put_labels(
    db: sqlite3.Connection, run_id: int, pair_id: int, labels: Sequence[StoredLabel]
) -> None:
    """Write what a labeller said."""
    db.execute("DELETE FROM labels WHERE run_id = ? AND pair_id = ?", [run_id, pair_id])
    db.executemany(
        "INSERT INTO labels (run_id, pair_id, number, component, raw, label, note)"
        " VALUES (?, ?, ?, ?, ?, ?, ?)",
        [
            [run_id, pair_id, number, label.component, label.raw, label.label, label.note]
            for number, label in enumerate(labels)
        ],
    )


def load_labels(store: Store, run_id: int, pair_id: int) -> list[StoredLabel]:
    """Return the labels of a pair by number."""
    rows = store.read().execute(
        "SELECT l.*, n.name FROM labels l LEFT JOIN annotators n ON n.id = l.annotator_id"
        " WHERE l.run_id = ? AND l.pair_id = ? ORDER BY l.number",
        [run_id, pair_id],
    )
    return [
        StoredLabel(row["component"], row["raw"], row["label"], row["note"], row["name"])
        for row in rows
    ]


def put_objects(
    db: sqlite3.Connection, run_id: int, pair_id: int, objects: Sequence[ObjectInstance]
) -> None:
    """Write all instances of a pair, both sides."""
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


def _marks(values: Sequence[object]) -> str:
    return ", ".join("?" * len(values))
