"""Who hears how far a flow is: the terminal, a notebook, or nobody."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

Advance = Callable[[int, int | None, str], None]
"""Called with how much is done, how much there is (None while unknown), and with what."""


class Listener(Protocol):
    """Hears sentences, and how far a piece of work is."""

    def say(self, sentence: str) -> None:
        """Hear something that a person should know."""

    def progress(self, title: str) -> AbstractContextManager[Advance]:
        """Hear how far the work of this title is, while it lasts."""


class Nobody:
    """Hears nothing."""

    def say(self, sentence: str) -> None:
        """Hear nothing."""

    @contextmanager
    def progress(self, title: str) -> Iterator[Advance]:
        """Hear nothing."""
        yield lambda done, total, what: None


NOBODY = Nobody()
