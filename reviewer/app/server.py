"""Start the app: store, Viser shell and gateway, on one port."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

import uvicorn

from reviewer.app.desks import Desks
from reviewer.app.door.access import Access
from reviewer.app.door.gateway import build_gateway
from reviewer.app.shell import Shell
from reviewer.caching import cache_folder
from reviewer.editing.clicks import Clicks
from reviewer.errors import InvalidInput
from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.registry import build_click_segmenter
from reviewer.store.database import Store
from reviewer.store.integrity import require_whole

LARGEST_MESSAGE = 64 * 2**20


def serve_app(
    db: Path,
    *,
    host: str,
    port: int,
    token: str | None,
    allow_hosts: list[str],
    click: str,
    proxies: Sequence[str] = (),
) -> None:
    """Serve until interrupted; print the sign-in link first. Port 0 takes a free one.

    Args:
        proxies: addresses of reverse proxies, whose word for the person's address and for HTTPS
            is taken.
        click: the click segmenter, NAME or NAME:PATH.

    Raises:
        InvalidInput: when the host needs a token, the port is taken, or the click segmenter cannot
            be loaded.
        NotFound: when the database does not exist.
        Damaged: when a page of it is damaged.
    """
    segmenter = build_click_segmenter(click)
    with _listen(host, port) as listener, Store(db) as store:
        require_whole(store)
        number = listener.getsockname()[1]
        access = Access.create(host, number, token, allow_hosts)
        desks = Desks(store)
        shell = Shell(desks)
        clicks = Clicks(store, EmbeddingCache(segmenter, cache_folder("embeddings")))
        app = build_gateway(store, access, desks, clicks, shell.port, on_stop=shell.stop)
        shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host
        print(f"reviewer: http://{shown}:{number}/sign-in#token={quote(access.token)}", flush=True)
        config = uvicorn.Config(
            app,
            log_level="warning",
            proxy_headers=bool(proxies),
            forwarded_allow_ips=list(proxies),
            ws="websockets-sansio",
            ws_max_size=LARGEST_MESSAGE,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=2,
        )
        uvicorn.Server(config).run(sockets=[listener])


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        raise InvalidInput(
            f"--host {host} --port {port}: {error.strerror}; choose another --port"
        ) from error
    listener.listen(128)
    listener.set_inheritable(True)
    return listener
