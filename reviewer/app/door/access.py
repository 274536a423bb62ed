"""Access control: the token or a session, and Host and Origin checks on every request.

Viser and the API sit behind this guard; only the sign-in page with its style and script is open.
People are known by their session (`sessions`); scripts send `Authorization: Bearer TOKEN`, and
their name in `X-Annotator`.
"""

from __future__ import annotations

import hmac
import ipaddress
import logging
import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from reviewer.app.door.sessions import Sessions
from reviewer.errors import InvalidInput, ReviewerError
from reviewer.store.reviews import clean_name

LOG = logging.getLogger(__name__)
OPEN_PATHS = ("/sign-in", "/static/sign-in.css", "/static/sign-in.js", "/favicon.ico")
LEAST_HERE, LEAST_BEYOND = 8, 16
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
            InvalidInput: when others can reach it and no token is given, or one that is too short.
        """
        others = not all(is_loopback(name) for name in (host, *allow_hosts))
        if token is None and not is_loopback(host):
            raise InvalidInput(
                f"--host {host}: can be reached by others, so give a token of your own with"
                " REVIEWER_TOKEN or --token-file (or stay on 127.0.0.1 and use ssh -L)"
            )
        least = LEAST_BEYOND if others else LEAST_HERE
        if token is not None and len(token) < least:
            raise InvalidInput(
                f"token: needs at least {least} characters"
                + (" where others can reach it" if others else "")
                + f", not {len(token)}; `openssl rand -base64 24` makes one"
            )
        named = {host, *allow_hosts} - {"0.0.0.0", "::"}
        return cls(token or secrets.token_urlsafe(18), frozenset(named), f"reviewer_{port}")

    def script(self, headers: Headers) -> str | None:
        """Return the name a script goes by, None when it does not know the token.

        Raises:
            InvalidInput: when its name is none.
        """
        # Headers come as Latin-1; what people wrote into them was UTF-8.
        token = headers.get("authorization", "").removeprefix("Bearer ").encode("latin-1")
        if not hmac.compare_digest(token, self.token.encode()):
            return None
        name = headers.get("x-annotator", "script")
        return clean_name(name.encode("latin-1").decode("utf-8", "replace"))

    def knows_token(self, token: str) -> bool:
        """Compare a token in constant time."""
        return hmac.compare_digest(token.encode(), self.token.encode())

    def knows_host(self, header: str) -> bool:
        """Say whether a Host header names this server; loopback names may come by any port."""
        host = _host_of(f"//{header}")
        return is_loopback(host) or host in self.hosts


def _is_script(headers: Headers) -> bool:
    """Say whether a request brings a token; a proxy may add other kinds of authorization."""
    return headers.get("authorization", "").startswith("Bearer ")


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

    def __init__(self, app: ASGIApp, access: Access, sessions: Sessions) -> None:
        self.app = app
        self.access = access
        self.sessions = sessions

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check Host, Origin and session, in that order."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        session = connection.cookies.get(self.access.cookie, "")
        try:
            annotator = self._annotator(connection, session)
            refusal = self._refuse(connection, scope, annotator)
        except ReviewerError as error:
            refusal = problem(error.status, str(error))
        if refusal is None:
            if scope["type"] == "websocket" and not _is_script(connection.headers):
                receive, send = self.sessions.guarded(session, receive, send)
            scope.setdefault("state", {})["annotator"] = annotator
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})
        else:
            await refusal(scope, receive, send)

    def _annotator(self, connection: HTTPConnection, session: str) -> str | None:
        """Return who asks: a script with the token, or a person who is signed in."""
        if _is_script(connection.headers):
            name = self.access.script(connection.headers)
            if name is None:
                # Told, but not made to wait: over an SSH tunnel everybody has one address.
                address = connection.client.host if connection.client else "unknown"
                LOG.warning("request from %s: wrong token", address)
            return name
        return self.sessions.annotator(session)

    def _refuse(
        self, connection: HTTPConnection, scope: Scope, annotator: str | None
    ) -> Response | None:
        headers = connection.headers
        host = headers.get("host", "")
        if not self.access.knows_host(host):
            return problem(421, f"host {host!r}: is not this server; see --allow-host")
        bearer = _is_script(headers)
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
