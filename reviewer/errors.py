"""The few errors a caller can act on.

Every message names the subject, the rule, the value and the place. The command line prints it in
one line and exits with 2; the API answers problem-JSON with `status`; the app shows a notice.
"""

from __future__ import annotations

import errno


class ReviewerError(Exception):
    """Anything a user can put right; `status` is the HTTP status the API answers with."""

    status = 400


class InvalidInput(ReviewerError):
    """The input breaks a stated rule (a size, a polarity, a malformed mask)."""

    status = 422


class NotFound(ReviewerError):
    """The named split, pair, run, layer or file does not exist."""

    status = 404


class Conflict(ReviewerError):
    """The change starts from a revision that is no longer the newest, and would undo it."""

    status = 409


class TooLarge(ReviewerError):
    """The request is larger than any valid one; it is not read."""

    status = 413


class StorageFull(ReviewerError):
    """There is no room left to write; nothing of the change was kept."""

    status = 507


class Unavailable(ReviewerError):
    """The database cannot be read or written now; it may work later, or elsewhere."""

    status = 503


class Damaged(InvalidInput):
    """The database's file is damaged; a backup is needed."""

    status = 503


class Locked(ReviewerError):
    """The annotator has finished the pair; reopening it makes changes possible again."""

    status = 423


def tell_system_error(error: OSError) -> ReviewerError:
    """Return a file system's error as a message for people."""
    text = f"{error.filename or 'file system'}: {error.strerror or error}"
    full = error.errno in (errno.ENOSPC, errno.EDQUOT)
    return StorageFull(text) if full else Unavailable(text)
