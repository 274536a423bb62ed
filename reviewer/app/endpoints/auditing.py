"""Endpoints of the audit: regions that wait for a verdict, verdicts, the list of reasons."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request

from reviewer.app.endpoints import messages as m
from reviewer.app.endpoints.details import pair_detail
from reviewer.editing.verdicts import Given, change_standing, give_verdict
from reviewer.evaluation.outcomes import Unsaved
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store import runs
from reviewer.store.audit_queue import list_doubtful
from reviewer.store.database import Store
from reviewer.store.reasons import list_reasons, set_reasons
from reviewer.store.regions import region_of_id
from reviewer.store.reviews import annotator_id, known_annotator


class JudgedPair(m.PairDetail):
    """A pair after a verdict, and the verdict's key, by which it can be taken back."""

    audit: int


class StandingChange(m.Message):
    """Whether a verdict stands, or is taken back."""

    stands: bool


def build_auditing(store: Store) -> APIRouter:
    """Return the router of the audit."""
    router, unsaved = APIRouter(), Unsaved(store)

    def judged_pair(given: Given, who: int) -> JudgedPair:
        detail = pair_detail(store, given.pair_id, who, runs.run_of_id(store, given.run_id))
        return JudgedPair(audit=given.audit, **dict(detail))

    @router.get("/audit-queue")
    def get_audit_queue(
        request: Request, query: Annotated[m.WalkQuery, Query()]
    ) -> list[m.DoubtfulRegionInfo]:
        """The regions of a run that wait for a first or a second opinion, most doubtful first."""
        chosen = runs.run_or_newest(store, query.run)
        found = list_doubtful(
            store,
            chosen.id,
            PipelineSettings.of_record(chosen.settings).high,
            query.limit,
            order=query.order,
            opinion=query.opinion,
            annotator_id=known_annotator(store, str(request.state.annotator)),
            unsaved=unsaved.of_run(chosen) if query.order != "threshold" else {},
        )
        return [
            m.DoubtfulRegionInfo(
                region=region.id,
                pair=region.pair_id,
                split=region.split,
                name=region.pair,
                doi=region.doi,
                gain_px=region.gain_px,
                opposed=region.opposed,
            )
            for region in found
        ]

    @router.post("/regions/{region_id}/audit")
    def post_audit(request: Request, region_id: m.Id, change: m.VerdictChange) -> JudgedPair:
        """Give a verdict on a region; the answer is the pair with its new prediction."""
        region_of_id(store, region_id)  # only who changes something becomes an annotator
        who = annotator_id(store, str(request.state.annotator))
        given = give_verdict(
            store, region_id, who, change.verdict, reason=change.reason, comment=change.comment
        )
        return judged_pair(given, who)

    @router.put("/audits/{audit_id}")
    def put_audit(request: Request, audit_id: m.Id, change: StandingChange) -> JudgedPair:
        """Take one's own verdict back, or give it again; the answer is the pair as it is then."""
        who = known_annotator(store, str(request.state.annotator))
        return judged_pair(change_standing(store, audit_id, who, stands=change.stands), who)

    @router.get("/reasons")
    def get_reasons() -> m.Reasons:
        """The reasons that are offered with a verdict."""
        return m.Reasons(reasons=list_reasons(store))

    @router.put("/reasons")
    def put_reasons(change: m.Reasons) -> m.Reasons:
        """Put another list in place of the old one; verdicts keep the words they took."""
        set_reasons(store, change.reasons)
        return m.Reasons(reasons=list_reasons(store))

    return router
