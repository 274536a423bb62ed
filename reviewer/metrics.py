"""Pixel counts -> precision, recall, F-score: the only place where these are computed.

Counts are integers and add up, so every protocol is arithmetic on stored counts. The 0/0 rule is
named: with `zero_over_zero=0.0` (the default) a score without any positive is 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from reviewer.masks import Mask


@dataclass(frozen=True, slots=True)
class Counts:
    """Pixels by outcome; `ignored` pixels are left out of the other four."""

    tp: int = 0
    fp: int = 0
    fn: int = 0
    tn: int = 0
    ignored: int = 0

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
