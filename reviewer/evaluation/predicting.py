"""How well a score tells right from wrong: AUROC, AUPRC, risk-coverage, reliability, bootstrap.

Scores say how likely an error is; errors are bool. Confidence intervals resample whole pairs, since
regions of one pair share an image and an alignment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

RESAMPLES = 1000


@dataclass(frozen=True, slots=True)
class Interval:
    """A figure with its 95 % bootstrap interval; NaN where it is undefined."""

    value: float
    low: float
    high: float


def auroc(scores: Floats, errors: Bools) -> float:
    """Return the probability that an error has a higher score than a non-error; ties count half."""
    wrong, right = scores[errors], np.sort(scores[~errors])
    if not len(wrong) or not len(right):
        return float("nan")
    below = np.searchsorted(right, wrong, "left")
    level = np.searchsorted(right, wrong, "right")
    return float((below + level).mean() / (2 * len(right)))


def average_precision(scores: Floats, errors: Bools) -> float:
    """Return the area under the precision-recall curve as the mean precision at each error.

    Regions of one score count together, so their order does not matter.
    """
    if not errors.any():
        return float("nan")
    order = np.argsort(-scores, kind="stable")
    hits, ends = np.cumsum(errors[order]), np.flatnonzero(np.diff(scores[order], append=np.nan))
    precision = hits[ends] / (ends + 1)
    recall = hits[ends] / errors.sum()
    return float(np.sum(np.diff(recall, prepend=0.0) * precision))


def risk_coverage(scores: Floats, risks: Floats) -> tuple[Floats, Floats]:
    """Return coverage and the mean risk of the covered, most trusted (lowest score) first.

    Of equal scores none is trusted before the other: they share their mean risk.
    """
    order = np.argsort(scores, kind="stable")
    values, first, counts = np.unique(scores[order], return_index=True, return_counts=True)
    del values
    sums = np.add.reduceat(risks[order], first) if len(first) else np.zeros(0)
    shared = np.repeat(sums / np.maximum(counts, 1), counts)
    covered = np.arange(1, len(scores) + 1)
    return covered / max(len(scores), 1), np.cumsum(shared) / covered


def area_under_risk_coverage(scores: Floats, risks: Floats) -> float:
    """Return AURC: the mean over all coverages of the risk of the covered (Geifman, El-Yaniv)."""
    if not len(scores):
        return float("nan")
    return float(risk_coverage(scores, risks)[1].mean())


def reliability(scores: Floats, errors: Bools, bins: int = 10) -> list[tuple[float, float, int]]:
    """Return (mean score, share of errors, count) of equally wide bins that hold anything."""
    place = np.minimum((scores * bins).astype(int), bins - 1)
    return [
        (float(scores[here].mean()), float(errors[here].mean()), int(here.sum()))
        for here in (place == k for k in range(bins))
        if here.any()
    ]


def calibration_error(scores: Floats, errors: Bools, bins: int = 10) -> float:
    """Return the expected calibration error: mean |score - share of errors|, weighted by count."""
    rows = reliability(scores, errors, bins)
    if not rows:
        return float("nan")
    return sum(n * abs(score - share) for score, share, n in rows) / len(scores)


def bootstrap(
    figure: Callable[[npt.NDArray[np.int64]], float],
    pairs: npt.NDArray[np.int64],
    *,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Return a figure with the interval that resampling pairs gives.

    Args:
        figure: computed on the places of some regions (with repetitions).
        pairs: the pair of every region.
    """
    everyone = np.arange(len(pairs))
    members = [everyone[pairs == pair] for pair in np.unique(pairs)]
    rng = np.random.default_rng(seed)
    values = []
    for _ in range(resamples if members else 0):
        chosen = rng.integers(0, len(members), len(members))
        values.append(figure(np.concatenate([members[k] for k in chosen])))
    known = np.array([value for value in values if not np.isnan(value)])
    low, high = np.quantile(known, (0.025, 0.975)) if len(known) else (np.nan, np.nan)
    return Interval(figure(everyone), float(low), float(high))
