"""Pixel counts -> precision, recall, F-score: the only place where these are computed.

Counts are integers and add up, so every protocol is arithmetic on stored counts. The 0/0 rule is
named: with `zero_over_zero=0.0` (the default) a score without any positive is 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask, boundary


@dataclass(frozen=True, slots=True)
class Counts:
    """Pixels by outcome; `ignored` pixels are left out of the other four."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    tn: int = 0
    ignored: int = 0

    @property
    def rightly_empty(self) -> bool:
        """Whether nothing was to be found, and nothing was: scores are 0/0 then."""
        return not (self.tp or self.fp or self.fn)

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.tp + other.tp,
            self.fp + other.fp,
            self.fn + other.fn,
            self.tn + other.tn,
            self.ignored + other.ignored,
        )


def count(predicted: Mask, truth: Mask, ignore: Mask | None = None) -> Counts:
    """Compare two bool (H, W) masks pixel by pixel, leaving out `ignore`."""
    ignored = 0
    if ignore is not None and ignore.any():
        ignored = int(np.count_nonzero(ignore))
        predicted, truth = predicted & ~ignore, truth & ~ignore
    tp = int(np.count_nonzero(predicted & truth))
    fp = int(np.count_nonzero(predicted)) - tp
    fn = int(np.count_nonzero(truth)) - tp
    return Counts(tp, fp, fn, truth.size - ignored - tp - fp - fn, ignored)


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


def _distance_to(mask: Mask) -> npt.NDArray[np.float32]:
    away = (~mask).view(np.uint8)
    distance = cv2.distanceTransform(away, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(distance, np.float32)
