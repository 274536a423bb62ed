"""The one public port: sign-in, API, workbench, static files, and the proxied Viser page."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI, Request, WebSocket
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, HTMLResponse, Response
from fastapi.staticfiles import StaticFiles
from pydantic import TypeAdapter, ValidationError
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.routing import compile_path
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketDisconnect

from reviewer.app.desks import Desk, Desks
from reviewer.app.door.access import Access, Guard, problem
from reviewer.app.door.attempts import Attempts
from reviewer.app.door.proxy import ViserProxy
from reviewer.app.door.sessions import Sessions
from reviewer.app.door.signing_in import build_signing_in
from reviewer.app.endpoints import frame_messages as frame
from reviewer.app.endpoints.api import build_api
from reviewer.app.endpoints.api_page import render_api_page
from reviewer.editing.clicks import Clicks
from reviewer.errors import InvalidInput, ReviewerError, tell_system_error
from reviewer.shipped import shipped_folder
from reviewer.store.database import Store
from reviewer.version import VERSION

LOG = logging.getLogger(__name__)
LARGEST_MESSAGE = 100_000
UNSUPPORTED_DATA, TOO_BIG = 1003, 1009
"""Codes that a WebSocket is closed with (RFC 6455)."""
FROM_FRAME: TypeAdapter[frame.FromFrame] = TypeAdapter(frame.FromFrame)
PAGE_SECURITY = (
    "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; script-src 'self';"
    " connect-src 'self'; frame-ancestors 'self'; base-uri 'none'; form-action 'self'"
)
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": PAGE_SECURITY,
}


def build_gateway(
    store: Store,
    access: Access,
    desks: Desks,
    clicks: Clicks,
    viser_port: int,
    on_stop: Callable[[], None] = lambda: None,
) -> FastAPI:
    """Return the ASGI application of the public port."""

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        yield
        await asyncio.to_thread(on_stop)
        await asyncio.to_thread(clicks.stop)

    app = FastAPI(
        title="reviewer",
        version=VERSION,
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
    )
    static = shipped_folder("static")
    proxy = ViserProxy(viser_port)
    sessions = Sessions(store, access.token)
    app.include_router(build_api(store, clicks))
    app.include_router(build_signing_in(access, sessions, static, Attempts()))
    _answer_errors(app)

    @app.get("/workbench", include_in_schema=False)
    def workbench() -> Response:
        return FileResponse(static / "workbench.html", headers={"Cache-Control": "no-store"})

    @app.get("/api/docs", include_in_schema=False)
    def api_docs() -> Response:
        return HTMLResponse(render_api_page(app.openapi(), static / "api-docs.html"))

    @app.get("/favicon.ico", include_in_schema=False)
    def favicon() -> FileResponse:
        return FileResponse(static / "icon.svg", media_type="image/svg+xml")

    @app.websocket("/api/desk")
    async def desk_socket(socket: WebSocket) -> None:
        await _serve_desk(socket, store, desks, clicks)

    @app.get("/", include_in_schema=False)
    async def viser_page(request: Request) -> Response:
        return await proxy.page(request)

    @app.websocket("/")
    async def viser_socket(socket: WebSocket) -> None:
        await proxy.socket(socket)

    app.mount("/static", _Static(directory=static), name="static")
    app.add_middleware(Guard, access=access, sessions=sessions)
    app.add_middleware(SafeHeaders)  # added last, it is outermost: the guard answers, too
    return app


class SafeHeaders:
    """ASGI middleware that adds the headers browsers need to be strict, where none are set."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on, with the headers on the way back."""

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers.setdefault(name, value)
            await send(message)

        await self.app(scope, receive, send_with_headers)


class _Static(StaticFiles):
    """Scripts, styles and pictures; the browser asks each time, so an update is seen at once.

    Pages are not served from here: they have routes of their own, with checks of their own.
    """

    async def get_response(self, path: str, scope: Scope) -> Response:
        if path.endswith(".html"):
            return problem(404, f"{path}: is not a static file")
        return await super().get_response(path, scope)

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        response = super().file_response(*args, **kwargs)
        response.headers["Cache-Control"] = "no-cache"
        return response


