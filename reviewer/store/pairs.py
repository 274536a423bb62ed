"""Splits, images, pairs and maps: what the importer writes and everybody reads."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from reviewer.errors import InvalidInput, NotFound
from reviewer.geometry import Grid, Pose2
from reviewer.masks import Rle
from reviewer.records import Image, OccupancyMap, Pair, Split
from reviewer.store.database import Store, require, utc_now
from reviewer.store.revisions import NewRevision, insert_revision


@dataclass(frozen=True, slots=True)
class NewImage:
    """An image to import; `path` is relative to the database's folder."""

    session: str
    name: str
    path: str
    sha256: str
    height: int
    width: int
    stamp: float | None
    pose: Pose2 | None


@dataclass(frozen=True, slots=True)
class NewPair:
    """A pair to import, by the names of its images, with its ground truth where there is one, and
    the pixels of it that are not to be scored."""

    name: str
    reference: str
    live: str
    viewpoint_distance: float | None
    truth: Rle | None
    ignore: Rle | None = None


@dataclass(frozen=True, slots=True)
class NewMap:
    """An occupancy grid to import; `path` is relative to the database's folder."""

    path: str
    sha256: str
    grid: Grid


def add_split(
    store: Store,
    name: str,
    layout: str,
    images: Sequence[NewImage],
    pairs: Sequence[NewPair],
    grid: NewMap | None = None,
) -> Split:
    """Write a split in one transaction: all of it or nothing.

    Raises:
        InvalidInput: when a split of that name exists.
    """

    def work(db: sqlite3.Connection) -> int:
        if db.execute("SELECT 1 FROM splits WHERE name = ?", [name]).fetchone():
            raise InvalidInput(f"split {name}: exists already; choose another name with --split")
        map_id = _add_map(db, grid) if grid else None
        workspace, group = parse_split_name(name)
        split_id = db.execute(
            "INSERT INTO splits (name, workspace, object_group, layout, map_id, imported_at)"
            " VALUES (?, ?, ?, ?, ?, ?)",
            [name, workspace, group, layout, map_id, utc_now()],
        ).lastrowid
        assert split_id is not None
        ids = _add_images(db, split_id, images)
        for pair in pairs:
            pair_id = db.execute(
                "INSERT INTO pairs (split_id, name, reference_id, live_id, viewpoint_distance)"
                " VALUES (?, ?, ?, ?, ?)",
                [
                    split_id,
                    pair.name,
                    ids["reference", pair.reference],
                    ids["live", pair.live],
                    pair.viewpoint_distance,
                ],
            ).lastrowid
            assert pair_id is not None
            if pair.truth is not None:
                insert_revision(db, NewRevision(pair_id, pair.truth, 0, pair.ignore))
        return split_id

    return split_of_id(store, store.write(work))


def parse_split_name(name: str) -> tuple[str | None, int | None]:
    """Read workspace and object group from names such as "cs1"; (None, None) otherwise."""
    match = re.fullmatch(r"([a-z]+)([0-9])", name)
    return (match[1], int(match[2])) if match else (None, None)


def _add_map(db: sqlite3.Connection, new: NewMap) -> int:
    row = db.execute("SELECT id FROM maps WHERE path = ?", [new.path]).fetchone()
    if row:
        return int(row["id"])
    grid = new.grid
    key = db.execute(
        "INSERT INTO maps (path, sha256, resolution, height, width,"
        " origin_x, origin_y, origin_theta) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        [
            new.path,
            new.sha256,
            grid.resolution,
            grid.height,
            grid.width,
            grid.origin.x,
            grid.origin.y,
            grid.origin.theta,
        ],
    ).lastrowid
    assert key is not None
    return key


def _add_images(
    db: sqlite3.Connection, split_id: int, images: Iterable[NewImage]
) -> dict[tuple[str, str], int]:
    ids = {}
    for image in images:
        pose = image.pose
        key = db.execute(
            "INSERT INTO images (split_id, session, name, path, sha256, height, width, stamp,"
            " x, y, theta) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [
                split_id,
                image.session,
                image.name,
                image.path,
                image.sha256,
                image.height,
                image.width,
                image.stamp,
                pose.x if pose else None,
                pose.y if pose else None,
                pose.theta if pose else None,
            ],
        ).lastrowid
        assert key is not None
        ids[image.session, image.name] = key
    return ids


def list_splits(store: Store) -> list[Split]:
    """Return all splits by name."""
    return [_split(row) for row in store.read().execute("SELECT * FROM splits ORDER BY name")]


