"""Commit a mask: check what came in, append a revision, bring the counts up to date."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.evaluation.counting import refresh_counts
from reviewer.masks import Rle, decode_png, encode_rle, png_size, read_rle
from reviewer.records import Pair
from reviewer.store.database import Store
from reviewer.store.reviews import set_review_state
from reviewer.store.revisions import add_revision
from reviewer.texts import clean_text
from reviewer.words import ReviewState, RevisionSource

MOST_ACTIONS = 2000
LARGEST_LOG_BYTES = 256 * 2**10
DEEPEST_LOG = 8
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


def largest_body(pair: Pair) -> int:
    """Return the largest request body, in bytes, for a mask of a pair with its log."""
    return 8 * pair.live.height * pair.live.width + 4 * LARGEST_LOG_BYTES


def mask_of_png(pair: Pair, data: bytes) -> Rle:
    """Return the run-lengths of a 0/255 PNG for a pair.

    Raises:
        InvalidInput: when it is no mask, or has another size, which is told before it is decoded.
    """
    _check_size(pair, *png_size(data))
    return encode_rle(decode_png(data))


def mask_of_counts(pair: Pair, height: int, width: int, counts: str) -> Rle:
    """Return checked run-lengths for a pair; raises InvalidInput when they do not fit its size."""
    _check_size(pair, height, width)
    return read_rle(height, width, counts)


def _check_size(pair: Pair, height: int, width: int) -> None:
    live = pair.live
    if (height, width) != (live.height, live.width):
        raise InvalidInput(
            f"pair {pair.title}: the mask is {width}x{height}, but the live image is"
            f" {live.width}x{live.height}"
        )


def check_log(log: Sequence[Mapping[str, Any]]) -> None:
    """Check a tool log from outside.

    Raises:
        InvalidInput: when it has too many actions, is too deep or too large, or holds what is no
            JSON (numbers that are not finite, half characters) or a text that cannot be read.
    """
    if len(log) > MOST_ACTIONS:
        raise InvalidInput(f"tool log: at most {MOST_ACTIONS} actions, not {len(log)}")
    level: list[Any] = list(log)
    for _ in range(DEEPEST_LOG):
        level = [item for value in level for item in _inside(value)]
    if level:
        raise InvalidInput(f"tool log: is more than {DEEPEST_LOG} levels deep")
    try:
        size = len(json.dumps(list(log), allow_nan=False, ensure_ascii=False).encode())
    except ValueError as error:
        raise InvalidInput(f"tool log: holds a number or a text that is none, {error}") from error
    if size > LARGEST_LOG_BYTES:
        raise InvalidInput(
            f"tool log: at most {LARGEST_LOG_BYTES // 2**10} KiB of JSON, not {size / 2**10:.0f}"
        )
    for text in _texts(log):
        clean_text(text, "tool log", longest=LARGEST_LOG_BYTES, lines=True, fold=False)


def _inside(value: Any) -> list[Any]:
    if isinstance(value, Mapping):
        return list(value.values())
    return value if isinstance(value, list) else []


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield key
            yield from _texts(item)
    elif isinstance(value, Sequence):
        for item in value:
            yield from _texts(item)


def commit_mask(store: Store, pair_id: int, annotator_id: int, edit: MaskEdit) -> int:
    """Append the mask as a new revision and return its number.

    The revision is safe once it is appended: when counting then fails, that is logged, and the
    counts are made up for by the next evaluation.

    Raises:
        NotFound, InvalidInput, Conflict, Locked: as `store.revisions.add_revision`.
    """
    check_log(edit.tool_log)
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
