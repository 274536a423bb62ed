"""Scores beyond pixels: how many objects were found, and how accurate their borders are.

Objects are 8-connected components. A found object and a true one match when their IoU reaches a
threshold, the best pairs first, each once. Borders are compared in two ways: as lines that may lie
some pixels apart (`metrics.boundary_scores`), and as bands inside each mask whose depth is a share
of the image's diagonal (`metrics.boundary_ious`). All look at masks, so they take seconds where
stored counts take milliseconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from os import cpu_count

import numpy as np

from reviewer.evaluation.tables import METHOD_TITLE
from reviewer.masks import Mask, components, crop_to_box, decode_rle
from reviewer.metrics import (
    Counts,
    border_px,
    boundary_ious,
    boundary_scores,
    count,
    precision,
    recall,
    total,
    unseen_share,
)
from reviewer.store.database import Store
from reviewer.store.scores import MaskPair, mask_pair, mask_pair_keys
from reviewer.words import Method, Standing

IOUS = (0.1, 0.25, 0.5)
TOLERANCES_PX = (1, 2, 3)
SHARES = (0.02, 0.005)
"""Depths of bands: 2 % of the diagonal as published (16 px at 640x480), which fills small objects
whole, so that it is their IoU; and a quarter of it, which does not."""


@dataclass(frozen=True, slots=True)
class ShapeScore:
    """Objects and borders of one method on one pair.

    Attributes:
        objects: TP, FP, FN objects at each IoU of `IOUS`.
        borders: boundary F at each tolerance of `TOLERANCES_PX`; None where neither mask has any
            pixel.
        bands: Boundary IoU at each share of `SHARES`; None where `borders` is.
    """

    objects: tuple[Counts, ...]
    borders: tuple[float, ...] | None
    bands: tuple[float, ...] | None


def score_shapes(
    predicted: Mask, truth: Mask, ignore: Mask | None = None, valid: Mask | None = None
) -> ShapeScore:
    """Compare two bool (H, W) masks; pixels of `ignore`, or not `valid`, belong to neither."""
    if ignore is not None and ignore.any():
        predicted, truth = predicted & ~ignore, truth & ~ignore
    if valid is not None:
        predicted, truth = predicted & valid, truth & valid
    around = crop_to_box(predicted | truth)
    if around is None:
        return ShapeScore(tuple(Counts() for _ in IOUS), None, None)
    # Nothing outside this window matters, but a border needs a pixel beyond it.
    x0, y0, x1, y1 = around.box_xyxy
    window = np.s_[max(0, y0 - 1) : y1 + 1, max(0, x0 - 1) : x1 + 1]
    ours, theirs = (np.ascontiguousarray(mask[window]) for mask in (predicted, truth))
    height, width = truth.shape
    depths = [border_px(height, width, share) for share in SHARES]
    return ShapeScore(
        _matched(ours, theirs),
        boundary_scores(ours, theirs, TOLERANCES_PX),
        boundary_ious(ours, theirs, depths),
    )


def _matched(predicted: Mask, truth: Mask) -> tuple[Counts, ...]:
    ours, found = components(predicted)
    theirs, true = components(truth)
    both = predicted & truth
    pairs, shared = np.unique(
        np.stack([ours[both], theirs[both]], axis=1).reshape(-1, 2), axis=0, return_counts=True
    )
    matches = []
    for (i, j), pixels in zip(pairs.tolist(), shared.tolist(), strict=True):
        matches.append((pixels / (found[i - 1].area + true[j - 1].area - pixels), i, j))
    matches.sort(key=lambda match: (-match[0], match[1], match[2]))
    counts = []
    for least in IOUS:
        taken_ours: set[int] = set()
        taken_theirs: set[int] = set()
        for iou, i, j in matches:
            if iou >= least and i not in taken_ours and j not in taken_theirs:
                taken_ours.add(i)
                taken_theirs.add(j)
        tp = len(taken_ours)
        counts.append(Counts(tp, len(found) - tp, len(true) - tp))
    return tuple(counts)


def shape_rows(
    store: Store,
    run: str | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    standings: Sequence[Standing] = (),
) -> list[dict[str, str | float]]:
    """Return one row per run and method: object precision and recall, mean boundary F and IoU, and
    the share of the pixels that the run has not seen.

    Objects are pooled over all pairs; borders are the mean over pairs in which anything has changed
    or was found.

    Args:
        standings: see `store.scores.pair_scores`.
    """
    keys = mask_pair_keys(store, run, standings)
    found: dict[tuple[str, Method], list[tuple[ShapeScore, Counts]]] = {}

    def work(key: tuple[int, int, Method]) -> tuple[str, Method, tuple[ShapeScore, Counts]]:
        item = mask_pair(store, *key)
        return item.run, item.method, _score(item)

    with ThreadPoolExecutor(cpu_count() or 1) as pool:
        for number, (name, method, scored) in enumerate(pool.map(work, keys), start=1):
            found.setdefault((name, method), []).append(scored)
            progress(number, len(keys))
    order = list(METHOD_TITLE)
    return [
        _row(name, method, scores)
        for (name, method), scores in sorted(
            found.items(), key=lambda entry: (entry[0][0], order.index(entry[0][1]))
        )
    ]


def _score(item: MaskPair) -> tuple[ShapeScore, Counts]:
    predicted, truth = decode_rle(item.prediction), decode_rle(item.truth)
    ignore, valid = (decode_rle(mask) if mask else None for mask in (item.ignore, item.valid))
    return score_shapes(predicted, truth, ignore, valid), count(predicted, truth, ignore, valid)


def _row(
    run: str, method: Method, scored: Sequence[tuple[ShapeScore, Counts]]
) -> dict[str, str | float]:
    scores = [score for score, _ in scored]
    row: dict[str, str | float] = {"run": run, "method": METHOD_TITLE[method]}
    for k, least in enumerate(IOUS):
        counts = total(score.objects[k] for score in scores)
        row[f"P@{least:g}"], row[f"R@{least:g}"] = precision(counts), recall(counts)
    names = [f"border {tolerance} px" for tolerance in TOLERANCES_PX]
    names += [f"border IoU {100 * share:g} %" for share in SHARES]
    both = [(*s.borders, *s.bands) for s in scores if s.borders is not None and s.bands is not None]
    means = np.mean(both, axis=0) if both else [float("nan")] * len(names)
    row |= {name: float(mean) for name, mean in zip(names, means, strict=True)}
    return row | {"unseen": unseen_share(total(counts for _, counts in scored))}
