"""Bring the stored pixel counts up to date; all scores are arithmetic on these integers."""

from __future__ import annotations

from collections.abc import Callable

from reviewer.masks import decode_rle
from reviewer.metrics import Counts, count, total
from reviewer.store.database import Store
from reviewer.store.scores import pair_scores, save_scores, stale_scores

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
                    *(decode_rle(mask) if mask else None for mask in (item.ignore, item.valid)),
                ),
            )
            for item in batch
        ]
        save_scores(store, counted)
        progress(start + len(batch), len(stale))
    return len(stale)


def detector_counts(store: Store, run: str) -> Counts:
    """Return the counts of a run's detector, all pairs together: they tell what a run has not
    seen, which is the same for all of its masks."""
    return total(score.counts for score in pair_scores(store, run) if score.method == "base")
