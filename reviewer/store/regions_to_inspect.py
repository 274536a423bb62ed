"""Regions of a run that ask the robot to look again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.store.database import Store
from reviewer.store.skips import NOT_SKIPPED


@dataclass(frozen=True, slots=True)
class InspectRegion:
    """A region whose DoI is at or above the threshold; box (x, y, width, height) in pixels of the
    live image."""

    id: int
    pair_id: int
    split: str
    pair: str
    labels: str
    doi: float
    box_xywh: tuple[int, int, int, int]


def inspect_regions(store: Store, run_id: int, splits: Sequence[str] = ()) -> list[InspectRegion]:
    """Return the regions of a run that are flagged `inspect` and on which nobody gave a verdict;
    those of skipped pairs are left out."""
    marks = ", ".join("?" * len(splits))
    only = f" AND d.split IN ({marks})" if splits else ""
    rows = store.read().execute(
        "SELECT g.*, d.split, d.pair, coalesce(d.labels, '') AS labels FROM regions g"
        " JOIN doi_decisions d ON d.region_id = g.id"
        " WHERE g.run_id = ? AND g.inspect AND d.verdict IS NULL AND g.box_width > 0"
        f" AND g.{NOT_SKIPPED}{only}"
        " ORDER BY d.split, d.pair, g.number",
        [run_id, *splits],
    )
    return [
        InspectRegion(
            row["id"],
            row["pair_id"],
            row["split"],
            row["pair"],
            row["labels"],
            row["doi"],
            (row["box_x"], row["box_y"], row["box_width"], row["box_height"]),
        )
        for row in rows
    ]
