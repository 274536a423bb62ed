"""The audit's queue: which regions of a run wait for a verdict, and in which order."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from reviewer.metrics import Counts
from reviewer.store.database import Store
from reviewer.store.skips import NOT_SKIPPED
from reviewer.words import Opinion, WalkOrder

# Per region: pixels that are wrong after its decision, and after the other one. What the store does
# not have is given beside it, and goes first: stored outcomes may be of another integration.
WRONG = """coalesce(
    (SELECT u.wrong_px FROM unsaved u WHERE u.region_id = g.id AND u.outcome = {0}),
    (SELECT sum(o.fp + o.fn) FROM region_outcomes o
        WHERE o.region_id = g.id AND o.revision = t.number AND o.outcome = {0}))"""
FLIPPED = "CASE g.choice WHEN 'keep' THEN 'adopt' ELSE 'keep' END"
ORDERS: dict[WalkOrder, str] = {
    # One with f_b = 0 has DoI 0 whatever its IoU: those come after, fewest shared pixels first.
    "threshold": "f_b DESC, CASE WHEN f_b THEN abs(doi - :high) ELSE overlap_px END",
    "loss": "gain_px DESC NULLS LAST",
    "disagreement": "opposed DESC, drawn DESC, CASE WHEN drawn THEN wrong_px END DESC,"
    " f_b DESC, abs(doi - :high)",
}


@dataclass(frozen=True, slots=True)
class DoubtfulRegion:
    """A region that waits for a verdict.

    Attributes:
        gain_px: pixels that would be right if its decision were flipped, less those that would be
            wrong; None without ground truth or without anything to flip to.
        opposed: somebody's verdict goes against the rule's decision, or people disagree.
    """

    id: int
    pair_id: int
    split: str
    pair: str
    doi: float
    gain_px: int | None
    opposed: bool


def list_doubtful(
    store: Store,
    run_id: int,
    high: float,
    limit: int,
    *,
    order: WalkOrder = "threshold",
    opinion: Opinion = "first",
    annotator_id: int = 0,
    unsaved: Mapping[int, Mapping[str, Counts]] = MappingProxyType({}),
) -> list[DoubtfulRegion]:
    """Return the regions of a run that wait for a verdict, most doubtful first.

    Orders: "threshold" by the distance of DoI to `high`; "loss" by what flipping the decision
    gains; "disagreement" first where a verdict opposes the decision or another verdict, then where
    the mask that a person drew does, most wrong pixels first. The last two need counted outcomes:
    stored ones (`evaluation.outcomes.refresh_terms`), or `unsaved` by region and outcome.

    Opinions: "first" are regions that nobody judged, "second" those that others judged, and the
    annotator did not.
    """
    judged = "EXISTS (SELECT 1 FROM opinions a WHERE a.region_id = g.id AND a.annotator_id {} :me)"
    waits = (
        "NOT EXISTS (SELECT 1 FROM opinions a WHERE a.region_id = g.id)"
        if opinion == "first"
        else f"{judged.format('<>')} AND NOT {judged.format('=')}"
    )
    # Three decisions make this query what it is. `opinions` holds each person's newest verdict that
    # stands, so a verdict that was taken back leaves its region waiting again. Outcomes are joined
    # by the revision that counts now (in WRONG): after a new revision, old counts give NULL, which
    # `loss` sorts last, never a stale number. An imported mask has no annotator, so only masks that
    # a person drew oppose a decision in "disagreement". The id at the end makes the order total:
    # without it, equal regions could change places from one request to the next.
    rows = store.read().execute(
        f"""
        WITH unsaved AS MATERIALIZED (
            SELECT value ->> 0 AS region_id, value ->> 1 AS outcome, value ->> 2 AS wrong_px
            FROM json_each(:unsaved)
        ), waiting AS (
            SELECT g.id, g.pair_id, s.name AS split, p.name AS pair, g.doi, g.f_b, g.overlap_px,
                {WRONG.format("g.choice")} AS wrong_px,
                {WRONG.format(FLIPPED)} AS flipped_px,
                EXISTS (SELECT 1 FROM opinions e WHERE e.region_id = g.id
                    AND e.outcome <> g.choice) AS opposed,
                t.annotator_id IS NOT NULL AS drawn
            FROM regions g JOIN pairs p ON p.id = g.pair_id JOIN splits s ON s.id = p.split_id
            LEFT JOIN ground_truth t ON t.pair_id = g.pair_id
            WHERE g.run_id = :run AND g.{NOT_SKIPPED} AND {waits}
        ), weighed AS (SELECT *, wrong_px - flipped_px AS gain_px FROM waiting)
        SELECT id, pair_id, split, pair, doi, gain_px, opposed FROM weighed
        ORDER BY {ORDERS[order]}, id LIMIT :limit
        """,
        {
            "run": run_id,
            "me": annotator_id,
            "high": high,
            "limit": limit,
            "unsaved": json.dumps(
                [
                    [region_id, outcome, counts.fp + counts.fn]
                    for region_id, outcomes in unsaved.items()
                    for outcome, counts in outcomes.items()
                ]
            ),
        },
    )
    return [
        DoubtfulRegion(
            row["id"],
            row["pair_id"],
            row["split"],
            row["pair"],
            row["doi"],
            row["gain_px"],
            bool(row["opposed"]),
        )
        for row in rows
    ]
