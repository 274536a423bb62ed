"""Give a verdict on a region: an audit record, and a final mask that follows it."""

from __future__ import annotations

from threading import Lock

from reviewer.evaluation.counting import refresh_counts
from reviewer.masks import encode_rle
from reviewer.pipeline.stored import compose_audited
from reviewer.records import Verdict
from reviewer.store.database import Store
from reviewer.store.regions import region_of_id
from reviewer.store.reviews import add_audit

# Two verdicts on one pair must not both start from the state before either.
_ONE_AT_A_TIME = Lock()


def give_verdict(
    store: Store,
    region_id: int,
    annotator_id: int,
    verdict: Verdict,
    *,
    reason: str = "",
    comment: str = "",
) -> tuple[int, int]:
    """Record a verdict together with the recomposed final mask; return (run id, pair id).

    Raises:
        NotFound: when the region does not exist.
        Conflict: when "adopt" is said of a region that has no object.
    """
    run_id, pair_id = region_of_id(store, region_id)
    with _ONE_AT_A_TIME:
        mask = compose_audited(store, run_id, pair_id, {region_id: verdict})
        final = encode_rle(mask)
        add_audit(store, region_id, annotator_id, verdict, final, reason=reason, comment=comment)
    refresh_counts(store, pair_id)
    return run_id, pair_id
