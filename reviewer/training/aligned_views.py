"""Synthetic views as the pipeline's own aligner brings them together, right, torn, wrong or alone.

A net that trusts a badly warped reference is of no use, so it meets bad ones in training.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask
from reviewer.models.aligners.dense import DisAligner
from reviewer.models.interfaces import Field, Image
from reviewer.models.warping import inside, warp_image, warp_mask
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.views import Views, ViewSettings, make_views

TRUE_FLOW, TORN, WRONG, ALONE = 0.2, 0.06, 0.06, 0.08
"""Shares of pairs that are aligned by the true flow, in part, to another place, or not at all."""


@dataclass(frozen=True, slots=True)
class AlignedViews:
    """Two views in the live frame.

    Attributes:
        live, warped: uint8 RGB (H, W, 3). confidence: float32 (H, W) in [0, 1].
        valid: bool (H, W), what can be compared.
        came, went, standing: bool masks (H, W); what went is where the warp shows it.
        change: bool (H, W), all that changed, as a person would draw it in the live frame.
        seen: bool (H, W), what the reference truly shows.
    """

    live: Image
    warped: Image
    confidence: Field
    valid: Mask
    came: tuple[Mask, ...]
    went: tuple[Mask, ...]
    standing: tuple[Mask, ...]
    change: Mask
    seen: Mask


def align_views(views: Views, rng: np.random.Generator) -> AlignedViews:
    """Warp the reference to the live view, as well or badly as it comes."""
    height, width = views.live.shape[:2]
    kind = rng.random()
    if kind < TRUE_FLOW:
        flow = views.flow + rng.normal(0, 0.7, 2).astype(np.float32)
        valid = inside(flow, height, width)
        confidence = valid.astype(np.float32)
    else:
        alignment = DisAligner(starts=0).align(views.reference, views.live)
        flow, valid = alignment.flow, alignment.valid
        assert alignment.confidence is not None, "this aligner tells it"
        confidence = alignment.confidence
        if TRUE_FLOW <= kind < TRUE_FLOW + TORN:
            half = np.zeros((height, width), np.bool_)
            cut = int(rng.integers(width // 4, 3 * width // 4))
            half[:, :cut] = True
            off = half if rng.random() < 0.5 else half.T
            flow = flow + off[..., None] * rng.normal(0, 12, 2).astype(np.float32)
            if rng.random() < 0.6:
                confidence = confidence * np.where(off, rng.uniform(0, 0.6), 1).astype(np.float32)
        elif kind < TRUE_FLOW + TORN + WRONG:
            flow = flow + rng.normal(0, 40, 2).astype(np.float32)
            confidence = confidence * np.float32(rng.uniform(0, 0.5))
        elif kind < TRUE_FLOW + TORN + WRONG + ALONE:
            confidence, valid = np.zeros_like(confidence), np.zeros_like(valid)
    went = (c for c in views.changed if not c.came)
    change = np.zeros((height, width), np.bool_)
    for thing in views.changed:
        change |= thing.mask
    return AlignedViews(
        views.live,
        warp_image(views.reference, flow),
        confidence,
        valid & (confidence > 0),
        tuple(c.mask for c in views.changed if c.came),
        tuple(warp_mask(c.own, flow) for c in went),
        views.standing,
        change,
        views.seen,
    )


def aligned_views(
    backgrounds: Sequence[npt.NDArray[np.uint8]], bank: Bank, settings: ViewSettings,
    rng: np.random.Generator,
) -> AlignedViews:  # fmt: skip
    """Make and align two views of a random background."""
    background = backgrounds[int(rng.integers(0, len(backgrounds)))]
    return align_views(make_views(background, bank, settings, rng), rng)
