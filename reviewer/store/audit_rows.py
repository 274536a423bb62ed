"""Regions as an audit counts them: the decision, what each outcome would give, what people said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from reviewer.metrics import Counts
from reviewer.store.database import Store
from reviewer.store.skips import NOT_SKIPPED
from reviewer.words import Verdict


@dataclass(frozen=True, slots=True)
class AuditRow:
    """A region with its outcomes.

    Attributes:
        choice: the rule's decision.
        outcomes: counts inside the region by outcome.
        verdict: the newest one a person gave; `verdict_reason` why, "" where nothing was said.
        opinions: what every person's newest verdict makes of it: adopt, keep or reject.
    """

    region_id: int
    pair_id: int
    split: str
    labels: str
    reason: str
    choice: str
    doi: float
    f_b: int
    verdict: Verdict | None
    outcomes: Mapping[str, Counts]
    verdict_reason: str = ""
    opinions: tuple[str, ...] = ()


def pairs_with_verdict(store: Store, verdicts: Sequence[str], run_id: int | None) -> set[int]:
    """Return the pairs with a region whose newest verdict is one of these, in a run or in any."""
    marks = ", ".join("?" * len(verdicts))
    rows = store.read().execute(
        "SELECT DISTINCT g.pair_id FROM regions g JOIN doi_decisions d ON d.region_id = g.id"
        f" WHERE d.verdict IN ({marks}) AND g.run_id = coalesce(?, g.run_id)",
        [*verdicts, run_id],
    )
    return {row["pair_id"] for row in rows}


def audit_rows(store: Store, run_id: int) -> list[AuditRow]:
    """Return the regions of a run whose outcomes are counted, by id (`refresh_terms` first); those
    of skipped pairs were rejected for the pair's sake, and are left out."""
    said: dict[int, list[str]] = {}
    for row in store.read().execute(
        "SELECT region_id, outcome FROM opinions WHERE run_id = ? ORDER BY annotator", [run_id]
    ):
        said.setdefault(row["region_id"], []).append(row["outcome"])
    rows = store.read().execute(
        "SELECT g.id, g.pair_id, d.split, coalesce(d.labels, '') AS labels, g.reason, g.choice,"
        " g.doi, g.f_b, d.verdict, coalesce(d.verdict_reason, '') AS verdict_reason,"
        " o.outcome, o.tp, o.fp, o.fn FROM regions g"
        " JOIN doi_decisions d ON d.region_id = g.id"
        " JOIN region_outcomes o ON o.region_id = g.id"
        " JOIN ground_truth t ON t.pair_id = g.pair_id AND t.number = o.revision"
        f" WHERE g.run_id = ? AND g.{NOT_SKIPPED} ORDER BY g.id, o.outcome",
        [run_id],
    )
    found: dict[int, AuditRow] = {}
    outcomes: dict[int, dict[str, Counts]] = {}
    for row in rows:
        own = outcomes.setdefault(row["id"], {})
        own[row["outcome"]] = Counts(row["tp"], row["fp"], row["fn"])
        if row["id"] not in found:
            found[row["id"]] = AuditRow(
                row["id"],
                row["pair_id"],
                row["split"],
                row["labels"],
                row["reason"],
                row["choice"],
                row["doi"],
                row["f_b"],
                row["verdict"],
                own,
                row["verdict_reason"],
                tuple(said.get(row["id"], ())),
            )
    return list(found.values())
