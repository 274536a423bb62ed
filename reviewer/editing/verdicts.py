"""Give a verdict on a region: an audit record, and a final mask that follows it."""

from __future__ import annotations

from reviewer.evaluation.counting import refresh_counts
from reviewer.pipeline.stages import follow_verdicts
from reviewer.records import Verdict
from reviewer.store.database import Store
from reviewer.store.reviews import add_audit


def give_verdict(
    store: Store, region_id: int, annotator_id: int, verdict: Verdict, comment: str = ""
) -> tuple[int, int]:
    """Record a verdict and recompose the pair's final mask; return (run id, pair id).

    Raises:
        NotFound, InvalidInput, Conflict: as `store.reviews.add_audit`.
    """
    run_id, pair_id = add_audit(store, region_id, annotator_id, verdict, comment)
    follow_verdicts(store, run_id, pair_id)
    refresh_counts(store, pair_id)
    return run_id, pair_id
