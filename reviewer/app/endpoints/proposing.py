"""Endpoints of what is proposed: masks of every source, labels, pictures of what was found."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from reviewer.app.endpoints import messages as m
from reviewer.app.endpoints.details import pair_detail
from reviewer.app.endpoints.fields import Key
from reviewer.editing.proposals import list_proposals
from reviewer.editing.ranking import Proposal
from reviewer.editing.relabel import Relabelling
from reviewer.found.thumbnails import draw_thumbnail
from reviewer.store.database import Store
from reviewer.store.finds import find_of_region
from reviewer.store.pairs import pair_of_id
from reviewer.store.reviews import annotator_id
from reviewer.store.runs import run_or_newest
from reviewer.words import ProposalSource


def build_proposing(store: Store) -> APIRouter:
    """Return the router of proposals, labels and finds."""
    router = APIRouter()
    relabelling = Relabelling(store)

    @router.get("/pairs/{pair_id}/proposals")
    def get_proposals(
        pair_id: m.Id,
        source: Annotated[list[ProposalSource], Query(max_length=20)],
        run: Key | None = None,
    ) -> list[m.ProposalInfo]:
        """The masks that a run proposes for a pair, the likeliest change first; near duplicates of
        several sources are one."""
        pair = pair_of_id(store, pair_id)
        found = list_proposals(store, pair, run_or_newest(store, run), source)
        return [proposal_info(proposal) for proposal in found]

    @router.put("/pairs/{pair_id}/labels/{number}")
    def put_label(
        request: Request, pair_id: m.Id, number: m.Number, change: m.LabelChange
    ) -> m.PairDetail:
        """Write over a label, or add one more; the answer is the pair, searched again."""
        pair, chosen = pair_of_id(store, pair_id), run_or_newest(store, change.run)
        person = annotator_id(store, str(request.state.annotator))
        relabelling.edit(chosen, pair, number, change.label, person)
        return pair_detail(store, pair_id, person, chosen)

    @router.get(
        "/found/{region_id}.jpg",
        response_class=Response,
        responses={200: {"content": {"image/jpeg": {}}}},
    )
    def get_thumbnail(region_id: m.Id) -> Response:
        """A small picture of something that was found."""
        picture = draw_thumbnail(store, find_of_region(store, region_id))
        headers = {"Cache-Control": "private, max-age=3600"}
        return Response(picture, media_type="image/jpeg", headers=headers)

    return router


def proposal_info(proposal: Proposal) -> m.ProposalInfo:
    """Return a proposal as the API shows it."""
    return m.ProposalInfo(
        key=proposal.key,
        source=proposal.source,
        run=proposal.run,
        number=proposal.number,
        label=proposal.label,
        score=proposal.score,
        region_id=proposal.region_id,
        area=proposal.mask.area,
        box_xyxy=_xyxy(proposal.mask.box_xywh),
        counts=proposal.mask.counts,
        outcome=proposal.outcome,
        likelihood=round(proposal.likelihood, 4),
        also=list(proposal.also),
    )


def _xyxy(box: tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    x, y, width, height = box
    return x, y, x + width, y + height
