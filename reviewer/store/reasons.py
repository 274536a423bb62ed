"""The reasons that the workbench offers with a verdict; verdicts keep the words they took."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence

from reviewer.errors import InvalidInput
from reviewer.store.database import Store

MOST = 40
LONGEST = 80


def list_reasons(store: Store) -> list[str]:
    """Return the reasons in their order."""
    rows = store.read().execute("SELECT reason FROM audit_reasons ORDER BY number")
    return [row["reason"] for row in rows]


def set_reasons(store: Store, reasons: Sequence[str]) -> None:
    """Put another list in place of the old one.

    Raises:
        InvalidInput: when a reason is blank, too long or there twice, or there are too many.
    """
    texts = [" ".join(reason.split()) for reason in reasons]
    if len(texts) > MOST:
        raise InvalidInput(f"reasons: at most {MOST}, not {len(texts)}")
    for place, text in enumerate(texts, start=1):
        if not 1 <= len(text) <= LONGEST:
            raise InvalidInput(
                f"reasons, line {place}: must have 1 to {LONGEST} characters, but has {len(text)}"
            )
        if text in texts[: place - 1]:
            raise InvalidInput(f"reasons, line {place}: {text!r} is there twice")

    def work(db: sqlite3.Connection) -> None:
        db.execute("DELETE FROM audit_reasons")
        db.executemany("INSERT INTO audit_reasons VALUES (?, ?)", list(enumerate(texts)))

    store.write(work)
