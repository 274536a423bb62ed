"""Bring the terms of a run up to date, and read them. Masks are decoded here and never later.

Reading writes nothing: outcomes that are out of date are computed for one answer (`f_by_outcome`)
or kept in memory (`Unsaved`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from reviewer.evaluation.terms import (
    ObjectTerms,
    PairTerms,
    pair_terms,
    region_counts,
    scored_pixels,
)
from reviewer.evaluation.whatif import WhatIf
from reviewer.masks import Crop, Mask, Rle, components, crop_of_rle, decode_rle, merge_rles
from reviewer.metrics import Counts, f_score
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.layers import load_alignment, load_detection, load_objects
from reviewer.store.regions import load_regions
from reviewer.store.terms import (
    StaleTerms,
    load_terms,
    region_outcomes,
    save_terms,
    stale_terms,
)
from reviewer.store.truth import truth_of_pair

BATCH = 64
Outcomes = dict[int, dict[str, Counts]]
"""What each outcome of a region would give, by region id and outcome."""
Made = tuple[StaleTerms, int, str, Outcomes]


@dataclass(frozen=True, slots=True)
class RunTerms:
    """A run prepared for other rules: the pairs in the order of their terms, and the engine."""

    pair_ids: tuple[int, ...]
    whatif: WhatIf


def refresh_terms(
    store: Store,
    run: Run,
    progress: Callable[[int, int], None] = lambda done, total: None,
    pair_id: int | None = None,
) -> int:
    """Make the terms again whose truth or masks have changed (of one pair, or all); return how
    many."""
    stale = stale_terms(store, run.id, pair_id)
    for start in range(0, len(stale), BATCH):
        batch = stale[start : start + BATCH]
        save_terms(store, run.id, [_make(store, run, pair) for pair in batch])
        progress(start + len(batch), len(stale))
    return len(stale)


def run_terms(store: Store, run: Run, only: Collection[int] | None = None) -> RunTerms:
    """Return the terms of a run that are up to date (`refresh_terms` first).

    Args:
        only: keys of the pairs that are wanted; all where None.
    """
    found = [t for t in load_terms(store, run.id) if only is None or t.pair_id in only]
    pairs = [(stored.split, _unpacked(stored.truth_px, stored.terms)) for stored in found]
    return RunTerms(tuple(stored.pair_id for stored in found), WhatIf(pairs))


def f_by_outcome(
    store: Store, run: Run, pair_id: int, outcomes: Mapping[int, str], now: Counts
) -> dict[int, dict[str, float | None]]:
    """Return F of a pair if one region ended otherwise and all else stayed, by region and outcome;
    None where truth and mask would both be empty. Nothing is written.

    Args:
        outcomes: what happens to each region now, by id.
        now: counts of the pair's mask now.
    """
    if stale_terms(store, run.id, pair_id):
        known = _Masks.load(store, run, pair_id).outcomes(store, run)
    else:
        known = region_outcomes(store, run.id, pair_id)
    found: dict[int, dict[str, float | None]] = {}
    for region_id, counts in known.items():
        own = counts.get(outcomes.get(region_id, ""))
        if own is None:
            continue
        found[region_id] = {
            outcome: _f_or_none(
                Counts(
                    now.tp + other.tp - own.tp,
                    now.fp + other.fp - own.fp,
                    now.fn + other.fn - own.fn,
                )
            )
            for outcome, other in counts.items()
        }
    return found


def _f_or_none(counts: Counts) -> float | None:
    return None if counts.rightly_empty else f_score(counts)


class Unsaved:
    """Outcomes that the store lacks or has of another revision, each made once, in memory only.

    Threads may share it: two that ask at once make the same thing twice.
    """

    def __init__(self, store: Store) -> None:
        """Read from this store, and write nothing to it."""
        self._store = store
        self._made: dict[int, dict[StaleTerms, Outcomes]] = {}

    def of_run(self, run: Run) -> Outcomes:
        """Return the outcomes of all pairs of a run whose stored ones are out of date."""
        known = self._made.get(run.id, {})
        made = {
            pair: known[pair]
            if pair in known
            else _Masks.load(self._store, run, pair.pair_id).outcomes(self._store, run)
            for pair in stale_terms(self._store, run.id)
        }
        self._made[run.id] = made
        return {region_id: each for one in made.values() for region_id, each in one.items()}


@dataclass(frozen=True, slots=True)
class _Masks:
    """The decoded masks of an integrated pair with a truth."""

    pair_id: int
    change: Mask
    truth: Mask
    ignore: Mask | None
    valid: Mask | None
    live: list[Crop | None]
    past: list[Rle]

    @classmethod
    def load(cls, store: Store, run: Run, pair_id: int) -> _Masks:
        detection = load_detection(store, run.id, pair_id)
        revision = truth_of_pair(store, pair_id)
        assert detection is not None and revision is not None, "an integrated pair with a truth"
        objects = load_objects(store, run.id, pair_id)
        alignment = load_alignment(store, run.id, pair_id)
        return cls(
            pair_id,
            decode_rle(detection.mask),
            decode_rle(revision.mask),
            revision.ignore(),
            decode_rle(alignment.valid) if alignment else None,
            [crop_of_rle(thing.mask) for thing in objects if thing.side == "live"],
            [thing.mask for thing in objects if thing.side == "reference"],
        )

    def outcomes(self, store: Store, run: Run) -> Outcomes:
        right, wrong = scored_pixels(self.truth, self.ignore, self.valid)
        _, parts = components(self.change)
        return {
            stored.id: region_counts(stored.region, self.live, parts, right, wrong)
            for stored in load_regions(store, run.id, self.pair_id)
        }


def _make(store: Store, run: Run, pair: StaleTerms) -> Made:
    masks = _Masks.load(store, run, pair.pair_id)
    height, width = masks.change.shape
    past = merge_rles(masks.past, height, width)
    terms = pair_terms(masks.change, masks.live, past, masks.valid, masks.truth, masks.ignore)
    return pair, terms.truth_px, _packed(terms), masks.outcomes(store, run)


def _packed(terms: PairTerms) -> str:
    image = terms.image
    return json.dumps(
        {
            "components": terms.components,
            "objects": [[o.iou, o.overlap_px, o.components] for o in terms.objects],
            "atoms": terms.atoms,
            "image": image and [image.iou, image.overlap_px, image.components],
        },
        separators=(",", ":"),
    )


def _unpacked(truth_px: int, text: str) -> PairTerms:
    record = json.loads(text)
    image = record["image"]
    return PairTerms(
        truth_px,
        tuple((tp, fp) for tp, fp in record["components"]),
        tuple(_object(*values) for values in record["objects"]),
        tuple((tuple(members), tp, fp) for members, tp, fp in record["atoms"]),
        _object(*image) if image else None,
    )


def _object(iou: float, overlap_px: int, parts: list[int]) -> ObjectTerms:
    return ObjectTerms(iou, overlap_px, tuple(parts))
