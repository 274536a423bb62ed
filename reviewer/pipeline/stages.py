"""One pair through one stage: read from the store, ask a model, write to the store."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from reviewer.dataset.files import read_rgb
from reviewer.doi import Choice, Region, compose, integrate
from reviewer.errors import Conflict, NotFound
from reviewer.masks import Mask, decode_rle, encode_rle, union
from reviewer.models.interfaces import Aligner, Detector, Image, Segmenter
from reviewer.models.registry import build_aligner, build_segmenter, open_detector
from reviewer.pipeline.fields import load_warp, store_alignment, store_detection
from reviewer.pipeline.settings import IMPORTED, PipelineSettings
from reviewer.records import ObjectInstance, Pair, Run, Side, Verdict
from reviewer.store import runs
from reviewer.store.database import Store
from reviewer.store.runs import Stage, StoredDetection


@dataclass(frozen=True, slots=True)
class Members:
    """The models of a run; None where the output is imported."""

    aligner: Aligner
    detector: Detector | None
    segmenter: Segmenter | None


def build_members(settings: PipelineSettings) -> Members:
    """Build the models that a run names.

    Raises:
        InvalidInput: for an unknown name or setting.
    """
    own = settings.model_settings
    detector, segmenter = settings.detector, settings.segmenter
    return Members(
        build_aligner(settings.aligner, own.get("align")),
        None if detector == IMPORTED else open_detector(detector, own.get("detect")),
        None if segmenter == IMPORTED else build_segmenter(segmenter, own.get("search")),
    )


def run_stage(
    store: Store, run: Run, settings: PipelineSettings, members: Members, stage: Stage, pair: Pair
) -> None:
    """Do one stage for one pair and write its result.

    Raises:
        ReviewerError: when an image cannot be read, a model fails, or an earlier stage is missing.
    """
    if stage == "align":
        _align(store, run, members.aligner, pair)
    elif stage == "detect":
        _detect(store, run, settings, members.detector, pair)
    elif stage == "search":
        _search(store, run, members.segmenter, pair)
    else:
        integrate_pair(store, run, settings, pair)


def _align(store: Store, run: Run, aligner: Aligner, pair: Pair) -> None:
    reference, live = read_rgb(pair.reference.path), read_rgb(pair.live.path)
    start = time.perf_counter()
    alignment = aligner.align(reference, live)
    seconds = time.perf_counter() - start
    stored = store_alignment(alignment, reference, live, seconds)
    runs.save_alignment(store, run.id, pair.id, stored)


def _detect(
    store: Store, run: Run, settings: PipelineSettings, detector: Detector | None, pair: Pair
) -> None:
    if detector is None:
        if runs.load_detection(store, run.id, pair.id) is None:
            raise NotFound(f"pair {pair.title}: run {run.name} has no imported detection for it")
        return
    warped, valid = warped_reference(store, run, pair)
    live = read_rgb(pair.live.path)
    start = time.perf_counter()
    probability = detector.detect(warped, live, valid)
    seconds = time.perf_counter() - start
    assert settings.threshold is not None, "a prepared run names its threshold"
    stored = store_detection(probability, settings.threshold, seconds)
    runs.save_detection(store, run.id, pair.id, stored)


def _search(store: Store, run: Run, segmenter: Segmenter | None, pair: Pair) -> None:
    if segmenter is None:
        # Imported objects are there already; a pair without any has been searched in vain.
        runs.save_objects(store, run.id, pair.id, runs.load_objects(store, run.id, pair.id), 0.0)
        return
    warped, valid = warped_reference(store, run, pair)
    change = decode_rle(_detection(store, run, pair).mask)
    live = read_rgb(pair.live.path)
    start = time.perf_counter()
    found = segmenter.segment(warped, live, change, valid)
    seconds = time.perf_counter() - start
    sides: tuple[Side, Side] = ("live", "reference")
    objects = [
        ObjectInstance(side, number, thing.label, thing.score, encode_rle(thing.mask))
        for side, things in zip(sides, (found.live, found.reference), strict=True)
        for number, thing in enumerate(things)
    ]
    runs.save_objects(store, run.id, pair.id, objects, seconds)


def integrate_pair(store: Store, run: Run, settings: PipelineSettings, pair: Pair) -> None:
    """Compute the regions and the final mask of a pair from what is stored."""
    detection = _detection(store, run, pair)
    alignment = runs.load_alignment(store, run.id, pair.id)
    objects = runs.load_objects(store, run.id, pair.id)
    result = integrate(
        decode_rle(detection.mask),
        [decode_rle(thing.mask) for thing in objects if thing.side == "live"],
        [decode_rle(thing.mask) for thing in objects if thing.side == "reference"],
        scope=settings.scope,
        valid=decode_rle(alignment.valid) if alignment else None,
        low=settings.low,
        high=settings.high,
        max_overlap_px=settings.max_overlap_px,
        overlaps=settings.overlaps,
        touching_only=settings.touching_only,
    )
    final = encode_rle(result.mask)
    runs.save_integration(store, run.id, pair.id, result.regions, detection.mask, final)


def compose_audited(store: Store, run_id: int, pair_id: int, verdicts: dict[int, Verdict]) -> Mask:
    """Compose the final mask from people's verdicts in place of decisions.

    Args:
        verdicts: verdicts to take into account beside the stored ones, by region id.

    Raises:
        NotFound: when the run has no detection for the pair.
        Conflict: when "adopt" is said of a region that has no object.
    """
    detection = runs.load_detection(store, run_id, pair_id)
    if detection is None:
        raise NotFound(f"pair {pair_id}: run {run_id} has no detection for it")
    regions = [
        replace(region, verdict=verdicts.get(region.id, region.verdict))
        for region in runs.load_regions(store, run_id, pair_id)
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


def live_masks(store: Store, run_id: int, pair_id: int) -> dict[int, Mask]:
    """Return the masks of a pair's live objects by number."""
    return {
        thing.number: decode_rle(thing.mask)
        for thing in runs.load_objects(store, run_id, pair_id)
        if thing.side == "live"
    }


def warped_reference(store: Store, run: Run, pair: Pair) -> tuple[Image, Mask]:
    """Return the warped reference and the valid mask of a pair.

    Raises:
        NotFound: when the pair was not aligned in this run.
    """
    alignment = runs.load_alignment(store, run.id, pair.id)
    if alignment is None:
        raise NotFound(f"pair {pair.title}: not aligned in run {run.name}; run stage align first")
    return load_warp(alignment, read_rgb(pair.reference.path))


def _detection(store: Store, run: Run, pair: Pair) -> StoredDetection:
    detection = runs.load_detection(store, run.id, pair.id)
    if detection is None:
        raise NotFound(f"pair {pair.title}: no detection in run {run.name}; run stage detect first")
    return detection
