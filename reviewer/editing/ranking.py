"""Put proposals in the order in which they are likely to be a change, near duplicates folded.

What a run knows of a pair is weighed: how sure the detector is inside the mask, how well the mask
fits the final mask of the run (where decisions to adopt an object are in already), how many other
sources propose nearly the same, whether the reference shows an object there too, and the size. The
weights are set by hand; `benchmarks/proposals.py` measures what they are worth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from reviewer.masks import Crop, Mask, Rle, components, crop_of_rle
from reviewer.models.interfaces import Field
from reviewer.words import ProposalSource

ALIKE = 0.8
AGREES = 0.5
FIT, SUPPORT, AGREEMENT, CHOSEN = 0.5, 0.25, 0.15, 0.1
SEEN_BEFORE = 0.4
"""Factor for what the reference shows at the same place."""
CANDIDATE = 0.3
"""What nothing else proposes stands behind what a run is rather sure of."""
SMALL_PX = 12.0


@dataclass(frozen=True, slots=True)
class Proposal:
    """A mask that is proposed.

    Attributes:
        key: "run id/source/number".
        score: what its source says of it, in [0, 1]; None where it says nothing.
        region_id: the region under DoI that it is.
        outcome: what a person did with it last, as the tool log names it; None for nothing.
        likelihood: how likely it is a change, in [0, 1]; for ordering only.
        also: other sources that propose nearly the same, folded into this one.
    """

    key: str
    source: ProposalSource
    run: str
    number: int
    label: str
    score: float | None
    region_id: int | None
    mask: Rle
    outcome: str | None
    likelihood: float = 0.0
    also: tuple[ProposalSource, ...] = ()


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a run knows of a pair: its final mask and detector, bool and float32 (H, W) each; ids of
    the regions whose outcome is a change, and of those that the reference shows too."""

    final: Mask
    probability: Field
    chosen: frozenset[int]
    seen_before: frozenset[int]


def rank(proposals: Sequence[Proposal], evidence: Evidence) -> list[Proposal]:
    """Return the proposals, the likeliest change first; what another source proposes with an IoU of
    at least `ALIKE` is folded into the proposal that ranks higher, or into the region."""
    crops = [crop_of_rle(proposal.mask) for proposal in proposals]
    fits = _fits(crops, evidence.final)
    overlap = _overlaps(crops)
    rated = []
    for k, proposal in enumerate(proposals):
        near = [int(j) for j in np.flatnonzero(overlap[k] >= AGREES) if j != k]
        sources = {proposals[j].source for j in near} - {proposal.source}
        rated.append(
            replace(
                proposal, likelihood=_likelihood(proposal, crops[k], fits[k], sources, evidence)
            )
        )
    order = sorted(range(len(rated)), key=lambda k: (-rated[k].likelihood, crops[k] is None, k))
    return _folded(rated, order, overlap)


def _likelihood(
    proposal: Proposal,
    crop: Crop | None,
    fit: float,
    sources: set[ProposalSource],
    evidence: Evidence,
) -> float:
    if crop is None:
        return 0.0
    if proposal.source == "candidate":
        return CANDIDATE * (proposal.score or 0.0)
    support = float(crop.window(evidence.probability)[crop.pixels].mean())
    agreement = min(len(sources), 2) / 2
    chosen = proposal.region_id in evidence.chosen
    value = FIT * fit + SUPPORT * support + AGREEMENT * agreement + CHOSEN * chosen
    both = {"object_live", "object_reference"} <= {proposal.source, *sources}
    if both or proposal.region_id in evidence.seen_before:
        value *= SEEN_BEFORE
    return value * crop.area / (crop.area + SMALL_PX)


def _fits(crops: Sequence[Crop | None], final: Mask) -> list[float]:
    """Return the IoU of each mask with what it touches of the final mask, part by part."""
    labels, parts = components(final)
    fits = []
    for crop in crops:
        best = 0.0
        if crop is not None:
            counts = np.bincount(crop.window(labels)[crop.pixels])
            for label in np.flatnonzero(counts[1:]) + 1:
                shared = int(counts[label])
                best = max(best, shared / (crop.area + parts[label - 1].area - shared))
        fits.append(best)
    return fits


def _overlaps(crops: Sequence[Crop | None]) -> np.ndarray:
    """Return the IoU of each mask with each other one, float64 (N, N)."""
    found = np.zeros((len(crops), len(crops)))
    for k, first in enumerate(crops):
        for j in range(k):
            second = crops[j]
            if first is not None and second is not None:
                found[k, j] = found[j, k] = _iou(first, second)
    return found


def _iou(first: Crop, second: Crop) -> float:
    # Areas alone bound the IoU, and most boxes do not meet.
    if min(first.area, second.area) < AGREES * max(first.area, second.area):
        return 0.0
    ax0, ay0, ax1, ay1 = first.box_xyxy
    bx0, by0, bx1, by1 = second.box_xyxy
    x0, y0, x1, y1 = max(ax0, bx0), max(ay0, by0), min(ax1, bx1), min(ay1, by1)
    if x0 >= x1 or y0 >= y1:
        return 0.0
    mine = first.pixels[y0 - ay0 : y1 - ay0, x0 - ax0 : x1 - ax0]
    theirs = second.pixels[y0 - by0 : y1 - by0, x0 - bx0 : x1 - bx0]
    shared = int(np.count_nonzero(mine & theirs))
    return shared / (first.area + second.area - shared)


def _folded(
    proposals: Sequence[Proposal], order: Sequence[int], overlap: np.ndarray
) -> list[Proposal]:
    """Return the proposals in order without those that stand for a kept one of another source."""
    kept: list[int] = []
    also: dict[int, list[int]] = {}
    for k in order:
        alike = [
            j
            for j in kept
            if overlap[k, j] >= ALIKE
            and proposals[j].source != proposals[k].source
            and proposals[k].source not in {proposals[i].source for i in also[j]}
        ]
        if not alike:
            kept.append(k)
            also[k] = []
            continue
        into = max(alike, key=lambda j: overlap[k, j])
        # A region takes verdicts: it stays in the list, and what was there is folded into it.
        if proposals[k].source == "region" and proposals[into].source != "region":
            kept[kept.index(into)] = k
            also[k] = [into, *also.pop(into)]
        else:
            also[into].append(k)
    return [
        replace(
            proposals[k],
            also=tuple(dict.fromkeys(proposals[j].source for j in also[k])),
            outcome=next(
                (found for j in (k, *also[k]) if (found := proposals[j].outcome) is not None), None
            ),
        )
        for k in kept
    ]
