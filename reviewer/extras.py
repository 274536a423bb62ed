"""Libraries that only some commands need, and the extra of this package that installs each.

Importing, reviewing, running without weights and exporting work with none of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from reviewer.errors import ReviewerError

EXTRAS = {
    "datasets": "huggingface",
    "embreex": "demo",
    "huggingface_hub": "models",
    "matplotlib": "figures",
    "ray": "ray",
    "transformers": "models",
    "trimesh": "demo",
}


class MissingLibrary(ReviewerError):
    """A library is not installed that this needs; the message says which extra brings it."""

    status = 501


@contextmanager
def telling_what_is_missing(what: str) -> Iterator[None]:
    """Turn the import error of a library of an extra into a sentence; `what` needs it.

    Raises:
        MissingLibrary: in its place.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing not in EXTRAS:
            raise
        raise _missing(what, missing) from error


def need(what: str, library: str) -> None:
    """Check that a library is installed before work starts that needs it later.

    Raises:
        MissingLibrary: when it is not installed.
    """
    if find_spec(library) is None:
        raise _missing(what, library)


def _missing(what: str, library: str) -> MissingLibrary:
    return MissingLibrary(
        f"{what}: needs {library}, which is not installed;"
        f" pip install 'reviewer[{EXTRAS[library]}]'"
    )
