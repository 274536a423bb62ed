"""The audit of a run: its decisions against those that leave fewer wrong pixels, and DoI as a
predictor of the detector's errors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from reviewer.evaluation.agreement import Agreement, agreement
from reviewer.evaluation.predicting import (
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
from reviewer.store.audited import AuditRow

SIZES = ((0, "< 8²"), (64, "< 16²"), (256, "< 32²"), (1024, ">= 32²"))
LEAST_IOU = 0.5
EITHER = "either"


@dataclass(frozen=True, slots=True)
class Predictor:
    """DoI as a predictor of detector errors, over regions in which the detector said something.

    Attributes:
        regions, errors: how many, and in how many the detector's pixels have IoU < 0.5 with the
            truth inside the region.
        auroc, auprc: DoI as the score of an error.
        aurc: mean risk (1 - IoU) of the regions that DoI trusts most, over all coverages;
            `aurc_best` and `aurc_random` are those of a perfect and of a useless order.
        ece: expected calibration error of DoI as the chance of an error.
        bins: (mean DoI, share of errors, count).
        curve: (coverage, risk), at most a hundred points.
    """

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
class AuditReport:
    """What an audit says of a run.

    Attributes:
        regions: judged regions; `counted` those with an object and with components, where there is
            something to decide.
        confusion: rows of decision, oracle decision, count.
        groups: rows of grouping, group, regions, agreeing, pixels that the oracle saves.
        verdicts: rows of verdict, decision, reason that was given, count.
        people: how far people agree, over regions that two or more judged.
    """

    regions: int
    counted: int
    confusion: list[dict[str, Any]]
    groups: list[dict[str, Any]]
    verdicts: list[dict[str, Any]]
    people: Agreement
    predictor: Predictor

    def record(self) -> dict[str, Any]:
        """Return it as plain JSON values: what is not defined is None."""
        record: dict[str, Any] = _without_nan(asdict(self))
        return record


def audit_report(rows: Sequence[AuditRow]) -> AuditReport:
    """Return the report of the regions of a run."""
    counted = [row for row in rows if "adopt" in row.outcomes and _said(row)]
    pairs = Counter((row.choice, oracle_choice(row)) for row in counted)
    confusion = [
        {"decision": choice, "oracle": best, "regions": number}
        for (choice, best), number in sorted(pairs.items())
    ]
    ways: dict[str, Callable[[AuditRow], str]] = {
        "split": lambda row: row.split,
        "label": lambda row: row.labels or "none",
        "size": _size,
        "reason": lambda row: row.reason,
    }
    groups = [group for way, key in ways.items() for group in _grouped(way, counted, key)]
    said = Counter((row.verdict, row.choice, row.verdict_reason) for row in rows if row.verdict)
    verdicts = [
        {"verdict": verdict, "decision": choice, "reason": reason or "-", "regions": number}
        for (verdict, choice, reason), number in sorted(said.items())
    ]
    people = agreement([row.opinions for row in rows])
    predictor = predict_errors(rows)
    return AuditReport(len(rows), len(counted), confusion, groups, verdicts, people, predictor)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(each) for each in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def oracle_choice(row: AuditRow) -> str:
    """Return adopt or keep, whichever leaves fewer wrong pixels in the region, or "either"."""
    adopt, keep = _wrong(row.outcomes["adopt"]), _wrong(row.outcomes["keep"])
    if adopt == keep:
        return EITHER
    return "adopt" if adopt < keep else "keep"


def predict_errors(rows: Sequence[AuditRow]) -> Predictor:
    """Return how well DoI tells where the detector is wrong."""
    said = [row for row in rows if _said(row)]
    doi = np.array([row.doi for row in said], np.float64)
    risk = np.array([1.0 - _iou(row.outcomes["keep"]) for row in said], np.float64)
    errors = risk > 1.0 - LEAST_IOU
    pairs = np.array([row.pair_id for row in said], np.int64)
    coverage, covered_risk = risk_coverage(doi, risk)
    step = max(1, len(coverage) // 100)
    return Predictor(
        len(said),
        int(errors.sum()),
        bootstrap(lambda k: auroc(doi[k], errors[k]), pairs),
        bootstrap(lambda k: average_precision(doi[k], errors[k]), pairs),
        bootstrap(lambda k: area_under_risk_coverage(doi[k], risk[k]), pairs),
        area_under_risk_coverage(risk, risk),
        float(risk.mean()) if len(risk) else float("nan"),
        bootstrap(lambda k: calibration_error(doi[k], errors[k]), pairs),
        tuple(reliability(doi, errors)),
        tuple(zip(coverage[::step].tolist(), covered_risk[::step].tolist(), strict=True)),
    )


def _said(row: AuditRow) -> bool:
    """Whether the detector has pixels in the region that are scored."""
    keep = row.outcomes["keep"]
    return keep.tp + keep.fp > 0


def _wrong(counts: Counts) -> int:
    return counts.fp + counts.fn


def _lost(row: AuditRow) -> int:
    """Pixels that the oracle's decision would have had right."""
    return _wrong(row.outcomes[row.choice]) - min(
        _wrong(row.outcomes["adopt"]), _wrong(row.outcomes["keep"])
    )


def _iou(counts: Counts) -> float:
    either = counts.tp + counts.fp + counts.fn
    return counts.tp / either if either else 0.0


def _size(row: AuditRow) -> str:
    adopt = row.outcomes["adopt"]
    area = adopt.tp + adopt.fp
    return next(title for least, title in reversed(SIZES) if area >= least)


def _grouped(
    way: str, rows: Sequence[AuditRow], key: Callable[[AuditRow], str]
) -> list[dict[str, Any]]:
    groups: dict[str, list[AuditRow]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    found = []
    in_order = [title for _, title in SIZES] if way == "size" else sorted(groups)
    for name in (name for name in in_order if name in groups):
        members = groups[name]
        best = [oracle_choice(row) for row in members]
        right = sum(b in (EITHER, row.choice) for b, row in zip(best, members, strict=True))
        lost = sum(_lost(row) for row in members)
        found.append(
            {
                "by": way,
                "group": name,
                "regions": len(members),
                "right": right,
                "share": right / len(members),
                "pixels lost": lost,
            }
        )
    return found
