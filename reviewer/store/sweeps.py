"""Which tiles of a pair a person has looked at from close by.

A picture is cut into the same tiles for everybody, whatever the window: at least four across, more
for large ones. Tiles count row by row from the top left.
"""

from __future__ import annotations

import math
import sqlite3
from dataclasses import dataclass

from reviewer.errors import InvalidInput
from reviewer.records import Pair
from reviewer.store.database import Store, utc_now

TILE_PX = 320
FEWEST_ACROSS, MOST_ACROSS = 4, 8


@dataclass(frozen=True, slots=True)
class Sweep:
    """The tiles of a picture, and the numbers of those that a person has swept."""

    columns: int
    rows: int
    swept: tuple[int, ...]


def grid_of(height: int, width: int) -> tuple[int, int]:
    """Return how many tiles a picture has across and down; they are about square."""
    columns = min(max(math.ceil(width / TILE_PX), FEWEST_ACROSS), MOST_ACROSS)
    return columns, max(1, round(columns * height / width))


def sweep_of_pair(store: Store, pair: Pair, annotator_id: int) -> Sweep:
    """Return what a person has swept of a pair."""
    columns, rows = grid_of(pair.live.height, pair.live.width)
    found = store.read().execute(
        "SELECT tile FROM sweeps WHERE pair_id = ? AND annotator_id = ? AND columns = ?"
        " AND rows = ? ORDER BY tile",
        [pair.id, annotator_id, columns, rows],
    )
    return Sweep(columns, rows, tuple(int(row["tile"]) for row in found))


def note_swept(store: Store, pair: Pair, annotator_id: int, tile: int) -> Sweep:
    """Record that a person has swept a tile; a second time changes nothing.

    Raises:
        InvalidInput: when the picture has no such tile.
    """
    columns, rows = grid_of(pair.live.height, pair.live.width)
    if not 0 <= tile < columns * rows:
        raise InvalidInput(
            f"pair {pair.title}: tile {tile}: it has {columns * rows} tiles, counted from 0"
        )

    def work(db: sqlite3.Connection) -> None:
        values = [pair.id, annotator_id, columns, rows, tile, utc_now()]
        db.execute("INSERT OR IGNORE INTO sweeps VALUES (?, ?, ?, ?, ?, ?)", values)

    store.write(work)
    return sweep_of_pair(store, pair, annotator_id)
