"""Scores of two runs over the pixels that both have seen.

What a run has not seen is in none of its counts, so a run that sees less is charged for less. Two
runs are held against each other where both can be judged: pairs of which they have seen the same
keep their stored counts, the others are counted anew. Called by `comparing`.
"""

from __future__ import annotations

from dataclasses import replace

from reviewer.masks import Mask, Rle, decode_rle
from reviewer.metrics import count
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.scores import MaskPair, PairScore, mask_pair, pair_scores
from reviewer.words import Method


def scores_seen_by_both(
    store: Store, first: Run, second: Run, method: Method
) -> tuple[list[PairScore], list[PairScore]]:
    """Return the fresh counts of the pairs that both runs have, over what both have seen."""
    ours, theirs = (
        {score.pair_id: score for score in pair_scores(store, run.name) if score.method == method}
        for run in (first, second)
    )
    found: tuple[list[PairScore], list[PairScore]] = ([], [])
    for pair_id in sorted(ours.keys() & theirs.keys()):
        masks = [mask_pair(store, run.id, pair_id, method) for run in (first, second)]
        seen = [mask.valid for mask in masks]
        anew = None if seen[0] == seen[1] else _both(*seen)
        for scores, own, mask in zip(found, (ours, theirs), masks, strict=True):
            score = own[pair_id]
            scores.append(score if anew is None else _counted(score, mask, anew))
    return found


def _both(first: Rle | None, second: Rle | None) -> Mask:
    if first is not None and second is not None:
        return decode_rle(first) & decode_rle(second)
    known = first or second
    assert known is not None, "two runs without an alignment have seen the same"
    return decode_rle(known)


def _counted(score: PairScore, mask: MaskPair, valid: Mask) -> PairScore:
    ignore = decode_rle(mask.ignore) if mask.ignore else None
    counts = count(decode_rle(mask.prediction), decode_rle(mask.truth), ignore, valid)
    return replace(score, counts=counts)
