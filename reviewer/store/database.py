"""Open a database, read from it anywhere, write to it from one thread.

WAL keeps readers and the writer out of each other's way; `synchronous=FULL` makes an acknowledged
write survive a power cut. Reads use one connection a thread. Writes are functions handed to the
writer thread, each in its own `BEGIN IMMEDIATE` transaction (as Datasette does it), so that no
caller ever sees "database is locked" from its own process. Another process may write too: SQLite's
busy timeout queues them.
"""

from __future__ import annotations

import hashlib
import importlib.util
import queue
import sqlite3
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import sqlite_utils

from reviewer.errors import InvalidInput, NotFound
from reviewer.masks import Rle
from reviewer.shipped import shipped_folder
from reviewer.store.faults import open_file

Result = TypeVar("Result")
Work = Callable[[sqlite3.Connection], Result]

BUSY_SECONDS = 30.0


def utc_now() -> str:
    """Return the time as the store writes it."""
    return stamp(datetime.now(UTC))


def stamp(moment: datetime) -> str:
    """Return a moment in UTC as the store writes it: ISO 8601, milliseconds; it sorts by time."""
    return moment.isoformat(timespec="milliseconds")


class Store:
    """A database file with its writer thread; close it when done, or use `with`."""

    def __init__(self, path: Path, *, create: bool = False) -> None:
        """Open `path` and bring its schema up to date.

        Raises:
            NotFound: when the file does not exist and `create` is not set.
            InvalidInput: when the file is not a SQLite database, or a newer one than this code.
            Unavailable, StorageFull: when it cannot be opened or written.
        """
        self.path = path.resolve()
        if not create and not self.path.exists():
            raise NotFound(
                f"database {path}: does not exist; `reviewer import` or `reviewer demo` makes one"
            )
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._local = threading.local()
        self._readers: list[tuple[threading.Thread, sqlite3.Connection]] = []
        self._readers_lock = threading.Lock()
        try:
            self._migrate()
        except sqlite3.DatabaseError as error:
            raise InvalidInput(f"database {path}: {error}") from error
        self._tasks: queue.SimpleQueue[tuple[Work[Any], Future[Any]] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(
            target=self._write_loop,
            args=[self._connect_writer()],
            name="store-writer",
            daemon=True,
        )
        self._thread.start()

    @property
    def identity(self) -> str:
        """A short name of this database among others that one browser may meet."""
        return hashlib.sha256(str(self.path).encode()).hexdigest()[:12]

    @property
    def folder(self) -> Path:
        """The folder that relative image paths start from."""
        return self.path.parent

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Finish the writes that were handed in, then close every connection."""
        self._tasks.put(None)
        self._thread.join()
        with self._readers_lock:
            for _, connection in self._readers:
                connection.close()
            self._readers.clear()
        self._local = threading.local()

    def read(self) -> sqlite3.Connection:
        """Return this thread's read-only connection; rows come as `sqlite3.Row`."""
        connection: sqlite3.Connection | None = getattr(self._local, "connection", None)
        if connection is None:
            connection = open_file(self.path, writes=False, patience=BUSY_SECONDS)
            self._local.connection = connection
            self._keep(connection)
        return connection

    @contextmanager
    def snapshot(self) -> Iterator[None]:
        """Let all reads of this thread see the database as it is at the first of them."""
        connection = self.read()
        connection.execute("BEGIN")
        try:
            yield
        finally:
            connection.execute("COMMIT")

    def _keep(self, connection: sqlite3.Connection) -> None:
        """Note a reader, and close those whose threads have ended."""
        with self._readers_lock:
            for thread, old in self._readers:
                if not thread.is_alive():
                    old.close()
            alive = [entry for entry in self._readers if entry[0].is_alive()]
            self._readers = [*alive, (threading.current_thread(), connection)]

    def submit(self, work: Work[Result]) -> Future[Result]:
        """Hand a function to the writer; it runs in a transaction that ends with it."""
        if not self._thread.is_alive():
            raise RuntimeError("the store is closed")
        future: Future[Result] = Future()
        self._tasks.put((work, future))
        return future

    def write(self, work: Work[Result]) -> Result:
        """Run a function in the writer and wait; its exception comes back, nothing stays."""
        return self.submit(work).result()

    def _connect_writer(self) -> sqlite3.Connection:
        connection = open_file(self.path, writes=True, patience=BUSY_SECONDS)
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        return connection

    def _migrate(self) -> None:
        connection = self._connect_writer()
        try:
            migrations = load_migrations()
            database = sqlite_utils.Database(connection)
            known = {migration.name for migration in migrations._migrations}
            unknown = [m.name for m in migrations.applied(database) if m.name not in known]
            if unknown:
                raise InvalidInput(
                    f"database {self.path}: made by a newer version (migration {unknown[0]})"
                )
            if migrations.pending(database):
                migrations.apply(database)
        finally:
            connection.close()

    def _write_loop(self, connection: sqlite3.Connection) -> None:
        while (task := self._tasks.get()) is not None:
            work, future = task
            if not future.set_running_or_notify_cancel():
                continue
            try:
                connection.execute("BEGIN IMMEDIATE")
                result = work(connection)
                connection.execute("COMMIT")
            except BaseException as error:
                if connection.in_transaction:
                    connection.execute("ROLLBACK")
                future.set_exception(error)
            else:
                future.set_result(result)
        connection.close()


def load_migrations() -> Any:
    """Return the `sqlite_utils.Migrations` of `db/migrations.py`."""
    path = shipped_folder("db") / "migrations.py"
    spec = importlib.util.spec_from_file_location("reviewer_migrations", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.migrations


def mask_columns(rle: Rle) -> tuple[int, int, str, int, int, int, int, int]:
    """Return the eight columns every mask table has, in the schema's order."""
    return (rle.height, rle.width, rle.counts, rle.area, *rle.box_xywh)


def require(row: sqlite3.Row | None, message: str) -> sqlite3.Row:
    """Return the row, or raise `NotFound` with the message."""
    if row is None:
        raise NotFound(message)
    return row
