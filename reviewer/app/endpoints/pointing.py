"""Endpoints behind the pointing tools: clicks, edge paths, and points of the reference image."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from reviewer.app.endpoints import click_messages as m
from reviewer.app.endpoints.details import choose_run
from reviewer.app.endpoints.fields import Key
from reviewer.app.endpoints.messages import Id
from reviewer.editing.clicks import ClickRequest, Clicks
from reviewer.editing.pictures import live_point, load_pictures
from reviewer.errors import Conflict, InvalidInput
from reviewer.masks import decode_rle, encode_rle, read_rle
from reviewer.models.clicks.scissors import Scissors
from reviewer.models.interfaces import Candidate, Click, Prompt
from reviewer.records import Pair
from reviewer.store.database import Store
from reviewer.store.pairs import pair_of_id
from reviewer.words import Side

LOOK_UP_SECONDS = 0.2
Pixel = Annotated[int, Query(ge=0, le=20000)]


def build_pointing(store: Store, clicks: Clicks) -> APIRouter:
    """Return the router of the pointing tools."""
    router = APIRouter()
    scissors = Scissors()

    @router.post("/pairs/{pair_id}/click", response_model=m.ClickReply)
    async def post_click(request: Request, pair_id: Id, change: m.ClickChange) -> Response:
        """Find the object under clicks or in a box; 409 when a newer click took its place."""
        asked = await asyncio.to_thread(_read, store, pair_id, change)
        client = (request.state.annotator, change.client)
        future = clicks.find(client, asked, preview=change.preview)
        answer = asyncio.wrap_future(future)
        try:
            while not (await asyncio.wait([answer], timeout=LOOK_UP_SECONDS))[0]:
                if await request.is_disconnected():
                    raise Conflict("click: nobody waits for it any more")
            found = answer.result()
        except asyncio.CancelledError as error:
            raise Conflict("click: a newer one took its place") from error
        finally:
            future.cancel()
        reply = m.ClickReply(
            candidates=[
                m.CandidateMask(counts=encode_rle(c.mask).counts, score=c.score)
                for c in found.candidates
            ],
            model=clicks.model_id,
            embed_ms=found.embed_ms,
            predict_ms=found.predict_ms,
        )
        # Checked when it was made; FastAPI would check it again, while a person waits.
        return Response(reply.model_dump_json(), media_type="application/json")

    @router.get("/pairs/{pair_id}/live-point")
    def get_live_point(
        pair_id: Id,
        x: m.Coordinate,
        y: m.Coordinate,
        run: Key | None = None,
    ) -> m.LivePoint:
        """Where a point of the reference image lies in the live image, both in pixels."""
        pair = pair_of_id(store, pair_id)
        there = live_point(store, pair, choose_run(store, run), x, y)
        return m.LivePoint(x=there[0], y=there[1])

    @router.get("/pairs/{pair_id}/edge-path")
    def get_edge_path(
        pair_id: Id,
        x0: Pixel,
        y0: Pixel,
        x1: Pixel,
        y1: Pixel,
        picture: Side = "live",
        run: Key | None = None,
    ) -> m.EdgePath:
        """The path between two pixels that follows edges (intelligent scissors)."""
        pair, chosen = pair_of_id(store, pair_id), choose_run(store, run)
        for name, x, y in (("start", x0, y0), ("end", x1, y1)):
            _check_inside(pair, name, x, y)
        points = scissors.path(
            (pair_id, picture, chosen.id if chosen else 0),
            lambda: load_pictures(store, pair, chosen, picture).image,
            (x0, y0),
            (x1, y1),
        )
        return m.EdgePath(points=points)

    return router


def _read(store: Store, pair_id: int, change: m.ClickChange) -> ClickRequest:
    """Check a click against its pair.

    Raises:
        InvalidInput: without a click or a box, or when one lies outside the image.
    """
    pair = pair_of_id(store, pair_id)
    if not change.clicks and change.box is None:
        raise InvalidInput("clicks: give a click or a box")
    for number, click in enumerate(change.clicks):
        _check_inside(pair, f"clicks.{number}", click.x, click.y)
    if change.box is not None:
        x0, y0, x1, y1 = change.box
        _check_inside(pair, "box", x0, y0)
        _check_inside(pair, "box", x1, y1)
        if x1 - x0 < 1 or y1 - y0 < 1:
            raise InvalidInput("box: needs x0, y0, x1, y1 at least a pixel apart")
    best = None
    if change.previous is not None:
        rle = read_rle(pair.live.height, pair.live.width, change.previous.counts)
        best = Candidate(decode_rle(rle), change.previous.score)
    prompt = Prompt(
        tuple(Click(click.x, click.y, click.positive) for click in change.clicks),
        change.box,
        best.mask if best else None,
    )
    run = choose_run(store, change.run)
    return ClickRequest(pair_id, run, change.picture, prompt, best, change.crop)


def _check_inside(pair: Pair, name: str, x: float, y: float) -> None:
    if x > pair.live.width or y > pair.live.height:
        size = f"{pair.live.width}x{pair.live.height}"
        raise InvalidInput(f"{name}: ({x:g}, {y:g}) lies outside the image of {size}")
