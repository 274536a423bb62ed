"""HTTP endpoints of the workbench and of scripts; typed, described at /api/openapi.json.

Endpoints are plain functions, so FastAPI runs them on its thread pool and the event loop stays
free. Who asks is known from the guard (`access`).
"""

from __future__ import annotations

import re
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, ValidationError

from reviewer.app.endpoints import messages as m
from reviewer.app.endpoints.auditing import build_auditing
from reviewer.app.endpoints.details import (
    choose_run,
    mask_reply,
    no_mask,
    pair_detail,
    truth_info,
)
from reviewer.app.endpoints.fields import Key, Word
from reviewer.app.endpoints.kept_pictures import PictureCache
from reviewer.app.endpoints.opening import build_opening
from reviewer.app.endpoints.pictures import draw_layer
from reviewer.app.endpoints.pointing import build_pointing
from reviewer.app.endpoints.proposing import build_proposing
from reviewer.app.endpoints.skips import build_skipping
from reviewer.app.endpoints.sweeping import build_sweeping
from reviewer.caching import cache_folder
from reviewer.editing.clicks import Clicks
from reviewer.editing.commit import (
    MaskEdit,
    change_state,
    commit_mask,
    largest_body,
    mask_of_counts,
    mask_of_png,
)
from reviewer.errors import InvalidInput, TooLarge
from reviewer.masks import Rle, decode_rle, empty_rle, encode_png
from reviewer.records import Image, Pair
from reviewer.store import runs
from reviewer.store.database import Store
from reviewer.store.pairs import pair_of_id
from reviewer.store.queue import list_progress, list_queue
from reviewer.store.reviews import annotator_id, known_annotator
from reviewer.store.revisions import list_revisions, newest_revision, revision_of_number
from reviewer.store.stages_done import pair_overview
from reviewer.words import PairLayer

PNG: dict[str, Any] = {"image/png": {"schema": {"type": "string", "format": "binary"}}}


def _inlined(model: type[BaseModel]) -> dict[str, Any]:
    """Return a model's JSON schema without references, for places FastAPI does not fill in."""
    schema = model.model_json_schema()
    definitions = schema.pop("$defs", {})

    def resolve(node: Any) -> Any:
        if isinstance(node, list):
            return [resolve(item) for item in node]
        if not isinstance(node, dict):
            return node
        if "$ref" in node:
            return resolve(definitions[node["$ref"].rpartition("/")[2]])
        return {key: resolve(value) for key, value in node.items()}

    resolved: dict[str, Any] = resolve(schema)
    return resolved


MASK_REPLY: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "0/255 PNG, or run-lengths with `Accept: application/json`",
        "content": {**PNG, "application/json": {"schema": _inlined(m.MaskReply)}},
    }
}
MASK_BODY = {
    "requestBody": {
        "required": True,
        "content": {**PNG, "application/json": {"schema": _inlined(m.MaskChange)}},
    }
}
PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {
        "description": text,
        "content": {"application/problem+json": {"schema": _inlined(m.Problem)}},
    }
    for status, text in {
        400: "the body cannot be parsed",
        401: "not signed in",
        403: "a change from another page",
        404: "no such pair, run, layer or region",
        409: "made from a revision that is not the newest",
        413: "the body is too large, or does not tell its length",
        421: "the Host header names another server",
        422: "the input breaks a rule",
        423: "finished and locked",
        503: "the database cannot be read or written as things are",
        507: "the disk is full",
    }.items()
}


def _who(request: Request) -> str:
    return str(request.state.annotator)


Annotator = Annotated[str, Depends(_who)]
ETAG: dict[str, Any] = {"pattern": r'^(W/)?"?[0-9]{1,9}"?$'}
IfMatch = Annotated[str | None, Header(max_length=80, json_schema_extra=ETAG)]
Id = m.Id


