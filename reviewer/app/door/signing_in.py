"""The sign-in page, and signing out.

The token travels in the fragment of the printed link, which no browser sends and no log keeps; the
page's script puts it into the form and takes it out of the address.
"""

from __future__ import annotations

import asyncio
import html
import logging
from pathlib import Path
from urllib.parse import parse_qsl, urlencode

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from reviewer.app.door.access import Access
from reviewer.app.door.attempts import Attempts
from reviewer.app.door.sessions import LASTS, Sessions
from reviewer.errors import InvalidInput

LOG = logging.getLogger(__name__)


def build_signing_in(
    access: Access, sessions: Sessions, static: Path, attempts: Attempts
) -> APIRouter:
    """Return the router of /sign-in and /sign-out."""
    router = APIRouter(include_in_schema=False)

    def page(name: str = "", told: str = "", status: int = 200) -> HTMLResponse:
        text = (static / "sign-in.html").read_text(encoding="utf-8")
        for place, value in (("name", name), ("told", told), ("hidden", "" if told else "hidden")):
            text = text.replace(f"{{{{{place}}}}}", html.escape(value))
        return HTMLResponse(text, status, headers={"Cache-Control": "no-store"})

    @router.get("/sign-in")
    def sign_in_page(token: str = "", name: str = "") -> Response:
        if token:  # a link as it was printed before: the token leaves the address at once
            query = f"?{urlencode({'name': name})}" if name else ""
            return RedirectResponse(f"/sign-in{query}#{urlencode({'token': token})}", 303)
        return page(name)

    @router.post("/sign-in")
    async def sign_in(request: Request) -> Response:
        form = dict(parse_qsl((await request.body()).decode("utf-8", "replace")))
        name = form.get("name", "")
        address = request.client.host if request.client else "unknown"
        wait = attempts.wait_s(address)
        if wait:
            reply = page(name, f"Too many wrong tokens. Wait {wait} seconds, then try again.", 429)
            reply.headers["Retry-After"] = str(wait)
            return reply
        if not access.knows_token(form.get("token", "")):
            count = attempts.fail(address)
            LOG.warning("sign-in from %s: wrong token, %d in a row", address, count)
            told = "This token is not this server's. Open the link that it printed when it started."
            return page(name, told, 403)
        attempts.succeed(address)
        try:
            session = await asyncio.to_thread(sessions.begin, name)
        except InvalidInput as error:
            return page(name, str(error), error.status)
        response = RedirectResponse("/", 303)
        response.set_cookie(
            access.cookie,
            session,
            httponly=True,
            samesite="strict",
            secure=request.url.scheme == "https",
            max_age=int(LASTS.total_seconds()),
        )
        return response

    @router.post("/sign-out")
    def sign_out(request: Request) -> Response:
        session = request.cookies.get(access.cookie)
        if session:
            sessions.end(session)
        response = RedirectResponse("/sign-in", 303)
        response.delete_cookie(access.cookie)
        return response

    return router
