"""What goes wrong with the file of a database, told in a sentence: full, read-only, damaged, held.

Connections translate SQLite's result codes themselves, at this one place, so that no caller above
the store meets an `sqlite3.Error` but for a mistake in its own SQL.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

from reviewer.errors import Damaged, ReviewerError, StorageFull, Unavailable

Result = TypeVar("Result")

WAYS_OUT: dict[int, tuple[type[ReviewerError], str]] = {
    sqlite3.SQLITE_FULL: (StorageFull, "the disk is full; make room, then do the same again"),
    sqlite3.SQLITE_READONLY: (
        Unavailable,
        "is read-only here; let this user write the file and its folder",
    ),
    sqlite3.SQLITE_CANTOPEN: (
        Unavailable,
        "cannot be opened; let this user read and write the file and its folder",
    ),
    sqlite3.SQLITE_PERM: (Unavailable, "may not be opened by this user"),
    sqlite3.SQLITE_IOERR: (
        Unavailable,
        "the disk does not read or write it; look at the disk and the network, then do the same"
        " again",
    ),
    sqlite3.SQLITE_BUSY: (Unavailable, "another program is writing to it; do the same again later"),
    sqlite3.SQLITE_LOCKED: (Unavailable, "another program holds it; do the same again later"),
    sqlite3.SQLITE_CORRUPT: (Damaged, "is damaged; restore it from a backup"),
    sqlite3.SQLITE_NOTADB: (
        Damaged,
        "is not a database, or its beginning is damaged: then restore it from a backup",
    ),
}
"""Error and way out by SQLite's primary result code."""


def fault_of(error: sqlite3.Error, path: Path) -> ReviewerError | None:
    """Return the error that tells what is wrong with a file; None when it is not the file."""
    code = getattr(error, "sqlite_errorcode", 0) & 0xFF
    if code not in WAYS_OUT:
        return None
    kind, way_out = WAYS_OUT[code]
    return kind(f"database {path}: {way_out} ({error})")


class TellingConnection(sqlite3.Connection):
    """A connection that raises errors of its file as `fault_of` tells them.

    Attributes:
        path: the file, for messages.
        writes: whether it was opened to write; a reader that tries to is its caller's mistake.
    """

    path: Path
    writes: bool

    def cursor(self, factory: Any = None) -> Any:
        """Return a cursor that tells errors, too."""
        return super().cursor(_TellingCursor)

    def execute(self, sql: str, parameters: Any = (), /) -> Any:
        """Execute a statement in a cursor of its own."""
        return self.cursor().execute(sql, parameters)

    def executemany(self, sql: str, parameters: Iterable[Any], /) -> Any:
        """Execute a statement for each row in a cursor of its own."""
        return self.cursor().executemany(sql, parameters)

    def tell(self, work: Callable[..., Result], *given: Any) -> Result:
        """Do something with SQLite; its error comes as what is wrong with the file."""
        try:
            return work(*given)
        except sqlite3.Error as error:
            told = fault_of(error, self.path)
            reader_wrote = not self.writes and error.sqlite_errorcode == sqlite3.SQLITE_READONLY
            if told is None or reader_wrote:
                raise
            raise told from error


class _TellingCursor(sqlite3.Cursor):
    connection: TellingConnection

    def execute(self, sql: str, parameters: Any = (), /) -> _TellingCursor:
        self.connection.tell(super().execute, sql, parameters)
        return self

    def executemany(self, sql: str, parameters: Iterable[Any], /) -> _TellingCursor:
        self.connection.tell(super().executemany, sql, parameters)
        return self

    def fetchone(self) -> Any:
        return self.connection.tell(super().fetchone)

    def fetchall(self) -> list[Any]:
        return self.connection.tell(super().fetchall)

    def __next__(self) -> Any:
        return self.connection.tell(super().__next__)


def open_file(path: Path, *, writes: bool, patience: float) -> TellingConnection:
    """Open a database file; rows come as `sqlite3.Row`, transactions are the caller's.

    Args:
        patience: seconds to wait for another program that writes.

    Raises:
        Unavailable: when it cannot be opened.
    """
    mode = "rwc" if writes else "ro"
    try:
        connection = sqlite3.connect(
            f"{path.as_uri()}?mode={mode}",
            uri=True,
            timeout=patience,
            isolation_level=None,
            check_same_thread=False,  # the store closes the connections of other threads
            factory=TellingConnection,
        )
    except sqlite3.Error as error:
        raise fault_of(error, path) or error from error
    connection.path, connection.writes = path, writes
    connection.row_factory = sqlite3.Row
    return connection
