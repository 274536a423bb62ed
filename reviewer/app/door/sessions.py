"""Who is signed in: an id in the browser's cookie, which only this server can tell from a guess.

The database keeps the HMAC of the id under the server's token: a server that is started again with
the same token knows its people, another token knows nobody, and the file signs nobody in. Signing
out ends the id, also for windows that are still open: their sockets carry nothing any more.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from datetime import UTC, datetime, timedelta

from starlette.types import Message, Receive, Send

from reviewer.store.database import Store
from reviewer.store.reviews import annotator_id
from reviewer.store.sessions import add_session, end_session, person_of_session

LASTS = timedelta(days=30)
POLICY = 1008
"""Closes a WebSocket that may not go on (RFC 6455)."""


class Sessions:
    """The sessions of one server."""

    def __init__(self, store: Store, token: str) -> None:
        self._store = store
        self._secret = token.encode()
        self._ended: set[str] = set()

    def begin(self, name: str) -> str:
        """Sign a person in and return the id for the cookie.

        Raises:
            InvalidInput: when the name is none.
        """
        session = secrets.token_urlsafe(32)
        person = annotator_id(self._store, name)
        add_session(self._store, self._key(session), person, oldest=_oldest())
        return session

    def annotator(self, session: str) -> str | None:
        """Return the name that belongs to a cookie's id; None when it is not signed in."""
        if not session or len(session) > 100:
            return None
        return person_of_session(self._store, self._key(session), oldest=_oldest())

    def end(self, session: str) -> None:
        """Sign out."""
        self._ended.add(session)
        end_session(self._store, self._key(session))

    def guarded(self, session: str, receive: Receive, send: Send) -> tuple[Receive, Send]:
        """Return the two ends of a socket, which close when its session has ended."""
        closed = False

        async def close() -> None:
            nonlocal closed
            if not closed:
                closed = True
                await send({"type": "websocket.close", "code": POLICY})

        async def receive_while_signed_in() -> Message:
            message = await receive()
            if session not in self._ended or message["type"] == "websocket.disconnect":
                return message
            await close()
            return {"type": "websocket.disconnect", "code": POLICY}

        async def send_while_signed_in(message: Message) -> None:
            await (close() if session in self._ended else send(message))

        return receive_while_signed_in, send_while_signed_in

    def _key(self, session: str) -> str:
        return hmac.new(self._secret, session.encode(), hashlib.sha256).hexdigest()


def _oldest() -> datetime:
    return datetime.now(UTC) - LASTS
