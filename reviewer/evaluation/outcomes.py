"""Bring the terms of a run up to date, and read them. Masks are decoded here and never later."""

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
from reviewer.masks import components, crop_of_rle, decode_rle, merge_rles
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
Made = tuple[StaleTerms, int, str, dict[int, dict[str, Counts]]]


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
    None where the pair would be rightly empty.

    Args:
        outcomes: what happens to each region now, by id.
        now: counts of the pair's mask now.
    """
    found: dict[int, dict[str, float | None]] = {}
    for region_id, counts in region_outcomes(store, run.id, pair_id).items():
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


def _make(store: Store, run: Run, pair: StaleTerms) -> Made:
    detection = load_detection(store, run.id, pair.pair_id)
    revision = truth_of_pair(store, pair.pair_id)
    assert detection is not None and revision is not None, "an integrated pair with a truth"
    change, truth = decode_rle(detection.mask), decode_rle(revision.mask)
    height, width = change.shape
    ignore = revision.ignore()
    alignment = load_alignment(store, run.id, pair.pair_id)
    objects = load_objects(store, run.id, pair.pair_id)
    live = [crop_of_rle(thing.mask) for thing in objects if thing.side == "live"]
    past = [thing.mask for thing in objects if thing.side == "reference"]
    valid = decode_rle(alignment.valid) if alignment else None
    terms = pair_terms(change, live, merge_rles(past, height, width), valid, truth, ignore)
    right, wrong = scored_pixels(truth, ignore)
    _, parts = components(change)
    regions = {
        stored.id: region_counts(stored.region, live, parts, right, wrong)
        for stored in load_regions(store, run.id, pair.pair_id)
    }
    return pair, terms.truth_px, _packed(terms), regions


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
