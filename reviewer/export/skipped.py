"""Leave out of an export what people skipped, and keep in its record which pairs that were."""

from __future__ import annotations

from dataclasses import replace

from reviewer.export.selection import Selection
from reviewer.store.database import Store
from reviewer.store.skips import list_skips


def leave_out_skipped(store: Store, selection: Selection) -> Selection:
    """Return the selection without the pairs of its splits that are skipped."""
    skips = list_skips(store, selection.splits)
    return replace(selection, skipped=tuple(skip.title for skip in skips))
