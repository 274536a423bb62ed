"""Bring the stored pixel counts up to date; all scores are arithmetic on these integers."""

from __future__ import annotations

from collections.abc import Callable

from reviewer.masks import decode_rle
from reviewer.metrics import count
from reviewer.store.database import Store
from reviewer.store.scores import save_scores, stale_scores

BATCH = 256


def refresh_counts(
    store: Store,
    pair_id: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> int:
    """Count again what changed since the last time (one pair, or all); return how many."""
    stale = stale_scores(store, pair_id)
    for start in range(0, len(stale), BATCH):
        batch = stale[start : start + BATCH]
        counted = [
            (
                item,
                count(
                    decode_rle(item.prediction),
                    decode_rle(item.truth),
                    decode_rle(item.ignore) if item.ignore else None,
                ),
            )
            for item in batch
        ]
        save_scores(store, counted)
        progress(start + len(batch), len(stale))
    return len(stale)
