"""The changed objects of demo pairs, with what the click and effort benchmarks start from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from reviewer.dataset.files import read_rgb
from reviewer.editing.proposals import list_proposals
from reviewer.masks import Mask, components, decode_rle
from reviewer.models.interfaces import Field, Image
from reviewer.pipeline.fields import change_of
from reviewer.pipeline.stored import warped_view
from reviewer.store.database import Store
from reviewer.store.layers import load_detection
from reviewer.store.pairs import list_pairs
from reviewer.store.regions import load_prediction
from reviewer.store.revisions import list_revisions
from reviewer.store.runs import list_runs
from reviewer.words import ProposalSource

SOURCES: tuple[ProposalSource, ...] = (
    "region",
    "detector",
    "object_live",
    "object_reference",
    "candidate",
)
SIZES = ((0, "< 8²"), (64, "< 16²"), (256, "< 32²"), (1024, "larger"))
MARGIN_PX = 8


@dataclass(frozen=True, slots=True)
class ScenePair:
    """A pair: uint8 RGB (H, W, 3) images, bool (H, W) masks, confidence as in `Alignment`; what the
    list "all of this run" proposes, by key, in its order."""

    id: int
    title: str
    live: Image
    warped: Image
    truth: Mask
    detected: Mask
    predicted: Mask
    confidence: Field | None = None
    change: Field | None = None
    proposed: Mapping[str, Mask] = field(default_factory=dict)


def load_pairs(db: Path, every: int = 1) -> Iterator[ScenePair]:
    """Yield each `every`-th pair that has imported ground truth, in the newest run."""
    with Store(db) as store:
        run = list_runs(store)[-1]
        for pair in list_pairs(store)[::every]:
            history = list_revisions(store, pair.id)
            detection = load_detection(store, run.id, pair.id)
            prediction = load_prediction(store, run.id, pair.id, "doi")
            if not history or detection is None or prediction is None:
                continue
            warped, _, confidence = warped_view(store, run, pair)
            yield ScenePair(
                pair.id,
                pair.title,
                read_rgb(pair.live.path),
                warped,
                decode_rle(history[0].mask),
                decode_rle(detection.mask),
                decode_rle(prediction),
                confidence,
                change_of(detection),
                {p.key: decode_rle(p.mask) for p in list_proposals(store, pair, run, SOURCES)},
            )


def objects_of(truth: Mask, least: int = 1) -> list[Mask]:
    """Return the 8-connected components of at least so many pixels, bool (H, W) each."""
    found = []
    for crop in components(truth)[1]:
        if crop.area < least:
            continue
        mask = np.zeros_like(truth)
        crop.window(mask)[...] = crop.pixels
        found.append(mask)
    return found


def around(thing: Mask) -> Mask:
    """Return the window around an object in which a detector's pixels are taken for it."""
    rows, columns = np.flatnonzero(thing.any(axis=1)), np.flatnonzero(thing.any(axis=0))
    margin = MARGIN_PX + max(np.ptp(rows), np.ptp(columns)) // 2
    window = np.zeros_like(thing)
    top, left = max(0, rows[0] - margin), max(0, columns[0] - margin)
    window[top : rows[-1] + margin + 1, left : columns[-1] + margin + 1] = True
    return window


def size_of(area: int) -> str:
    """Return the name of an object's size."""
    return [name for least, name in SIZES if area >= least][-1]
