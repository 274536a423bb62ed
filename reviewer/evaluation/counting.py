"""Bring the stored pixel counts up to date; all scores are arithmetic on these integers."""

from __future__ import annotations

from collections.abc import Callable

from reviewer.masks import decode_rle
from reviewer.metrics import Counts, count, total
from reviewer.store.database import Store
from reviewer.store.scores import (
    MaskPair,
    StaleScore,
    pair_counts,
    pair_scores,
    save_scores,
    stale_scores,
)
from reviewer.words import Method

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
        save_scores(store, [(item, counts_of_masks(item)) for item in batch])
        progress(start + len(batch), len(stale))
    return len(stale)


def counts_of_pair(store: Store, run_id: int, pair_id: int) -> dict[Method, Counts]:
    """Return the counts of one pair by method, made for this answer where none are kept that are up
    to date. Nothing is written."""
    stale = [item for item in stale_scores(store, pair_id) if item.run_id == run_id]
    return pair_counts(store, run_id, pair_id) | {
        item.method: counts_of_masks(item) for item in stale
    }


def counts_of_masks(item: StaleScore | MaskPair) -> Counts:
    """Return the counts of a prediction against its ground truth, over what is scored."""
    left_out = (decode_rle(mask) if mask else None for mask in (item.ignore, item.valid))
    return count(decode_rle(item.prediction), decode_rle(item.truth), *left_out)


def detector_counts(store: Store, run: str) -> Counts:
    """Return the counts of a run's detector, all pairs together: they tell what a run has not
    seen, which is the same for all of its masks."""
    return total(score.counts for score in pair_scores(store, run) if score.method == "base")
