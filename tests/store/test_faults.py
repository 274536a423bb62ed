"""A full disk, a file that cannot be written, a damaged page: each is told in a sentence."""

import os
import resource
import shutil
import sqlite3
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest

from reviewer.errors import Damaged, StorageFull, Unavailable
from reviewer.store.database import Store
from reviewer.store.integrity import require_whole
from reviewer.store.reasons import list_reasons, set_reasons

WORDS = [f"{k} " + "x" * 70 for k in range(40)]


@contextmanager
def plain_person():
    """Do something as a person whom read-only files keep out, which root is not."""
    before = os.geteuid()
    if before == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(before)


@pytest.fixture
def open_folder():
    """A folder that everybody may enter."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o777)
    yield folder
    folder.chmod(0o777)
    shutil.rmtree(folder)


def fill(connection):
    """Let the file grow no further."""
    pages = connection.execute("PRAGMA page_count").fetchone()[0]
    connection.execute(f"PRAGMA max_page_count = {pages}")


def damage(path, at=0.5):
    """Write nonsense over the pages in the middle of a database."""
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    connection.close()
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.seek(int(size * at) // 4096 * 4096)
        file.write(b"\xa5" * 4096 * 8)


def test_a_full_disk_is_told_and_nothing_of_the_change_stays(db):
    db.write(fill)
    before = list_reasons(db)
    with pytest.raises(StorageFull, match=rf"{db.path}: .*full.*make room") as caught:
        db.write(lambda c: c.execute("CREATE TABLE big AS SELECT zeroblob(1000000) AS b"))
    assert caught.value.status == 507
    db.write(lambda c: c.execute("PRAGMA max_page_count = 1000000"))
    set_reasons(db, ["room again"])
    assert list_reasons(db) == ["room again"] != before


def test_a_file_that_cannot_be_written_is_told_and_can_be_read(open_folder):
    path = open_folder / "reviewer.db"
    Store(path, create=True).close()
    path.chmod(0o444)
    with plain_person(), Store(path) as store:
        assert list_reasons(store)
        with pytest.raises(Unavailable, match=rf"{path}: .*read-only") as caught:
            set_reasons(store, ["more"])
    assert caught.value.status == 503


def test_a_folder_that_cannot_be_written_is_told(open_folder):
    path = open_folder / "reviewer.db"
    Store(path, create=True).close()
    open_folder.chmod(0o555)
    path.chmod(0o444)
    with plain_person(), pytest.raises(Unavailable, match=rf"{path}: .*folder"):
        Store(path)


def test_an_error_of_the_disk_is_told(db):
    set_reasons(db, ["a first page of the journal"])
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, limits[1]))
    try:
        with pytest.raises(Unavailable, match=rf"{db.path}: .*disk") as caught:
            set_reasons(db, WORDS)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert caught.value.status == 503
    set_reasons(db, ["better"])
    assert list_reasons(db) == ["better"]


def test_a_database_that_another_program_holds_is_told(db, monkeypatch):
    db.write(lambda c: c.execute("SELECT 1"))
    other = sqlite3.connect(db.path)
    other.execute("BEGIN IMMEDIATE")
    monkeypatch.setattr("reviewer.store.database.BUSY_SECONDS", 0.05)
    with Store(db.path) as store, pytest.raises(Unavailable, match="another program"):
        set_reasons(store, ["more"])
    other.close()


def test_a_damaged_page_is_told_with_the_way_out(db, tiny_split):
    path = db.path
    people = [(f"{k} " + "x" * 70,) for k in range(4000)]
    db.write(lambda c: c.executemany("INSERT INTO annotators VALUES (NULL, ?, 'now')", people))
    require_whole(db)
    db.close()
    damage(path)
    with Store(path) as store, pytest.raises(Damaged, match=rf"{path}: .*restore .*backup"):
        require_whole(store)


def test_reading_a_damaged_page_is_told_too(db, tiny_split):
    path = db.path
    db.close()
    damage(path, at=0.05)
    with pytest.raises(Damaged, match=rf"{path}: .*restore .*backup"), Store(path) as store:
        for table in ("annotators", "mask_revisions", "pairs", "images", "splits"):
            store.read().execute(f"SELECT * FROM {table}").fetchall()


def test_what_is_the_callers_own_mistake_stays_what_it_is(db):
    with pytest.raises(sqlite3.OperationalError, match="no such table"):
        db.read().execute("SELECT * FROM nowhere")
    with pytest.raises(sqlite3.IntegrityError, match="NOT NULL"):
        db.write(lambda c: c.execute("INSERT INTO annotators (created_at) VALUES ('now')"))
