"""Proposals: every mask that somebody or something suggests for a pair, as one list.

Sources are DoI regions, components of M_o, objects found on both images, candidates that none of
these covers, the prediction of another run, and, once a person has drawn, where the person and the
prediction disagree. A proposal's key stays the same while its run does, so the tool logs of a
pair's revisions tell what became of it.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable
from threading import Lock

import cv2
import numpy as np

from reviewer.dataset.pictures import read_picture
from reviewer.editing.candidates import find_candidates
from reviewer.editing.ranking import Evidence, Proposal, rank
from reviewer.masks import (
    Mask,
    Rle,
    components,
    decode_rle,
    encode_crops,
    encode_rle,
    merge_rles,
)
from reviewer.pipeline.fields import change_of
from reviewer.pipeline.stored import live_runs, region_crops, warped_view
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import load_detection, load_objects
from reviewer.store.regions import load_final_mask, load_regions
from reviewer.store.revisions import list_actions, newest_revision
from reviewer.store.stages_done import pair_overview
from reviewer.words import ProposalSource

_Found = tuple[str, float | None, int | None, Rle]

LEAST_PX = 4
SLIVER_PX = 3
LARGEST_COVER = 0.25
COVERING: tuple[ProposalSource, ...] = ("region", "detector", "object_live", "object_reference")
MOST_KEPT = 64
FOUND_BEFORE: OrderedDict[tuple[object, ...], list[_Found]] = OrderedDict()
"""Candidates found last: they are looked for in the pixels, and a pair is opened more than once."""
ONE_AT_A_TIME = Lock()
DISAGREEMENTS: tuple[ProposalSource, ...] = ("missed", "extra")


def list_proposals(
    store: Store, pair: Pair, run: Run, sources: Iterable[ProposalSource]
) -> list[Proposal]:
    """Return the proposals of a run for a pair, the likeliest change first (see `ranking`).

    Disagreements come as they are, those of the prediction first, the largest first.

    Sources: "candidate" is what looks changed and no other source covers (see `candidates`);
    "prediction" are the components of the final mask; "missed" is what the prediction has
    and the ground truth has not, "extra" the other way round, both without slivers at the borders.
    """
    outcomes = outcomes_of(store, pair.id)
    found = []
    for source in sources:
        for number, (label, score, region_id, mask) in enumerate(_of(store, pair, run, source)):
            key = f"{run.id}/{source}/{number}"
            found.append(
                Proposal(
                    key, source, run.name, number, label, score, region_id, mask, outcomes.get(key)
                )
            )
    plain = [proposal for proposal in found if proposal.source in DISAGREEMENTS]
    others = [proposal for proposal in found if proposal.source not in DISAGREEMENTS]
    return [*rank(others, _evidence(store, pair, run)), *plain] if others else plain


def _evidence(store: Store, pair: Pair, run: Run) -> Evidence:
    shape = pair.live.height, pair.live.width
    final = load_final_mask(store, run.id, pair.id)
    detection = load_detection(store, run.id, pair.id)
    probability = np.zeros(shape, np.float32) if detection is None else change_of(detection)
    regions = load_regions(store, run.id, pair.id)
    return Evidence(
        np.zeros(shape, np.bool_) if final is None else decode_rle(final),
        probability,
        frozenset(r.id for r in regions if r.outcome == "adopt"),
        frozenset(r.id for r in regions if r.region.reason == "seen_in_reference"),
    )


def outcomes_of(store: Store, pair_id: int) -> dict[str, str]:
    """Return what people did with each proposal of a pair, from its revisions' tool logs."""
    outcomes: dict[str, list[str]] = {}
    for action in list_actions(store, pair_id):
        key, tool = action.get("proposal"), action.get("tool")
        keys = action.get("proposals") or [key]
        if not isinstance(tool, str) or not isinstance(keys, list):
            continue
        for each in keys:
            if not isinstance(each, str):
                continue
            done = outcomes.setdefault(each, [])
            if tool != "undo":
                done.append(str(action.get("of", tool)))
            elif done:
                done.pop()
    return {key: done[-1] for key, done in outcomes.items() if done}


