"""What determines a pair's score under any DoI rule: integers, computed once from the masks.

Components of M_o are disjoint, and the objects of a pair are cut into *atoms*: pixels that belong
to the same set of objects. A final mask is a set of components and, of the adopted objects, the
atoms that any of them holds; so its TP and FP are sums, exactly, for every rule and both scopes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reviewer.doi import Region, integrate_crops
from reviewer.masks import Crop, Mask, components
from reviewer.metrics import Counts


@dataclass(frozen=True, slots=True)
class ObjectTerms:
    """The terms of the equation for one live object, or for all of a pair together.

    Attributes:
        iou: IoU(O_l, m) with the components it touches.
        overlap_px: pixels shared with O_r; -1 where the warp shows none of the object.
        components: those it touches.
    """

    iou: float
    overlap_px: int
    components: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class PairTerms:
    """Everything about a pair.

    Attributes:
        truth_px: changed pixels that are scored.
        components: (TP, FP) of every component of M_o.
        objects: live objects that are not empty.
        atoms: (places in `objects`, TP, FP) of pixels that belong to the same objects.
        image: all objects against all of M_o, the equation as written; None without objects.
    """

    truth_px: int
    components: tuple[tuple[int, int], ...]
    objects: tuple[ObjectTerms, ...]
    atoms: tuple[tuple[tuple[int, ...], int, int], ...]
    image: ObjectTerms | None


def pair_terms(
    change: Mask,
    live: Sequence[Crop | None],
    reference: Mask,
    valid: Mask | None,
    truth: Mask,
    ignore: Mask | None,
) -> PairTerms:
    """Return the terms of a pair; masks bool (H, W), live objects cut out.

    Args:
        valid: as in `doi.integrate`; what is not valid is not scored.
        ignore: pixels that are not scored either.
    """
    right, wrong = scored_pixels(truth, ignore, valid)
    _, parts = components(change)
    by_object = integrate_crops(change, live, reference, valid=valid, overlaps="all").regions
    whole = integrate_crops(change, live, reference, valid=valid, scope="image").regions[0]
    found = [region for region in by_object if region.object_indices]
    return PairTerms(
        int(np.count_nonzero(right)),
        tuple(_counts(part, right, wrong) for part in parts),
        tuple(_terms(region) for region in found),
        _atoms([live[region.object_indices[0]] for region in found], right, wrong),
        _terms(whole) if whole.object_indices else None,
    )


def scored_pixels(truth: Mask, ignore: Mask | None, valid: Mask | None) -> tuple[Mask, Mask]:
    """Return the pixels where finding a change is right and where it is wrong, bool (H, W) each."""
    scored = np.ones_like(truth) if valid is None else valid
    if ignore is not None:
        scored = scored & ~ignore
    return truth & scored, ~truth & scored


def region_counts(
    region: Region, objects: Sequence[Crop | None], parts: Sequence[Crop], right: Mask, wrong: Mask
) -> dict[str, Counts]:
    """Return what each outcome of a region gives inside its object and its components."""
    thing = np.zeros_like(right)
    for index in region.object_indices:
        crop = objects[index]
        if crop is not None:
            crop.window(thing)[...] |= crop.pixels
    kept = np.zeros_like(right)
    for index in region.component_indices:
        parts[index].window(kept)[...] |= parts[index].pixels
    there = int(np.count_nonzero(right & (thing | kept)))
    found = {}
    for outcome, mask in (("adopt", thing), ("keep", kept)):
        tp = int(np.count_nonzero(mask & right))
        found[outcome] = Counts(tp, int(np.count_nonzero(mask & wrong)), there - tp)
    if not region.object_indices:
        del found["adopt"]
    return {**found, "reject": Counts(0, 0, there)}


def _terms(region: Region) -> ObjectTerms:
    overlap = -1 if region.reason == "outside_warp" else region.overlap_px
    return ObjectTerms(region.iou, overlap, region.component_indices)


def _counts(crop: Crop, right: Mask, wrong: Mask) -> tuple[int, int]:
    return (
        int(np.count_nonzero(crop.pixels & crop.window(right))),
        int(np.count_nonzero(crop.pixels & crop.window(wrong))),
    )


def _atoms(
    objects: Sequence[Crop | None], right: Mask, wrong: Mask
) -> tuple[tuple[tuple[int, ...], int, int], ...]:
    """Cut objects into pixels of the same membership; most pairs have no overlap at all."""
    crops = [crop for crop in objects if crop is not None]
    depth = np.zeros(right.shape, np.uint8)
    for crop in crops:
        window = crop.window(depth)
        window += crop.pixels
    counts: dict[tuple[int, ...], tuple[int, int]] = {}
    for number, crop in enumerate(crops):
        alone = Crop(crop.x, crop.y, crop.pixels & (crop.window(depth) == 1), 0)
        counts[(number,)] = _counts(alone, right, wrong)
    rows, columns = np.nonzero(depth > 1)
    if len(rows):
        member = np.zeros((len(rows), len(crops)), np.bool_)
        for number, crop in enumerate(crops):
            y, x = rows - crop.y, columns - crop.x
            inside = (y >= 0) & (x >= 0) & (y < crop.pixels.shape[0]) & (x < crop.pixels.shape[1])
            member[inside, number] = crop.pixels[y[inside], x[inside]]
        groups, which = np.unique(member, axis=0, return_inverse=True)
        for k, group in enumerate(groups):
            here = which.ravel() == k
            tp = int(np.count_nonzero(right[rows[here], columns[here]]))
            fp = int(np.count_nonzero(wrong[rows[here], columns[here]]))
            counts[tuple(int(n) for n in np.flatnonzero(group))] = tp, fp
    return tuple((members, tp, fp) for members, (tp, fp) in counts.items())
