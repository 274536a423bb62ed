"""Regions under DoI and the final masks of a run."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from reviewer.doi import Region
from reviewer.errors import Conflict
from reviewer.masks import Rle
from reviewer.records import StoredRegion
from reviewer.store.database import Store, mask_columns, require
from reviewer.store.revisions import rle_of_row
from reviewer.words import Method

REGIONS = """
SELECT g.*, d.verdict, d.annotator, d.verdict_reason, d.comment, d.labels FROM regions g
JOIN doi_decisions d ON d.region_id = g.id WHERE g.run_id = ? AND g.pair_id = ?"""
# What a region's record and its row name alike; its indices and its box are written otherwise.
ALIKE = ("overlap_px", "f_b", "iou", "doi", "choice", "inspect", "reason")
# What people said of regions, which other regions would leave behind: verdicts and names.
VERDICTS = """
SELECT count(*) AS verdicts, min(r.name) AS run
FROM (SELECT region_id FROM audits UNION ALL SELECT region_id FROM found_names) a
JOIN regions g ON g.id = a.region_id JOIN runs r ON r.id = g.run_id
WHERE g.run_id = ? AND g.pair_id = ?"""


@dataclass(frozen=True, slots=True)
class StoredIntegration:
    """The regions of a pair, and its final masks: M_o as it was, and with DoI."""

    regions: tuple[Region, ...]
    base: Rle
    final: Rle


def put_integration(
    db: sqlite3.Connection, run_id: int, pair_id: int, integration: StoredIntegration
) -> None:
    """Write regions and both predictions, in place of earlier ones.

    Raises:
        Conflict: when people gave verdicts on regions that would be others now.
    """
    known = [
        _region(row).region
        for row in db.execute(f"{REGIONS} ORDER BY g.number", [run_id, pair_id]).fetchall()
    ]
    if known != list(integration.regions):
        _refuse_if_judged(db, run_id, pair_id)
        db.execute("DELETE FROM regions WHERE run_id = ? AND pair_id = ?", [run_id, pair_id])
        db.execute(
            "DELETE FROM predictions WHERE run_id = ? AND pair_id = ? AND method = 'audited'",
            [run_id, pair_id],
        )
        _insert_regions(db, run_id, pair_id, integration.regions)
    for method, rle in (("base", integration.base), ("doi", integration.final)):
        put_prediction(db, run_id, pair_id, method, rle)


def count_verdicts(store: Store, run_id: int, pair_id: int) -> int:
    """Return how many verdicts and names people gave to a pair's regions in a run."""
    row = store.read().execute(VERDICTS, [run_id, pair_id]).fetchone()
    return int(row["verdicts"])


def _refuse_if_judged(db: sqlite3.Connection, run_id: int, pair_id: int) -> None:
    row = db.execute(VERDICTS, [run_id, pair_id]).fetchone()
    if row["verdicts"]:
        raise Conflict(
            f"pair {pair_id}: people gave {row['verdicts']} verdicts or names to its regions in run"
            f" {row['run']}, and these would be others now; give the new settings a run of"
            " their own with --name"
        )


def _insert_regions(
    db: sqlite3.Connection, run_id: int, pair_id: int, regions: Sequence[Region]
) -> None:
    for number, region in enumerate(regions):
        row = {"run_id": run_id, "pair_id": pair_id, "number": number, **_row(region)}
        columns, values = ", ".join(row), ", ".join(f":{name}" for name in row)
        db.execute(f"INSERT INTO regions ({columns}) VALUES ({values})", row)


def load_regions(store: Store, run_id: int, pair_id: int) -> list[StoredRegion]:
    """Return the regions of a pair by number, each with its newest verdict."""
    rows = store.read().execute(f"{REGIONS} ORDER BY g.number", [run_id, pair_id])
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
    """Return a run's final mask: the audited one where people gave verdicts, else the one
    with DoI; None before either."""
    audited = load_prediction(store, run_id, pair_id, "audited")
    return audited or load_prediction(store, run_id, pair_id, "doi")


def put_prediction(
    db: sqlite3.Connection, run_id: int, pair_id: int, method: str, rle: Rle
) -> None:
    """Write a final mask inside a transaction of the writer."""
    values = [run_id, pair_id, method, *mask_columns(rle)]
    db.execute(
        f"INSERT OR REPLACE INTO predictions VALUES ({', '.join('?' * len(values))})", values
    )


def _row(region: Region) -> dict[str, Any]:
    x0, y0, x1, y1 = region.box_xyxy or (0, 0, 0, 0)
    return {
        "objects": json.dumps(region.object_indices),
        "components": json.dumps(region.component_indices),
        **{name: getattr(region, name) for name in ALIKE},
        "box_x": x0,
        "box_y": y0,
        "box_width": x1 - x0,
        "box_height": y1 - y0,
    }


def _region(row: sqlite3.Row) -> StoredRegion:
    x, y, width, height = row["box_x"], row["box_y"], row["box_width"], row["box_height"]
    alike = {name: row[name] for name in ALIKE}
    region = Region(
        object_indices=tuple(json.loads(row["objects"])),
        component_indices=tuple(json.loads(row["components"])),
        box_xyxy=(x, y, x + width, y + height) if width else None,
        **alike | {"inspect": bool(row["inspect"])},
    )
    return StoredRegion(
        id=row["id"],
        number=row["number"],
        region=region,
        labels=row["labels"] or "",
        verdict=row["verdict"],
        audited_by=row["annotator"],
        verdict_reason=row["verdict_reason"] or "",
        comment=row["comment"] or "",
    )