def _answer_errors(app: FastAPI) -> None:
    @app.exception_handler(ReviewerError)
    def reviewer_error(_: Request, error: ReviewerError) -> Response:
        return problem(error.status, str(error))

    @app.exception_handler(OSError)
    def system_error(request: Request, error: OSError) -> Response:
        told = tell_system_error(error)
        LOG.error("%s %s: %s", request.method, request.url.path, told)
        return problem(told.status, str(told))

    @app.exception_handler(HTTPException)
    def http_error(request: Request, error: HTTPException) -> Response:
        headers = dict(error.headers or {})
        if error.status_code == 405 and (methods := _methods(app, request.url.path)):
            headers["Allow"] = ", ".join(methods)
        return problem(error.status_code, str(error.detail), headers)

    @app.exception_handler(Exception)
    def unexpected(request: Request, error: Exception) -> Response:
        return problem(500, f"{request.method} {request.url.path}: {type(error).__name__}")

    @app.exception_handler(RequestValidationError)
    def validation_error(_: Request, error: RequestValidationError) -> Response:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        return problem(InvalidInput.status, f"{place}: {first['msg']}")


def _methods(app: FastAPI, path: str) -> list[str]:
    """Return what may be done at a path of the API; Starlette tells the first route's alone."""
    described = app.openapi()["paths"].items()
    return [
        method.upper()
        for template, about in described
        if compile_path(template)[0].match(path)
        for method in sorted(about)
    ]


async def _serve_desk(socket: WebSocket, store: Store, desks: Desks, clicks: Clicks) -> None:
    """Join a workbench frame with its desk, and pass messages.

    The guard has checked session, Host and Origin, and the frame takes its client's nonce from our
    own page around it, never from an address, so no link can unlock somebody else's client.
    """
    await socket.accept()
    try:
        joining = frame.Joining.model_validate(dict(socket.query_params))
    except ValidationError as error:
        await socket.send_json(frame.Failed(type="error", detail=str(error)))
        await socket.close(1008)
        return
    desk = (desks.find(joining.client) if joining.client else None) or Desk(store)
    loop = asyncio.get_running_loop()
    outbox: asyncio.Queue[frame.ToFrame] = asyncio.Queue()

    def send(message: frame.ToFrame) -> None:
        loop.call_soon_threadsafe(outbox.put_nowait, message)

    async def write() -> None:
        while True:
            await socket.send_json(await outbox.get())

    writer = asyncio.create_task(write())
    try:
        await asyncio.to_thread(desk.check_in, socket.state.annotator, send, joining)
        desks.enter(desk)
        while (text := await _next_text(socket)) is not None:
            try:
                await asyncio.to_thread(_handle, desk, clicks, FROM_FRAME.validate_json(text))
            except (ValidationError, ReviewerError) as error:
                send({"type": "error", "detail": str(error)})
            except Exception as error:
                LOG.exception("desk: could not do %s", text[:200])
                send({"type": "error", "detail": f"the server could not do that: {error}"})
    except WebSocketDisconnect:
        LOG.debug("desk of %s left", socket.state.annotator)
    finally:
        desks.leave(desk)
        writer.cancel()


async def _next_text(socket: WebSocket) -> str | None:
    """Return the next message; None after closing on a frame that cannot be one."""
    message = await socket.receive()
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1005))
    text: str | None = message.get("text")
    if text is None:
        await socket.close(UNSUPPORTED_DATA, "messages are JSON text")
    elif len(text) > LARGEST_MESSAGE:
        await socket.close(TOO_BIG, f"a message has at most {LARGEST_MESSAGE} characters")
        return None
    return text


def _handle(desk: Desk, clicks: Clicks, message: frame.FromFrame) -> None:
    """Do what the frame asks."""
    match message:
        case frame.Showing():
            ahead = desk.showing(message.pair)
            clicks.embed_ahead(id(desk), [message.pair, *ahead], desk.chosen_run)
        case frame.Step():
            desk.step(message.by)
        case frame.Changed():
            desk.redraw("change")
        case frame.RunChosen():
            desk.filter(run=message.run)
        case frame.ThemeChosen():
            desk.dark = message.dark
            desk.redraw("theme")
