"""Whether a database is intact: SQLite's own checks, and the image files it names."""

from __future__ import annotations

from pathlib import Path

from reviewer.errors import Damaged
from reviewer.store.database import Store


def require_whole(store: Store) -> None:
    """Look through the whole file for damaged pages: about two seconds a gigabyte.

    Raises:
        Damaged: when there is one.
    """
    found = store.read().execute("PRAGMA quick_check(1)").fetchone()[0]
    if found != "ok":
        place = " ".join(found.replace("*** in database main ***", "").split())
        raise Damaged(f"database {store.path}: is damaged ({place}); restore it from a backup")


def damage(store: Store) -> list[str]:
    """Return what is wrong with the file: damaged pages, rows that point nowhere."""
    db = store.read()
    try:
        pages = [row[0] for row in db.execute("PRAGMA integrity_check") if row[0] != "ok"]
        lost = [
            f"a row of {row['table']} points to a row of {row['parent']} that is not there"
            for row in db.execute("PRAGMA foreign_key_check")
        ]
    except Damaged as error:
        return [str(error)]
    return [*(["is damaged; restore it from a backup"] if pages else []), *pages, *lost]


def list_image_files(store: Store) -> list[tuple[Path, str]]:
    """Return every image file with the hash it was imported with."""
    rows = store.read().execute("SELECT path, sha256 FROM images ORDER BY path")
    return [(store.folder / row["path"], row["sha256"]) for row in rows]
