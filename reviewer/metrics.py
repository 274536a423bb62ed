"""Pixel counts -> precision, recall, F-score: the only place where these are computed.

Counts are integers and add up, so every protocol is arithmetic on stored counts. The 0/0 rule is
named: with `zero_over_zero=0.0` (the default) a score without any positive is 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask, boundary, components


@dataclass(frozen=True, slots=True)
class Counts:
    """Pixels by outcome; ignored and unseen ones are left out of TP, FP, FN and TN.

    Attributes:
        ignored: pixels that are not scored, because nobody could say what changed there.
        unseen_px: other pixels that a run has not seen.
        unseen_objects: changed objects (components of the truth) that are unseen as a whole.
    """

    tp: int = 0
    fp: int = 0
    fn: int = 0
    tn: int = 0
    ignored: int = 0
    unseen_px: int = 0
    unseen_objects: int = 0

    @property
    def rightly_empty(self) -> bool:
        """Whether truth and prediction are both empty; scores are 0/0 then."""
        return not (self.tp or self.fp or self.fn)

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.tp + other.tp,
            self.fp + other.fp,
            self.fn + other.fn,
            self.tn + other.tn,
            self.ignored + other.ignored,
            self.unseen_px + other.unseen_px,
            self.unseen_objects + other.unseen_objects,
        )


def count(
    predicted: Mask, truth: Mask, ignore: Mask | None = None, valid: Mask | None = None
) -> Counts:
    """Compare two bool (H, W) masks pixel by pixel, leaving out `ignore` and what is not `valid`.

    Args:
        valid: pixels that the run has seen; None = all.
    """
    ignored = unseen_px = unseen_objects = 0
    if ignore is not None and ignore.any():
        ignored = int(np.count_nonzero(ignore))
        predicted, truth = predicted & ~ignore, truth & ~ignore
    if valid is not None and not valid.all():
        hidden = ~valid if ignore is None else ~(valid | ignore)
        unseen_px = int(np.count_nonzero(hidden))
        unseen_objects = _objects_within(truth, valid)
        predicted, truth = predicted & valid, truth & valid
    tp = int(np.count_nonzero(predicted & truth))
    fp = int(np.count_nonzero(predicted)) - tp
    fn = int(np.count_nonzero(truth)) - tp
    tn = truth.size - ignored - unseen_px - tp - fp - fn
    return Counts(tp, fp, fn, tn, ignored, unseen_px, unseen_objects)


def _objects_within(truth: Mask, valid: Mask) -> int:
    """Return how many components have no valid pixel."""
    if not (truth & ~valid).any():
        return 0
    labels, parts = components(truth)
    return len(parts) - len(np.unique(labels[truth & valid]))


def unseen_share(counts: Counts) -> float:
    """Share of the pixels that a run has not seen, of all that are not ignored, in [0, 1]."""
    scored = counts.tp + counts.fp + counts.fn + counts.tn
    return _ratio(counts.unseen_px, scored + counts.unseen_px, 0.0)


def total(counts: Iterable[Counts]) -> Counts:
    """Pool counts: the sum over images."""
    return sum(counts, Counts())


def _ratio(numerator: float, denominator: float, zero_over_zero: float) -> float:
    return numerator / denominator if denominator else zero_over_zero


def precision(counts: Counts, *, zero_over_zero: float = 0.0) -> float:
    """TP / (TP + FP), in [0, 1]."""
    return _ratio(counts.tp, counts.tp + counts.fp, zero_over_zero)


def recall(counts: Counts, *, zero_over_zero: float = 0.0) -> float:
    """TP / (TP + FN), in [0, 1]."""
    return _ratio(counts.tp, counts.tp + counts.fn, zero_over_zero)


def f_score(counts: Counts, *, zero_over_zero: float = 0.0) -> float:
    """2 P R / (P + R) = 2 TP / (2 TP + FP + FN), in [0, 1]."""
    return _ratio(2 * counts.tp, 2 * counts.tp + counts.fp + counts.fn, zero_over_zero)


def boundary_f(predicted: Mask, truth: Mask, tolerance_px: float) -> float:
    """Return the boundary F-score of two bool (H, W) masks, in [0, 1]; see `boundary_scores`."""
    return boundary_scores(predicted, truth, (tolerance_px,))[0]


def boundary_scores(
    predicted: Mask, truth: Mask, tolerances_px: Sequence[float]
) -> tuple[float, ...]:
    """Return the boundary F-scores of two bool (H, W) masks at several tolerances, in [0, 1].

    A boundary pixel is right when the other boundary passes within the tolerance of it. Two empty
    masks agree (1); an empty and a filled one do not (0). Source: Perazzi et al., DAVIS (CVPR
    2016), with tolerances in pixels.
    """
    ours, theirs = boundary(predicted), boundary(truth)
    if not ours.any() or not theirs.any():
        return (float(ours.any() == theirs.any()),) * len(tolerances_px)
    to_theirs, to_ours = _distance_to(theirs)[ours], _distance_to(ours)[theirs]
    scores = []
    for tolerance in tolerances_px:
        right, found = float(np.mean(to_theirs <= tolerance)), float(np.mean(to_ours <= tolerance))
        scores.append(_ratio(2 * right * found, right + found, 0.0))
    return tuple(scores)


def border_px(height: int, width: int, share: float) -> int:
    """Return the depth of a border: a share of the image's diagonal, at least one pixel."""
    return max(1, round(share * math.hypot(height, width)))


def boundary_ious(predicted: Mask, truth: Mask, distances_px: Sequence[int]) -> tuple[float, ...]:
    """Return the Boundary IoU of two bool (H, W) masks for several border depths, in [0, 1].

    A mask's border is those of its own pixels that lie within the distance (chessboard) of a pixel
    outside it; what lies beyond the image is outside. The score is the IoU of both borders. Two
    empty masks agree (1). Where the border fills an object, its Boundary IoU is its IoU. Source:
    Cheng et al., Boundary IoU (CVPR 2021), who take 2 % of the image's diagonal (`border_px`).
    """
    ours, theirs = _depth(predicted), _depth(truth)
    scores = []
    for distance in distances_px:
        mine, other = ((0 < depth) & (depth <= distance) for depth in (ours, theirs))
        either = int(np.count_nonzero(mine | other))
        scores.append(_ratio(int(np.count_nonzero(mine & other)), either, 1.0))
    return tuple(scores)


def _depth(mask: Mask) -> npt.NDArray[np.float32]:
    """Return how far each pixel of a mask lies from the outside, chessboard; 0 outside it."""
    padded = np.pad(mask, 1).view(np.uint8)
    distance = cv2.distanceTransform(padded, cv2.DIST_C, cv2.DIST_MASK_3)
    return np.asarray(distance[1:-1, 1:-1], np.float32)


def _distance_to(mask: Mask) -> npt.NDArray[np.float32]:
    away = (~mask).view(np.uint8)
    distance = cv2.distanceTransform(away, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(distance, np.float32)
