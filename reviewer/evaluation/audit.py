"""The audit of a run: its decisions against those that leave fewer wrong pixels, and DoI as a
predictor of the detector's errors."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from reviewer.evaluation.agreement import Agreement, agreement
from reviewer.evaluation.predictors import (
    Predictor,
    SeenRegions,
    detector_spoke,
    predict_errors,
)
from reviewer.metrics import Counts
from reviewer.store.audit_rows import AuditRow
from reviewer.words import CHOICES, Choice, Seen

SIZES = ((0, "< 8²"), (64, "< 16²"), (256, "< 32²"), (1024, ">= 32²"))
EITHER = "either"
DECIDED: dict[Seen, tuple[Choice, ...]] = {
    "keep": ("adopt", "keep"),
    "reject": CHOICES,
}
"""What a rule decides between."""


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
        predictors, seen: see `predictors.predict_errors`.
    """

    regions: int
    counted: int
    confusion: list[dict[str, Any]]
    groups: list[dict[str, Any]]
    verdicts: list[dict[str, Any]]
    people: Agreement
    predictors: tuple[Predictor, ...]
    seen: SeenRegions

    def record(self) -> dict[str, Any]:
        """Return it as plain JSON values: what is not defined is None."""
        record: dict[str, Any] = _without_nan(asdict(self))
        return record


def audit_report(rows: Sequence[AuditRow], seen: Seen = "keep") -> AuditReport:
    """Return the report of the regions of a run, decided as `seen` says where f_b = 0.

    Where that is "reject", the best decision may be to reject as well.
    """
    rows = [_decided(row, seen) for row in rows]
    counted = [row for row in rows if "adopt" in row.outcomes and detector_spoke(row)]
    pairs = Counter((row.choice, oracle_choice(row, seen)) for row in counted)
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
    groups = [group for way, key in ways.items() for group in _grouped(way, counted, key, seen)]
    said = Counter((row.verdict, row.choice, row.verdict_reason) for row in rows if row.verdict)
    verdicts = [
        {"verdict": verdict, "decision": choice, "reason": reason or "-", "regions": number}
        for (verdict, choice, reason), number in sorted(said.items())
    ]
    people = agreement([row.opinions for row in rows])
    predictors, seen_regions = predict_errors(rows)
    return AuditReport(
        len(rows), len(counted), confusion, groups, verdicts, people, predictors, seen_regions
    )


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(each) for each in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def oracle_choice(row: AuditRow, seen: Seen = "keep") -> str:
    """Return the decision that leaves fewest wrong pixels in the region, or "either" where several
    do."""
    wrong = {choice: _wrong(row.outcomes[choice]) for choice in DECIDED[seen]}
    best = [choice for choice, pixels in wrong.items() if pixels == min(wrong.values())]
    return best[0] if len(best) == 1 else EITHER


def _decided(row: AuditRow, seen: Seen) -> AuditRow:
    return replace(row, choice=seen) if row.reason == "seen_in_reference" else row


def _wrong(counts: Counts) -> int:
    return counts.fp + counts.fn


def _lost(row: AuditRow, seen: Seen) -> int:
    """Pixels that the oracle's decision would have got right."""
    best = min(_wrong(row.outcomes[choice]) for choice in DECIDED[seen])
    return _wrong(row.outcomes[row.choice]) - best


def _size(row: AuditRow) -> str:
    adopt = row.outcomes["adopt"]
    area = adopt.tp + adopt.fp
    return next(title for least, title in reversed(SIZES) if area >= least)


def _grouped(
    way: str, rows: Sequence[AuditRow], key: Callable[[AuditRow], str], seen: Seen
) -> list[dict[str, Any]]:
    groups: dict[str, list[AuditRow]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    found = []
    in_order = [title for _, title in SIZES] if way == "size" else sorted(groups)
    for name in (name for name in in_order if name in groups):
        members = groups[name]
        losses = [_lost(row, seen) for row in members]
        right, lost = losses.count(0), sum(losses)
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
