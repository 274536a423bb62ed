"""Give a verdict on a region, or take it back: a record, and a final mask that follows it."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from threading import Lock

from reviewer.errors import Conflict
from reviewer.evaluation.counting import refresh_counts
from reviewer.masks import Rle, encode_rle
from reviewer.pipeline.stored import compose_audited
from reviewer.store.audits import (
    add_audit,
    audit_of_id,
    insert_withdrawals,
    put_audited,
    verdicts_if,
)
from reviewer.store.database import Store
from reviewer.store.regions import load_regions, region_of_id
from reviewer.words import Verdict

ONE_AT_A_TIME = Lock()
"""Two changes of one pair's verdicts must not both start from the state before either."""


@dataclass(frozen=True, slots=True)
class Given:
    """A verdict that was recorded: its key, and whose regions it is about."""

    audit: int
    run_id: int
    pair_id: int


def give_verdict(
    store: Store,
    region_id: int,
    annotator_id: int,
    verdict: Verdict,
    *,
    reason: str = "",
    comment: str = "",
) -> Given:
    """Record a verdict together with the recomposed final mask.

    Raises:
        NotFound: when the region does not exist.
        Conflict: when "adopt" is said of a region that has no object.
    """
    run_id, pair_id = region_of_id(store, region_id)
    with ONE_AT_A_TIME:
        final = encode_rle(compose_audited(store, run_id, pair_id, {region_id: verdict}))
        audit = add_audit(
            store, region_id, annotator_id, verdict, final, reason=reason, comment=comment
        )
    refresh_counts(store, pair_id)
    return Given(audit, run_id, pair_id)


def change_standing(store: Store, audit_id: int, annotator_id: int, *, stands: bool) -> Given:
    """Take back one's own verdict, or give it again; then the verdict before it holds again.

    Saying so twice changes nothing, so a request whose answer was lost may be sent again.

    Raises:
        NotFound: when there is no such verdict.
        Conflict: when it is another person's.
    """
    with ONE_AT_A_TIME:
        audit = audit_of_id(store, audit_id)
        if audit.annotator_id != annotator_id:
            raise Conflict(f"verdict {audit_id}: is another person's, who alone can take it back")
        if audit.stands != stands:
            others = verdicts_if(store, [audit_id], stands=stands)
            final = audited_mask(store, audit.run_id, audit.pair_id, others)

            def work(db: sqlite3.Connection) -> None:
                insert_withdrawals(db, [audit_id], annotator_id, withdrawn=not stands)
                put_audited(db, audit.run_id, audit.pair_id, final)

            store.write(work)
    refresh_counts(store, audit.pair_id)
    return Given(audit_id, audit.run_id, audit.pair_id)


def audited_mask(
    store: Store, run_id: int, pair_id: int, verdicts: Mapping[int, Verdict | None]
) -> Rle | None:
    """Return the final mask with these verdicts in place of the stored ones, by region id; None
    where no region has one then."""
    regions = load_regions(store, run_id, pair_id)
    if all(verdicts.get(region.id, region.verdict) is None for region in regions):
        return None
    return encode_rle(compose_audited(store, run_id, pair_id, verdicts))
