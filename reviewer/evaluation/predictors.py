"""DoI as a predictor of detector errors, beside the trivial one: that no object touches the region.

A region without an object has DoI 1 by the 0/0 rule of IoU, so over all regions DoI answers two
questions at once: whether there is an object, and how far it and the detector disagree. Each
question has a line of its own here. Called by the audit's report; `predicting` has the statistics.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reviewer.evaluation.predicting import (
    Bools,
    Floats,
    Interval,
    area_under_risk_coverage,
    auroc,
    average_precision,
    bootstrap,
    calibration_error,
    reliability,
    risk_coverage,
)
from reviewer.metrics import Counts
from reviewer.store.audit_rows import AuditRow

LEAST_IOU = 0.5
MOST_POINTS = 100


@dataclass(frozen=True, slots=True)
class Predictor:
    """A score as a predictor of detector errors, over regions with detected pixels.

    Attributes:
        title: which score, over which regions.
        regions, errors: how many, and in how many the detector's pixels have IoU < 0.5 with the
            truth inside the region.
        auroc, auprc: the score as that of an error.
        aurc: mean risk (1 - IoU) of the regions that it trusts most, over all coverages;
            `aurc_best` and `aurc_random` are those of a perfect and of a useless order.
        ece: expected calibration error of the score as the chance of an error.
        bins: (mean score, share of errors, count).
        curve: (coverage, risk), at most two hundred points.
    """

    title: str
    regions: int
    errors: int
    auroc: Interval
    auprc: Interval
    aurc: Interval
    aurc_best: float
    aurc_random: float
    ece: Interval
    bins: tuple[tuple[float, float, int], ...]
    curve: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class SeenRegions:
    """Regions with f_b = 0: DoI is 0 for all of them, so it cannot tell them apart.

    Attributes:
        share: of them in which the detector is wrong; NaN where there is none.
    """

    regions: int
    errors: int
    share: float


def detector_spoke(row: AuditRow) -> bool:
    """Say whether the detector has pixels in the region that are scored."""
    keep = row.outcomes["keep"]
    return keep.tp + keep.fp > 0


def predict_errors(rows: Sequence[AuditRow]) -> tuple[tuple[Predictor, ...], SeenRegions]:
    """Return DoI as a predictor over all regions, those with an object, and those of them with
    f_b = 1; the baseline over all regions; and what became of those with f_b = 0. A region of
    which nothing can be compared is in none of them."""
    rows = [row for row in rows if detector_spoke(row) and row.reason != "outside_warp"]
    doi = np.array([row.doi for row in rows], np.float64)
    touched = np.array(["adopt" in row.outcomes for row in rows], np.bool_)
    new = np.array([row.f_b == 1 for row in rows], np.bool_)
    risk = np.array([1.0 - _iou(row.outcomes["keep"]) for row in rows], np.float64)
    pairs = np.array([row.pair_id for row in rows], np.int64)
    everything = np.ones(len(rows), np.bool_)
    judged = (
        ("DoI, all regions", doi, everything),
        ("DoI, regions with an object", doi, touched),
        ("DoI, with an object and f_b = 1", doi, touched & new),
        ("no object touches it, all regions", (~touched).astype(np.float64), everything),
    )
    predictors = tuple(
        _predictor(title, score[here], risk[here], pairs[here]) for title, score, here in judged
    )
    wrong = int(np.count_nonzero(_errors(risk[~new])))
    seen = int(np.count_nonzero(~new))
    return predictors, SeenRegions(seen, wrong, wrong / seen if seen else float("nan"))


def _predictor(title: str, score: Floats, risk: Floats, pairs: np.ndarray) -> Predictor:
    errors = _errors(risk)
    coverage, covered_risk = risk_coverage(score, risk)
    step = max(1, len(coverage) // MOST_POINTS)
    return Predictor(
        title,
        len(score),
        int(errors.sum()),
        bootstrap(lambda k: auroc(score[k], errors[k]), pairs),
        bootstrap(lambda k: average_precision(score[k], errors[k]), pairs),
        bootstrap(lambda k: area_under_risk_coverage(score[k], risk[k]), pairs),
        area_under_risk_coverage(risk, risk),
        float(risk.mean()) if len(risk) else float("nan"),
        bootstrap(lambda k: calibration_error(score[k], errors[k]), pairs),
        tuple(reliability(score, errors)),
        tuple(zip(coverage[::step].tolist(), covered_risk[::step].tolist(), strict=True)),
    )


def _errors(risk: Floats) -> Bools:
    return risk > 1.0 - LEAST_IOU


def _iou(counts: Counts) -> float:
    either = counts.tp + counts.fp + counts.fn
    return counts.tp / either if either else 0.0


def predictor_rows(predictors: Sequence[Predictor]) -> list[dict[str, str | int]]:
    """Return one row per predictor as text: each figure with its 95 % interval over pairs."""
    return [
        {
            "score, regions": found.title,
            "regions": found.regions,
            f"errors (IoU < {LEAST_IOU:g})": found.errors,
            "AUROC": _span(found.auroc),
            "AUPRC": _span(found.auprc),
            "AURC": _span(found.aurc),
            "best / random AURC": f"{found.aurc_best:.3f} / {found.aurc_random:.3f}",
            "calibration error": _span(found.ece),
        }
        for found in predictors
    ]


def seen_text(found: SeenRegions) -> str:
    """Return the line about regions with f_b = 0."""
    share = f", {found.share:.1%}" if found.regions else ""
    return (
        f"{found.regions} regions were seen in the reference (f_b = 0, so DoI is 0); the detector"
        f" is wrong in {found.errors} of them{share}"
    )


def _span(found: Interval) -> str:
    return f"{found.value:.3f} [{found.low:.3f}, {found.high:.3f}]"