def build_api(store: Store, clicks: Clicks) -> APIRouter:
    """Return the router of all endpoints under /api."""
    router = APIRouter(prefix="/api", responses=PROBLEMS)
    router.include_router(build_pointing(store, clicks))
    router.include_router(build_proposing(store))
    router.include_router(build_opening(store))
    router.include_router(build_auditing(store))
    router.include_router(build_skipping(store))
    router.include_router(build_sweeping(store))
    pictures = PictureCache(cache_folder("pictures"))

    @router.get("/me")
    def me(annotator: Annotator) -> m.Me:
        """Who is signed in, and which segmenter answers clicks."""
        return m.Me(annotator=annotator, clicks=clicks.model_id)

    @router.get("/runs")
    def list_runs() -> list[m.RunInfo]:
        """All runs, oldest first."""
        return [
            m.RunInfo(
                id=run.id,
                name=run.name,
                aligner=run.aligner,
                detector=run.detector,
                segmenter=run.segmenter,
            )
            for run in runs.list_runs(store)
        ]

    @router.get("/splits")
    def list_splits(annotator: Annotator) -> list[m.SplitProgress]:
        """All splits with the annotator's progress."""
        return [
            m.SplitProgress(name=p.split, pairs=p.pairs, finished=p.finished)
            for p in list_progress(store, known_annotator(store, annotator))
        ]

    @router.get("/pairs")
    def list_pairs(annotator: Annotator, query: Annotated[m.QueueQuery, Query()]) -> m.PairPage:
        """A page of the queue."""
        run = choose_run(store, query.run)
        entries, total = list_queue(
            store,
            known_annotator(store, annotator),
            run_id=run.id if run else None,
            split=query.split,
            state=query.state,
            team=query.team,
            order=query.order,
            search=query.search,
            limit=query.limit,
            offset=query.offset,
        )
        rows = [m.PairSummary.model_validate(entry, from_attributes=True) for entry in entries]
        return m.PairPage(total=total, pairs=rows)

    @router.get("/pairs/{pair_id}")
    def get_pair(annotator: Annotator, pair_id: Id, run: Key | None = None) -> m.PairDetail:
        """A pair with its layers, regions and scores."""
        person = known_annotator(store, annotator)
        return pair_detail(store, pair_id, person, choose_run(store, run))

    @router.get(
        "/pairs/{pair_id}/layers/{layer}.png",
        response_class=Response,
        responses={200: {"content": PNG}},
    )
    def get_layer(
        pair_id: Id,
        layer: PairLayer,
        run: Key | None = None,
        v: Word | None = None,
        judged: bool = True,
        level: Annotated[int, Query(ge=0, le=5)] = 0,
    ) -> Response:
        """A layer as PNG; with `v` (the pair's version) the browser may keep it; `judged=false`
        shows what the rule decided, without people's verdicts; each `level` halves its size."""
        pair, chosen = pair_of_id(store, pair_id), choose_run(store, run)
        version = pair_overview(store, chosen.id, pair_id).version if chosen else "0"
        if layer == "ground_truth":
            newest = newest_revision(store, pair_id)
            version = f"r{newest.number if newest else 0}"
        step = min(2**level, pair.live.height, pair.live.width)
        files = pair.reference, pair.live
        key = (pair_id, layer, version, judged, step, *map(_last_change, files))
        picture = pictures.get(key)
        if picture is None:
            hashes = [file.sha256 for file in files]
            named = (store.identity, chosen.id if chosen else 0, *key, *hashes)
            picture = pictures.recall(named) if step > 1 else None
            if picture is None:
                picture = draw_layer(store, pair, chosen, layer, judged=judged, step=step)
                if step > 1:
                    pictures.keep(named, picture)
            pictures.put(key, picture)
        keep = "private, max-age=86400" if v == version else "no-store"
        return Response(picture, media_type="image/png", headers={"Cache-Control": keep})

    @router.get("/pairs/{pair_id}/mask", response_class=Response, responses=MASK_REPLY)
    def get_mask(request: Request, pair_id: Id) -> Response:
        """The newest ground truth with its revision as ETag; revision 0 is all-zero."""
        pair, newest = pair_of_id(store, pair_id), newest_revision(store, pair_id)
        reply = mask_reply(newest) if newest else no_mask(pair)
        headers = {"ETag": f'"{reply.revision}"', "Cache-Control": "no-store"}
        if "application/json" in request.headers.get("accept", ""):
            body = reply.model_dump_json()
            return Response(body, media_type="application/json", headers=headers)
        mask = newest.mask if newest else empty_rle(pair.live.height, pair.live.width)
        return Response(encode_png(decode_rle(mask)), media_type="image/png", headers=headers)

    @router.put("/pairs/{pair_id}/mask", openapi_extra=MASK_BODY)
    async def put_mask(
        request: Request,
        response: Response,
        annotator: Annotator,
        pair_id: Id,
        if_match: IfMatch = None,
    ) -> m.Committed:
        """Commit a mask made from the revision in If-Match: 409 when there is a newer one."""
        parent, kind = _revision(if_match), request.headers.get("content-type", "")
        pair = await run_in_threadpool(pair_of_id, store, pair_id)
        length, most = int(request.headers.get("content-length", "0")), largest_body(pair)
        if length > most:
            raise TooLarge(
                f"pair {pair.title}: a mask of its size takes at most {most} bytes, not {length}"
            )
        body = await request.body()

        def commit() -> int:
            edit = _read_edit(pair, kind, body, parent)
            return commit_mask(store, pair_id, annotator_id(store, annotator), edit)

        number = await run_in_threadpool(commit)
        response.headers["ETag"] = f'"{number}"'
        return m.Committed(revision=number)

    @router.get("/pairs/{pair_id}/revisions")
    def get_revisions(pair_id: Id) -> list[m.RevisionInfo]:
        """The history of a pair's ground truth, oldest first."""
        pair_of_id(store, pair_id)
        return [
            m.RevisionInfo(
                number=r.number,
                source=r.source,
                annotator=r.annotator,
                area=r.mask.area,
                active_seconds=r.active_seconds,
                created_at=r.created_at,
                tools=[str(action.get("tool", "?")) for action in r.tool_log],
            )
            for r in list_revisions(store, pair_id)
        ]

    @router.get("/pairs/{pair_id}/revisions/{number}")
    def get_revision(pair_id: Id, number: Id) -> m.MaskReply:
        """One revision of a pair's ground truth."""
        return mask_reply(revision_of_number(store, pair_id, number))

    @router.put("/pairs/{pair_id}/state")
    def put_state(
        annotator: Annotator,
        pair_id: Id,
        change: m.StateChange,
        if_match: IfMatch = None,
    ) -> m.StateReply:
        """Set the annotator's state of a pair; If-Match names the revision that was looked at."""
        seen = None if if_match is None else _revision(if_match)
        pair_of_id(store, pair_id)  # only who changes something becomes an annotator
        person = annotator_id(store, annotator)
        change_state(store, pair_id, person, change.state, seen, change.active_seconds)
        newest = newest_revision(store, pair_id)
        return m.StateReply(
            state=change.state,
            revision=newest.number if newest else 0,
            truth=truth_info(store, pair_id),
        )

    return router


