"""Import a split, or all the splits of a folder."""

from __future__ import annotations

from pathlib import Path

from reviewer.dataset.importer import ImportReport, import_split
from reviewer.dataset.layouts import find_splits
from reviewer.dataset.settings import ImportSettings
from reviewer.errors import InvalidInput
from reviewer.flows.listening import NOBODY, Listener
from reviewer.store.database import Store


def import_splits(
    store: Store,
    folder: Path,
    settings: ImportSettings,
    split: str | None = None,
    *,
    dry_run: bool = False,
    listener: Listener = NOBODY,
) -> list[ImportReport]:
    """Import the splits of a folder, each whole or not at all; return a report for each.

    Args:
        split: name for the one split that the folder is; else its folder's.
        dry_run: read and check everything, write nothing.

    Raises:
        InvalidInput: for any bad file, and for one name for several splits.
    """
    found = find_splits(folder, settings.layout)
    if split is not None and len(found) > 1:
        raise InvalidInput(f"--split {split}: {folder} holds {len(found)} splits, name one folder")
    with listener.progress("import") as advance:
        return [
            import_split(
                store,
                split or name,
                place,
                settings,
                lambda what, done, total: advance(done, total, what),
                dry_run=dry_run,
            )
            for name, place in found
        ]