def _of(store: Store, pair: Pair, run: Run, source: ProposalSource) -> list[_Found]:
    if source == "region":
        return _regions(store, pair, run)
    if source == "detector":
        detection = load_detection(store, run.id, pair.id)
        return [] if detection is None else _parts(decode_rle(detection.mask))
    if source in ("object_live", "object_reference"):
        side = source.removeprefix("object_")
        return [
            (thing.label, thing.score, None, thing.mask)
            for thing in load_objects(store, run.id, pair.id)
            if thing.side == side
        ]
    if source == "candidate":
        return _candidates(store, pair, run)
    final = load_final_mask(store, run.id, pair.id)
    if final is None:
        return []
    predicted = decode_rle(final)
    if source == "prediction":
        return _parts(predicted)
    newest = newest_revision(store, pair.id)
    truth = np.zeros_like(predicted) if newest is None else decode_rle(newest.mask)
    return _parts(only_in(predicted, truth) if source == "missed" else only_in(truth, predicted))


def _candidates(store: Store, pair: Pair, run: Run) -> list[_Found]:
    seen = pair_overview(store, run.id, pair.id)
    if not (seen.aligned and seen.integrated):
        return []
    key = (store.path, run.id, pair.id, seen.version)
    with ONE_AT_A_TIME:
        if key not in FOUND_BEFORE:
            FOUND_BEFORE[key] = _look_for_candidates(store, pair, run)
            while len(FOUND_BEFORE) > MOST_KEPT:
                FOUND_BEFORE.popitem(last=False)
        return FOUND_BEFORE[key]


def _look_for_candidates(store: Store, pair: Pair, run: Run) -> list[_Found]:
    warped, valid, confidence = warped_view(store, run, pair)
    sure = valid.astype(np.float32) if confidence is None else np.where(valid, confidence, 0)
    proposed = [mask for source in COVERING for _, _, _, mask in _of(store, pair, run, source)]
    # What fills much of the picture covers no small thing in it.
    small = [mask for mask in proposed if mask.area < LARGEST_COVER * valid.size]
    covered = merge_rles(small, *valid.shape)
    found = find_candidates(read_picture(pair.live), warped, np.asarray(sure, np.float32), covered)
    return [("", strength, None, encode_rle(mask)) for strength, mask in found]


def only_in(first: Mask, second: Mask) -> Mask:
    """Return what only the first mask has: whole components that the second does not touch, and
    parts that are more than a sliver along a border."""
    rest = first & ~second
    kernel = np.ones((SLIVER_PX, SLIVER_PX), np.uint8)
    result = np.asarray(cv2.morphologyEx(rest.view(np.uint8), cv2.MORPH_OPEN, kernel)).astype(bool)
    for crop in components(first)[1]:
        if not (crop.window(second) & crop.pixels).any():
            crop.window(result)[crop.pixels] = True
    return result


def _regions(store: Store, pair: Pair, run: Run) -> list[_Found]:
    stored = load_regions(store, run.id, pair.id)
    detection = load_detection(store, run.id, pair.id)
    if not stored or detection is None:
        return []
    _, parts = components(decode_rle(detection.mask))
    objects = live_runs(store, run.id, pair.id)
    height, width = pair.live.height, pair.live.width
    found: list[_Found] = []
    for region in stored:
        things, mine = region_crops(region.region, objects, parts)
        mask = encode_crops(mine if things is None else things, height, width)
        found.append((region.labels, region.region.doi, region.id, mask))
    return found


def _parts(mask: Mask) -> list[_Found]:
    """Return the components of a mask, largest first."""
    crops = [crop for crop in components(mask)[1] if crop.area >= LEAST_PX]
    crops.sort(key=lambda crop: -crop.area)
    return [("", None, None, encode_crops([crop], *mask.shape)) for crop in crops]
