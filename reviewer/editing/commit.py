"""Commit a mask: check what came in, append a revision, bring the counts up to date."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.evaluation.counting import refresh_counts
from reviewer.masks import Rle, decode_png, encode_rle, read_rle
from reviewer.records import ReviewState, RevisionSource
from reviewer.store.database import Store
from reviewer.store.reviews import set_review_state
from reviewer.store.revisions import add_revision

LARGEST_LOG = 2000
LOG = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class MaskEdit:
    """A person's mask for a pair, made from revision `parent` (0 = none yet)."""

    mask: Rle
    parent: int
    source: RevisionSource = "edit"
    ignore: Rle | None = None
    active_seconds: float = 0.0
    tool_log: Sequence[Mapping[str, Any]] = field(default_factory=tuple)


def mask_of_png(data: bytes) -> Rle:
    """Return the run-lengths of a 0/255 PNG; raises InvalidInput when it is no mask."""
    return encode_rle(decode_png(data))


def mask_of_counts(height: int, width: int, counts: str) -> Rle:
    """Return checked run-lengths; raises InvalidInput when they do not fit the size."""
    return read_rle(height, width, counts)


def commit_mask(store: Store, pair_id: int, annotator_id: int, edit: MaskEdit) -> int:
    """Append the mask as a new revision and return its number.

    The revision is safe once it is appended: when counting then fails, that is logged, and the
    counts are made up for by the next evaluation.

    Raises:
        NotFound, InvalidInput, Conflict, Locked: as `store.revisions.add_revision`.
    """
    if len(edit.tool_log) > LARGEST_LOG:
        raise InvalidInput(f"tool log: at most {LARGEST_LOG} actions, not {len(edit.tool_log)}")
    number = add_revision(
        store,
        pair_id,
        edit.mask,
        parent=edit.parent,
        annotator_id=annotator_id,
        source=edit.source,
        ignore=edit.ignore,
        active_seconds=edit.active_seconds,
        tool_log=edit.tool_log,
    )
    _count(store, pair_id)
    return number


def change_state(
    store: Store,
    pair_id: int,
    annotator_id: int,
    state: ReviewState,
    seen: int | None,
    active_seconds: float = 0.0,
) -> None:
    """Set a review state, and count again where another revision is the ground truth now.

    Raises:
        NotFound, InvalidInput, Conflict: as `store.reviews.set_review_state`.
    """
    set_review_state(store, pair_id, annotator_id, state, seen=seen, active_seconds=active_seconds)
    _count(store, pair_id)


def _count(store: Store, pair_id: int) -> None:
    try:
        refresh_counts(store, pair_id)
    except Exception:
        LOG.exception("pair %s: saved, but its scores could not be counted", pair_id)
