"""Judge an alignment: how much of the view it reaches, whether it finds back, what it leaves over.

An alignment that looks bad is not thrown away, because a person may know better; it carries its
doubt into the queue.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from reviewer.masks import Mask
from reviewer.models.interfaces import Alignment, Field, Image
from reviewer.models.warping import inside, sample_field

LEAST_VALID = 0.6
MOST_BACKWARD_PX = 3.0
MOST_RESIDUAL = 1.05
NO_RESIDUAL = 255.0


@dataclass(frozen=True, slots=True)
class Judgement:
    """What there is to say of an alignment.

    Attributes:
        residual_before, residual_after: mean absolute grey difference (0..255) after matching the
            mean light, over the valid pixels, before and after the warp.
        backward_px: median over the valid pixels of how far one ends from where one began, going
            to the reference and back; None without a flow back.
        doubt: why it looks bad, "" = it does not.
    """

    residual_before: float
    residual_after: float
    backward_px: float | None
    doubt: str


def judge(alignment: Alignment, reference: Image, warped: Image, live: Image) -> Judgement:
    """Measure an alignment; `warped` is the reference as the alignment warps it."""
    before = _residual(reference, live, alignment.valid)
    after = _residual(warped, live, alignment.valid)
    backward_px = _backward_error(alignment.flow, alignment.backward, alignment.valid)
    doubts = []
    share = float(np.count_nonzero(alignment.valid)) / alignment.valid.size
    if share < LEAST_VALID:
        doubts.append(f"reaches {share:.0%} of the view")
    if backward_px is not None and backward_px > MOST_BACKWARD_PX:
        doubts.append(f"forward-backward error {backward_px:.1f} px")
    if after > MOST_RESIDUAL * before:
        doubts.append(f"leaves a larger difference ({after:.1f}) than no alignment ({before:.1f})")
    return Judgement(before, after, backward_px, "; ".join(doubts))


def _residual(past_image: Image, live: Image, valid: Mask) -> float:
    if past_image.shape != live.shape or not valid.any():
        return NO_RESIDUAL
    past = cv2.cvtColor(past_image, cv2.COLOR_RGB2GRAY)[valid].astype(np.float32)
    present = cv2.cvtColor(live, cv2.COLOR_RGB2GRAY)[valid].astype(np.float32)
    past *= present.mean() / max(float(past.mean()), 1.0)
    return float(np.abs(past - present).mean())


def _backward_error(flow: Field, backward: Field | None, valid: Mask) -> float | None:
    if backward is None:
        return None
    comparable = valid & inside(flow, *backward.shape[:2])
    if not comparable.any():
        return None
    error = np.linalg.norm(flow + sample_field(backward, flow), axis=2)
    return float(np.median(error[comparable]))