def _last_change(image: Image) -> int:
    """Return a value that changes when a file is replaced, so that no old picture is served."""
    return image.path.stat().st_mtime_ns if image.path.exists() else 0


def _revision(if_match: str | None) -> int:
    found = re.fullmatch(r'(?:W/)?"?(\d{1,9})"?', if_match or "")
    if not found:
        raise InvalidInput(
            f"If-Match {if_match!r}: must hold the revision the mask was made from, as its ETag"
        )
    return int(found[1])


def _read_edit(pair: Pair, content_type: str, body: bytes, parent: int) -> MaskEdit:
    kind = content_type.partition(";")[0].strip()
    if kind == "image/png":
        return MaskEdit(mask_of_png(pair, body), parent, source="api")
    if kind != "application/json":
        raise InvalidInput(f"Content-Type {kind!r}: send image/png or application/json")
    try:
        change = m.MaskChange.model_validate_json(body)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InvalidInput(f"mask {place}: {first['msg']}") from error
    height, width = change.mask.height, change.mask.width
    ignore: Rle | None = None
    if change.ignore is not None:
        ignore = mask_of_counts(pair, height, width, change.ignore)
    return MaskEdit(
        mask_of_counts(pair, height, width, change.mask.counts),
        parent,
        ignore=ignore,
        active_seconds=change.active_seconds,
        tool_log=change.tool_log,
    )
