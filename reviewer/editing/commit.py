"""Commit a mask: check what came in, append a revision, bring the counts up to date."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.evaluation.counting import refresh_counts
from reviewer.masks import Rle, decode_png, encode_rle, read_rle
from reviewer.records import RevisionSource
from reviewer.store.database import Store
from reviewer.store.reviews import touch_review
from reviewer.store.revisions import add_revision

LARGEST_LOG = 2000


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

    The pair becomes "in progress" for the annotator when it was "todo".

    Raises:
        NotFound, InvalidInput, Conflict: as `store.revisions.add_revision`.
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
    touch_review(store, pair_id, annotator_id)
    refresh_counts(store, pair_id)
    return number
