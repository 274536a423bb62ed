"""Who may come in: token link -> signed cookie, and Host and Origin checks on every request.

The cookie carries the annotator's name under an HMAC keyed by the token, so a server restarted with
the same `--token` knows its people. Viser and the API sit behind this guard; only the sign-in page
and its style are open. Scripts send `Authorization: Bearer TOKEN`, and their name in `X-Annotator`.
"""

from __future__ import annotations

import base64
import hashlib
import hmac
import ipaddress
import re
import secrets
import time
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from reviewer.errors import InvalidInput
from reviewer.store.reviews import clean_name

OPEN_PATHS = ("/sign-in", "/static/sign-in.css", "/favicon.ico")
SIGNED_IN_SECONDS = 30 * 86400
SIGN_IN_BYTES = 10_000
BODY_BYTES = 2**20
POINTING_BYTES = 4 * 2**20
LARGEST_BODY_BYTES = 64 * 2**20
SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}


def is_loopback(host: str) -> bool:
    """Say whether an address or name stays on this machine."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True, slots=True)
class Access:
    """The token, the names this server answers to, and the cookie's name."""

    token: str
    hosts: frozenset[str]
    cookie: str

    @classmethod
    def create(cls, host: str, port: int, token: str | None, allow_hosts: list[str]) -> Access:
        """Make the access rules of a server.

        Raises:
            InvalidInput: when a host beyond this machine is asked for without a token.
        """
        if token is None and not is_loopback(host):
            raise InvalidInput(
                f"--host {host}: can be reached by others, so give a --token of your own"
                " (or stay on 127.0.0.1 and use ssh -L)"
            )
        if token is not None and len(token) < 8:
            raise InvalidInput("--token: needs at least 8 characters")
        named = {host, *allow_hosts} - {"0.0.0.0", "::"}
        return cls(token or secrets.token_urlsafe(18), frozenset(named), f"reviewer_{port}")

    def issue(self, name: str) -> str:
        """Return the cookie value of an annotator."""
        payload = base64.urlsafe_b64encode(f"{time.time():.0f} {name}".encode()).decode()
        return f"{payload}.{self._sign(payload)}"

    def annotator(self, connection: HTTPConnection) -> str | None:
        """Return the annotator's name of a request, None when it is not signed in.

        Raises:
            InvalidInput: when a script's name is none.
        """
        bearer = connection.headers.get("authorization", "")
        if bearer.startswith("Bearer "):
            # Headers come as Latin-1; what people wrote into them was UTF-8.
            if hmac.compare_digest(bearer[7:].encode("latin-1"), self.token.encode()):
                name = connection.headers.get("x-annotator", "script")
                return clean_name(name.encode("latin-1").decode("utf-8", "replace"))
            return None
        payload, _, signature = connection.cookies.get(self.cookie, "").partition(".")
        if not hmac.compare_digest(signature.encode(), self._sign(payload).encode()):
            return None
        issued, _, name = base64.urlsafe_b64decode(payload).decode().partition(" ")
        return name if time.time() - float(issued) < SIGNED_IN_SECONDS else None

    def knows_token(self, token: str) -> bool:
        """Compare a token in constant time."""
        return hmac.compare_digest(token.encode(), self.token.encode())

    def knows_host(self, header: str) -> bool:
        """Say whether a Host header names this server; loopback names may come by any port."""
        host = _host_of(f"//{header}")
        return is_loopback(host) or host in self.hosts

    def _sign(self, payload: str) -> str:
        return hmac.new(self.token.encode(), payload.encode(), hashlib.sha256).hexdigest()


def same_origin(headers: Headers, *, required: bool) -> bool:
    """Say whether a request comes from our own page; without an Origin only if not `required`."""
    origin = headers.get("origin")
    if origin is None:
        return not required
    scheme, _, address = origin.partition("://")
    return scheme in ("http", "https") and address == headers.get("host")


def _largest_body(path: str) -> int:
    """Return the bytes that a request to a path may send; the mask's endpoint looks closer."""
    if path in OPEN_PATHS:
        return SIGN_IN_BYTES
    if re.fullmatch(r"/api/pairs/\d+/mask", path):
        return LARGEST_BODY_BYTES
    return POINTING_BYTES if path.endswith("/click") else BODY_BYTES


def _host_of(address: str) -> str:
    try:
        return urlsplit(address).hostname or ""
    except ValueError:  # such as an opened bracket without its end
        return ""


class Guard:
    """ASGI middleware that lets through what `Access` allows and answers the rest itself."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self.app = app
        self.access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check Host, Origin and session, in that order."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        try:
            annotator = self.access.annotator(connection)
            refusal = self._refuse(connection, scope, annotator)
        except InvalidInput as error:
            refusal = problem(error.status, str(error))
        if refusal is None:
            scope.setdefault("state", {})["annotator"] = annotator
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            await refusal(scope, receive, send)

    def _refuse(
        self, connection: HTTPConnection, scope: Scope, annotator: str | None
    ) -> Response | None:
        headers = connection.headers
        host = headers.get("host", "")
        if not self.access.knows_host(host):
            return problem(421, f"host {host!r}: is not this server; see --allow-host")
        bearer = "authorization" in headers
        socket = scope["type"] == "websocket"
        unsafe = socket or scope["method"] not in SAFE_METHODS
        if unsafe and not same_origin(headers, required=not bearer):
            return problem(403, f"origin {headers.get('origin')!r}: is not this server")
        path = scope["path"]
        limit = _largest_body(path)
        # Without either header there is no body.
        length = headers.get("content-length", "" if "transfer-encoding" in headers else "0")
        if not socket and not (length.isdigit() and int(length) <= limit):
            return problem(413, f"request body: needs a Content-Length of at most {limit} bytes")
        if path in OPEN_PATHS:
            return None
        if annotator is None:
            wants_page = not socket and "text/html" in headers.get("accept", "")
            if wants_page and not bearer:
                query = scope["query_string"].decode("latin-1")
                return RedirectResponse(f"/sign-in?{query}" if query else "/sign-in", 303)
            return problem(401, "not signed in: open the link with the token, or send it as Bearer")
        return None


def problem(status: int, detail: str, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """Return an error as problem-JSON (RFC 9457)."""
    # What is told back may hold half a character, which UTF-8 cannot say.
    detail = detail.encode(errors="backslashreplace").decode()
    return JSONResponse(
        {"type": "about:blank", "status": status, "detail": detail},
        status,
        headers=headers,
        media_type="application/problem+json",
    )
