"""The endpoint that records which tiles of a pair a person has looked at from close by."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import Field

from reviewer.app.endpoints import messages as m
from reviewer.app.endpoints.details import sweep_info
from reviewer.store.database import Store
from reviewer.store.pairs import pair_of_id
from reviewer.store.reviews import annotator_id
from reviewer.store.sweeps import note_swept


class SweptTile(m.Message):
    """A tile that was looked at from close by; tiles count row by row from the top left."""

    tile: Annotated[int, Field(ge=0, le=10_000)]


def build_sweeping(store: Store) -> APIRouter:
    """Return the router of sweeps."""
    router = APIRouter()

    @router.put("/pairs/{pair_id}/sweep")
    def put_sweep(request: Request, pair_id: m.Id, change: SweptTile) -> m.SweepInfo:
        """Note that a tile was swept; the answer is what the annotator has swept of the pair."""
        # Only who changes something becomes an annotator.
        pair = pair_of_id(store, pair_id)
        who = annotator_id(store, str(request.state.annotator))
        return sweep_info(note_swept(store, pair, who, change.tile))

    return router
