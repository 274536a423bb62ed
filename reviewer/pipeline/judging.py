"""Judge whether a pair can be compared, by its alignment and by the detector's change mask.

What looks bad is not thrown away, because a person may know better; it carries its doubt into the
queue and the panes. `benchmarks/doubts.py` counts doubts on pairs that can and cannot be compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from reviewer.masks import Mask, Rle
from reviewer.models.interfaces import Alignment, Field, Image
from reviewer.models.warping import inside, sample_field

LEAST_VALID = 0.6
"""Share of the view: with less, most of a pair cannot be compared whatever the warp is like."""

MOST_BACKWARD_PX = 1.0
"""Where half of the view does not find back to within a pixel, the flow makes things up, and edges
move by more than the detectors forgive. Views that do align find back to a few tenths."""

MOST_RESIDUAL = 1.05
"""After the warp, over before it: a warp that makes the pictures differ more is worse than none.
The rest over 1 is what resampling and a fixed camera's noise do."""

MOST_LEFT = 0.25
"""Grey difference that half of the view keeps, over the live view's standard deviation. Pictures
that have nothing to do with each other keep 0.95 of it, noise and light under 0.2. The median does
not see new things, as long as they cover less than half of the view."""

MOST_CHANGED = 0.15
"""Share of the picture called changed: small objects cover a few percent, people before the camera
under a tenth. Beyond, the detector marks what the warp did."""

LEAST_CONTRAST = 8.0
"""Grey levels: on a view of hardly any contrast, noise is no misalignment."""

NO_RESIDUAL = 255.0


@dataclass(frozen=True, slots=True)
class Judgement:
    """The measurements of an alignment.

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
    left = _left_over(warped, live, alignment.valid)
    if left > MOST_LEFT:
        doubts.append(f"half of the view still differs by {left:.0%} of its contrast")
    return Judgement(before, after, backward_px, "; ".join(doubts))


def judge_detection(mask: Rle) -> str:
    """Return why a change mask M_o looks as if the pair could not be compared, "" = it does not."""
    share = mask.area / (mask.height * mask.width)
    return f"{share:.0%} of the picture is called changed" if share > MOST_CHANGED else ""


def _residual(past_image: Image, live: Image, valid: Mask) -> float:
    if past_image.shape != live.shape or not valid.any():
        return NO_RESIDUAL
    past, present = _greys(past_image, live, valid)
    past *= present.mean() / max(float(past.mean()), 1.0)
    return float(np.abs(past - present).mean())


def _left_over(warped: Image, live: Image, valid: Mask) -> float:
    if not valid.any():
        return 0.0
    past, present = _greys(warped, live, valid)
    # The light of most pixels, which one bright new thing does not change.
    past *= np.median(present / np.maximum(past, 1.0))
    return float(np.median(np.abs(past - present))) / max(float(present.std()), LEAST_CONTRAST)


def _greys(past_image: Image, live: Image, valid: Mask) -> tuple[Field, Field]:
    """Return the grey values of the valid pixels, past and present."""
    past = cv2.cvtColor(past_image, cv2.COLOR_RGB2GRAY)[valid].astype(np.float32)
    present = cv2.cvtColor(live, cv2.COLOR_RGB2GRAY)[valid].astype(np.float32)
    return past, present


def _backward_error(flow: Field, backward: Field | None, valid: Mask) -> float | None:
    if backward is None:
        return None
    comparable = valid & inside(flow, *backward.shape[:2])
    if not comparable.any():
        return None
    error = np.linalg.norm(flow + sample_field(backward, flow), axis=2)
    return float(np.median(error[comparable]))
