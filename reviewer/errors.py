"""The few errors a caller can act on.

Every message names the subject, the rule, the value and the place. The command line prints it in
one line and exits with 2; the API answers problem-JSON with `status`; the app shows a notice.
"""

from __future__ import annotations


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
    """What is sent is larger than anything that is asked for; nobody reads it."""

    status = 413


class Locked(ReviewerError):
    """The annotator has finished the pair; reopening it makes changes possible again."""

    status = 423
