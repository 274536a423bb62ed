"""The endpoint that opens a pair: everything the workbench shows first, in one answer."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response

from reviewer.app.endpoints import messages as m
from reviewer.app.endpoints.details import choose_run, newest_mask, pair_detail
from reviewer.app.endpoints.fields import Key
from reviewer.app.endpoints.proposing import proposal_info
from reviewer.editing.proposals import list_proposals
from reviewer.store.database import Store
from reviewer.store.pairs import pair_of_id
from reviewer.store.reviews import known_annotator
from reviewer.words import ProposalSource

Sources = Annotated[Sequence[ProposalSource], Query(max_length=20)]
IfNoneMatch = Annotated[str | None, Header(max_length=80)]


def build_opening(store: Store) -> APIRouter:
    """Return the router of what opens a pair."""
    router = APIRouter()

    @router.get("/pairs/{pair_id}/open", response_model=m.OpenedPair)
    def open_pair(
        request: Request,
        pair_id: m.Id,
        source: Sources = (),
        run: Key | None = None,
        proposals_of: Key | None = None,
        if_none_match: IfNoneMatch = None,
    ) -> Response:
        """A pair, its newest ground truth and its proposals, all as they were at one moment; the
        proposals of another run with `proposals_of`. 304 where If-None-Match has the ETag."""
        pair = pair_of_id(store, pair_id)
        with store.snapshot():
            person = known_annotator(store, str(request.state.annotator))
            chosen = choose_run(store, run)
            proposing = choose_run(store, proposals_of) if proposals_of else chosen
            found = list_proposals(store, pair, proposing, source) if proposing else []
            opened = m.OpenedPair(
                pair=pair_detail(store, pair_id, person, chosen),
                mask=newest_mask(store, pair),
                proposals=[proposal_info(proposal) for proposal in found],
            )
        # Checked when it was made; FastAPI would check it again, while a person waits.
        body = opened.model_dump_json()
        tag = f'"{hashlib.blake2b(body.encode(), digest_size=12).hexdigest()}"'
        headers = {"ETag": tag, "Cache-Control": "private, no-cache"}
        if if_none_match == tag:
            return Response(status_code=304, headers=headers)
        return Response(body, media_type="application/json", headers=headers)

    return router
