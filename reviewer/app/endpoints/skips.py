"""The endpoint that skips a pair which cannot be compared, and undoes that."""

from __future__ import annotations

from fastapi import APIRouter, Request

from reviewer.app.endpoints import messages as m
from reviewer.app.endpoints.details import choose_run, pair_detail
from reviewer.app.endpoints.fields import Cause, Key
from reviewer.editing.skipping import lift_skip, skip_pair
from reviewer.store.database import Store
from reviewer.store.pairs import pair_of_id
from reviewer.store.reviews import annotator_id
from reviewer.store.skips import BADLY_ALIGNED


class SkipChange(m.Message):
    """Skip a pair, its regions in this run (null: the newest) rejected; or take it up again."""

    skipped: bool = True
    run: Key | None = None
    reason: Cause = BADLY_ALIGNED


def build_skipping(store: Store) -> APIRouter:
    """Return the router of skips."""
    router = APIRouter()

    @router.put("/pairs/{pair_id}/skip")
    def put_skip(request: Request, pair_id: m.Id, change: SkipChange) -> m.PairDetail:
        """Skip a pair that cannot be compared, with all of its regions in the run rejected; or take
        it up again, with those rejections withdrawn."""
        # Only who changes something becomes an annotator.
        pair_of_id(store, pair_id)
        run = choose_run(store, change.run)
        who = annotator_id(store, str(request.state.annotator))
        if change.skipped:
            skip_pair(store, pair_id, who, run, change.reason)
        else:
            lift_skip(store, pair_id, who)
        return pair_detail(store, pair_id, who, run)

    return router
