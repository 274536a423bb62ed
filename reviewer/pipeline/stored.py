"""What the app and the audit make of a run's stored layers: warped reference, verdicts, regions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from reviewer.dataset.pictures import read_picture, shrunk_picture
from reviewer.doi import Region, compose
from reviewer.errors import Conflict, NotFound
from reviewer.masks import Crop, Mask, Rle, crop_of_rle, decode_rle, shrunk, union
from reviewer.models.interfaces import Field, Image
from reviewer.models.warping import warp_image
from reviewer.pipeline.fields import Part, load_confidence, load_flow
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.store.layers import (
    StoredAlignment,
    load_alignment,
    load_detection,
    load_objects,
)
from reviewer.store.regions import load_regions
from reviewer.words import Choice, Verdict


def compose_audited(
    store: Store, run_id: int, pair_id: int, verdicts: Mapping[int, Verdict | None]
) -> Mask:
    """Compose the final mask from people's verdicts in place of decisions.

    Args:
        verdicts: verdicts in place of the stored ones, by region id; None = there is none.

    Raises:
        NotFound: when the run has no detection for the pair.
        Conflict: when "adopt" is said of a region that has no object.
    """
    detection = load_detection(store, run_id, pair_id)
    if detection is None:
        raise NotFound(f"pair {pair_id}: run {run_id} has no detection for it")
    regions = [
        replace(region, verdict=verdicts.get(region.id, region.verdict))
        for region in load_regions(store, run_id, pair_id)
    ]
    for region in regions:
        if region.outcome == "adopt" and not region.region.object_indices:
            raise Conflict(f"region {region.id}: has no object that could be adopted")
    outcomes: dict[int, Choice] = {k: region.outcome for k, region in enumerate(regions)}
    return compose(
        decode_rle(detection.mask),
        list(live_masks(store, run_id, pair_id).values()),
        [region.region for region in regions],
        outcomes,
    )


def region_pixels(
    region: Region, objects: Mapping[int, Mask], labels: npt.NDArray[np.int32]
) -> tuple[Mask | None, Mask]:
    """Return a region's live objects together (None without any), and its components.

    Args:
        objects: masks of the live objects by number.
        labels: components of M_o as `masks.components` numbers them.
    """
    parts: Mask = np.isin(labels, [n + 1 for n in region.component_indices])
    found = [objects[number] for number in region.object_indices]
    return (union(found, *parts.shape) if found else None), parts


def region_crops(
    region: Region, objects: Mapping[int, Rle], parts: Sequence[Crop]
) -> tuple[list[Crop] | None, list[Crop]]:
    """Return what `region_pixels` does, as crops: a fraction of the time on a large picture.

    Args:
        objects: run-lengths of the live objects by number.
        parts: components of M_o as `masks.components` numbers them.
    """
    mine = [parts[number] for number in region.component_indices]
    found = [crop_of_rle(objects[number]) for number in region.object_indices]
    return [crop for crop in found if crop is not None] if found else None, mine


def live_runs(store: Store, run_id: int, pair_id: int) -> dict[int, Rle]:
    """Return the run-lengths of a pair's live objects by number."""
    return {
        thing.number: thing.mask
        for thing in load_objects(store, run_id, pair_id)
        if thing.side == "live"
    }


def live_masks(store: Store, run_id: int, pair_id: int) -> dict[int, Mask]:
    """Return the masks of a pair's live objects by number."""
    return {n: decode_rle(mask) for n, mask in live_runs(store, run_id, pair_id).items()}


def stored_alignment(store: Store, run: Run, pair: Pair) -> StoredAlignment:
    """Return the alignment of a pair.

    Raises:
        NotFound: when the pair was not aligned in this run.
    """
    alignment = load_alignment(store, run.id, pair.id)
    if alignment is None:
        raise NotFound(f"pair {pair.title}: not aligned in run {run.name}; run stage align first")
    return alignment


def warped_reference(store: Store, run: Run, pair: Pair, step: int = 1) -> tuple[Image, Mask]:
    """Return the warped reference and the valid mask of a pair, `step` times smaller; raises as
    `stored_alignment`."""
    alignment = stored_alignment(store, run, pair)
    picture = shrunk_picture(read_picture(pair.reference), step)
    warped = warp_image(picture, load_flow(alignment, None, step) / np.float32(step))
    return warped, shrunk(decode_rle(alignment.valid), step)


def warped_view(
    store: Store, run: Run, pair: Pair, part: Part | None = None
) -> tuple[Image, Mask, Field | None]:
    """Return what `warped_reference` does, and the confidence of the alignment, float32 (H, W);
    None where the aligner has none; all of a part, where one is named. Raises as
    `stored_alignment`."""
    alignment = stored_alignment(store, run, pair)
    flow, valid = load_flow(alignment, part), decode_rle(alignment.valid)
    if part is not None:
        rows, columns = part
        flow = flow + np.array([columns.start, rows.start], np.float32)
        valid = valid[part]
    warped = warp_image(read_picture(pair.reference), flow)
    return warped, valid, load_confidence(alignment, part)
