"""Viser through the one public port: its page, and its WebSocket.

Viser listens on a free loopback port and checks no origin; the guard has done that before a request
comes here. Its page takes `?websocket=` and `?playbackPath=`, which could point it at a stranger's
server, so both are refused.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

import httpx
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

CONTENT_SECURITY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:;"
    " worker-src 'self' blob: data:; style-src 'self' 'unsafe-inline';"
    " img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' data: blob:;"
    " frame-src 'self'; frame-ancestors 'self'; base-uri 'none'; object-src 'none'"
)

# Our styles hide Viser's own control panel and dock grips from the first paint on.
PAGE_HEAD = b"""<link rel="stylesheet" href="/static/tokens.css">
<link rel="stylesheet" href="/static/shell.css">
<script type="module" src="/static/js/shell/main.js"></script>
<title>reviewer</title></head>"""


class ViserProxy:
    """Serves the Viser client that listens on a loopback port."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._page: tuple[bytes, str] | None = None

    async def page(self, request: Request) -> Response:
        """Return Viser's page with our style and script in it."""
        if {"websocket", "playbackPath"} & set(request.query_params):
            return PlainTextResponse("websocket and playbackPath are not allowed here", 400)
        if self._page is None:
            async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{self._port}") as client:
                reply = await client.get("/")
            page = reply.content.replace(b"</head>", PAGE_HEAD, 1)
            self._page = page, reply.headers["content-type"]
        body, kind = self._page
        headers = {"Content-Security-Policy": CONTENT_SECURITY, "Cache-Control": "no-store"}
        return Response(body, media_type=kind, headers=headers)

    async def socket(self, public: WebSocket) -> None:
        """Pass messages both ways until one side closes."""
        protocols = [Subprotocol(name) for name in public.scope["subprotocols"]]
        async with connect(
            f"ws://127.0.0.1:{self._port}/",
            subprotocols=protocols or None,
            compression=None,
            max_size=None,
            max_queue=64,
            proxy=None,
            ping_interval=None,
        ) as viser:
            await public.accept(subprotocol=viser.subprotocol)
            await _first_of(lambda: _outwards(viser, public), lambda: _inwards(public, viser))
            with suppress(RuntimeError, WebSocketDisconnect):
                await public.close(viser.close_code or 1000)


async def _inwards(public: WebSocket, viser: ClientConnection) -> None:
    while True:
        message = await public.receive()
        if message["type"] == "websocket.disconnect":
            return
        data = message.get("bytes")
        await viser.send(message["text"] if data is None else data)


async def _outwards(viser: ClientConnection, public: WebSocket) -> None:
    async for message in viser:
        if isinstance(message, str):
            await public.send_text(message)
        else:
            await public.send_bytes(message)


async def _first_of(*works: Callable[[], Awaitable[None]]) -> None:
    """Run all until the first ends; a closed connection is an end like any other."""
    tasks = [asyncio.ensure_future(work()) for work in works]
    await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in tasks:
        task.cancel()
    for outcome in await asyncio.gather(*tasks, return_exceptions=True):
        expected = (ConnectionClosed, WebSocketDisconnect, asyncio.CancelledError, RuntimeError)
        if isinstance(outcome, BaseException) and not isinstance(outcome, expected):
            raise outcome