def split_of_id(store: Store, split_id: int) -> Split:
    """Return one split."""
    row = store.read().execute("SELECT * FROM splits WHERE id = ?", [split_id]).fetchone()
    return _split(require(row, f"split {split_id}: does not exist"))


def _split(row: sqlite3.Row) -> Split:
    return Split(row["id"], row["name"], row["workspace"], row["object_group"], row["map_id"])


def list_maps(store: Store) -> list[OccupancyMap]:
    """Return the occupancy grids, paths absolute."""
    return [
        OccupancyMap(
            row["id"],
            store.folder / row["path"],
            Grid(
                row["resolution"],
                row["height"],
                row["width"],
                Pose2(row["origin_x"], row["origin_y"], row["origin_theta"]),
            ),
        )
        for row in store.read().execute("SELECT * FROM maps ORDER BY id")
    ]


PAIR_SELECT = """
SELECT p.id, s.name AS split, p.name, p.viewpoint_distance,
    r.id AS r_id, r.name AS r_name, r.path AS r_path, r.sha256 AS r_sha256, r.height AS r_height,
    r.width AS r_width, r.x AS r_x, r.y AS r_y, r.theta AS r_theta,
    l.id AS l_id, l.name AS l_name, l.path AS l_path, l.sha256 AS l_sha256, l.height AS l_height,
    l.width AS l_width, l.x AS l_x, l.y AS l_y, l.theta AS l_theta
FROM pairs p JOIN splits s ON s.id = p.split_id
JOIN images r ON r.id = p.reference_id JOIN images l ON l.id = p.live_id
"""


def list_pairs(store: Store, splits: Sequence[str] = ()) -> list[Pair]:
    """Return pairs by split and name; of all splits when none are named.

    Raises:
        NotFound: when a named split does not exist.
    """
    where, values = _in_splits(store, splits)
    rows = store.read().execute(f"{PAIR_SELECT} {where} ORDER BY s.name, p.name", values)
    return [_pair(store, row) for row in rows]


def _in_splits(store: Store, splits: Sequence[str]) -> tuple[str, list[str]]:
    known = {split.name for split in list_splits(store)}
    for name in splits:
        if name not in known:
            raise NotFound(f"split {name}: does not exist; there are {', '.join(sorted(known))}")
    marks = ", ".join("?" * len(splits))
    return (f"WHERE s.name IN ({marks})" if splits else ""), list(splits)


def pair_ids(store: Store, splits: Sequence[str] = ()) -> list[int]:
    """Return the ids of pairs by split and name; of all splits when none are named.

    Raises:
        NotFound: when a named split does not exist.
    """
    where, values = _in_splits(store, splits)
    rows = store.read().execute(
        "SELECT p.id FROM pairs p JOIN splits s ON s.id = p.split_id"
        f" {where} ORDER BY s.name, p.name",
        values,
    )
    return [row["id"] for row in rows]


def pairs_of_ids(store: Store, ids: Sequence[int]) -> list[Pair]:
    """Return pairs in the order of their ids given."""
    rows = store.read().execute(
        f"{PAIR_SELECT} WHERE p.id IN (SELECT value FROM json_each(?))", [json.dumps(list(ids))]
    )
    found = {row["id"]: _pair(store, row) for row in rows}
    return [found[pair_id] for pair_id in ids]


def pair_of_id(store: Store, pair_id: int) -> Pair:
    """Return one pair.

    Raises:
        NotFound: when there is none of that id.
    """
    row = store.read().execute(f"{PAIR_SELECT} WHERE p.id = ?", [pair_id]).fetchone()
    return _pair(store, require(row, f"pair {pair_id}: does not exist"))


def _pair(store: Store, row: sqlite3.Row) -> Pair:
    return Pair(
        row["id"],
        row["split"],
        row["name"],
        _image(store.folder, row, "r_"),
        _image(store.folder, row, "l_"),
        row["viewpoint_distance"],
    )


def _image(folder: Path, row: sqlite3.Row, prefix: str) -> Image:
    x = row[prefix + "x"]
    pose = None if x is None else Pose2(x, row[prefix + "y"], row[prefix + "theta"])
    return Image(
        row[prefix + "id"],
        row[prefix + "name"],
        folder / row[prefix + "path"],
        row[prefix + "sha256"],
        row[prefix + "height"],
        row[prefix + "width"],
        pose,
    )
