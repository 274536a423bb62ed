"""Which masks an export takes: ground truth, what people agree on, or a run's final masks."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from reviewer.errors import InvalidInput, NotFound
from reviewer.masks import Mask, Rle, decode_rle, encode_rle
from reviewer.records import MaskRevision, Pair
from reviewer.store.audit_rows import pairs_with_verdict
from reviewer.store.database import Store
from reviewer.store.layers import load_alignment
from reviewer.store.pairs import list_pairs
from reviewer.store.regions import load_final_mask
from reviewer.store.reviews import pairs_in_state
from reviewer.store.runs import run_of_name
from reviewer.store.truth import finished_by_annotator, masks_in_state, truths
from reviewer.words import REVIEW_STATES, VERDICTS


@dataclass(frozen=True, slots=True)
class Selection:
    """What is exported; everything that is empty or None does not narrow it.

    Attributes:
        splits: only these.
        states: pairs that somebody has in one of these review states, with the newest revision
            that this was said of; without, what counts as ground truth (see `store.truth`).
        annotators: masks that one of these drew last.
        least_px, most_px: changed pixels of the mask.
        run: final masks of this run (after verdicts, where there are any) in place of ground truth.
        ignore_unseen: pixels that `run` has not seen go with ill-posed ones. Ground truth has none:
            what is unseen depends on the run.
        verdicts: pairs with a region (of `run`, else of any) on which one of these was said last.
        consensus: what more than half of the people who drew a pair and finished it made of it, in
            place of one mask; 0 = no, else how many people there must be. Where exactly half of
            them say so, the pixel is ignored.
        skipped: titles of pairs to leave out, see `export.skipped`.
    """

    splits: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    annotators: tuple[str, ...] = ()
    least_px: int | None = None
    most_px: int | None = None
    run: str | None = None
    ignore_unseen: bool = False
    verdicts: tuple[str, ...] = ()
    consensus: int = 0
    skipped: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.run is not None and self.annotators:
            raise InvalidInput("export: --annotator is about ground truth, --run about predictions")
        if self.ignore_unseen and self.run is None:
            raise InvalidInput("export: --ignore-unseen is about predictions, and needs --run")
        if self.consensus and (self.run is not None or self.annotators):
            raise InvalidInput(
                "export: --consensus is of all people, not of a run or of one person"
            )
        for verdict in self.verdicts:
            if verdict not in VERDICTS:
                known = ", ".join(VERDICTS)
                raise InvalidInput(f"export: there is no verdict {verdict!r}; there are {known}")
        for state in self.states:
            if state not in REVIEW_STATES[1:]:
                known = ", ".join(REVIEW_STATES[1:])
                raise InvalidInput(f"export: there is no state {state!r}; there are {known}")

    def record(self) -> dict[str, Any]:
        """Return it as plain JSON values, for manifests."""
        return json.loads(json.dumps(asdict(self)))  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True)
class Labelled:
    """A pair with the mask to export.

    Attributes:
        ignore_mask: pixels not to score; None = none.
        origin: where the mask comes from: revision and annotator, or run.
    """

    pair: Pair
    mask: Rle
    ignore_mask: Rle | None
    origin: Mapping[str, Any]

    def ignore(self) -> Mask | None:
        """Return the ignore mask, bool (H, W); None where there is none."""
        return None if self.ignore_mask is None else decode_rle(self.ignore_mask)


def select_labelled(store: Store, selection: Selection) -> tuple[list[Labelled], list[Pair]]:
    """Return the pairs with a mask (all-zero ones too), and those that have none.

    Raises:
        NotFound: when a split or the run does not exist, or no pair is left.
    """
    left_out = set(selection.skipped)
    pairs = [pair for pair in list_pairs(store, selection.splits) if pair.title not in left_out]
    if selection.states:
        wanted = pairs_in_state(store, selection.states)
        pairs = [pair for pair in pairs if pair.id in wanted]
    if selection.verdicts:
        judging = run_of_name(store, selection.run).id if selection.run else None
        judged = pairs_with_verdict(store, selection.verdicts, judging)
        pairs = [pair for pair in pairs if pair.id in judged]
    if selection.run:
        found = _predictions(store, pairs, selection.run, selection.ignore_unseen)
    elif selection.consensus:
        found = _agreed(store, pairs, selection.consensus)
    else:
        found = _truths(store, pairs, selection.states)
    without = [pair for pair in pairs if pair.id not in found]
    labelled = [found[pair.id] for pair in pairs if pair.id in found]
    if not labelled:
        what = f"a final mask in run {selection.run}" if selection.run else "ground truth"
        if selection.consensus:
            what += f" of {selection.consensus} people"
        raise NotFound(f"export: none of {len(pairs)} pairs has {what} yet")
    kept = [item for item in labelled if _fits(item, selection)]
    if not kept:
        raise NotFound(f"export: none of {len(labelled)} masks is of that size or annotator")
    return kept, without


def _truths(store: Store, pairs: Sequence[Pair], states: Sequence[str]) -> dict[int, Labelled]:
    if states:
        revisions = masks_in_state(store, states)
    else:
        revisions = {pair_id: revision for pair_id, (revision, _) in truths(store).items()}
    return {
        pair.id: _of_revision(pair, revisions[pair.id]) for pair in pairs if pair.id in revisions
    }


def _of_revision(pair: Pair, revision: MaskRevision) -> Labelled:
    origin = {"revision": revision.number, "annotator": revision.annotator}
    return Labelled(pair, revision.mask, revision.ignore_mask, origin)


def _agreed(store: Store, pairs: Sequence[Pair], people: int) -> dict[int, Labelled]:
    revisions = finished_by_annotator(store)
    return {
        pair.id: _majority(pair, revisions[pair.id])
        for pair in pairs
        if len(revisions.get(pair.id, ())) >= people
    }


def _majority(pair: Pair, revisions: Sequence[MaskRevision]) -> Labelled:
    size = revisions[0].mask.height, revisions[0].mask.width
    votes, doubts = np.zeros(size, np.int16), np.zeros(size, np.int16)
    for revision in revisions:
        votes += decode_rle(revision.mask)
        ignored = revision.ignore()
        if ignored is not None:
            doubts += ignored
    changed: Mask = 2 * votes > len(revisions)
    ignore: Mask = (2 * votes == len(revisions)) | (2 * doubts > len(revisions))
    origin = {
        "annotators": [revision.annotator for revision in revisions],
        "revisions": [revision.number for revision in revisions],
    }
    ignored_by_most = encode_rle(ignore) if ignore.any() else None
    return Labelled(pair, encode_rle(changed), ignored_by_most, origin)


def _predictions(
    store: Store, pairs: Sequence[Pair], name: str, ignore_unseen: bool
) -> dict[int, Labelled]:
    run = run_of_name(store, name)
    found = {}
    for pair in pairs:
        mask = load_final_mask(store, run.id, pair.id)
        if mask is not None:
            unseen = _unseen(store, run.id, pair.id) if ignore_unseen else None
            found[pair.id] = Labelled(pair, mask, unseen, {"run": name})
    return found


def _unseen(store: Store, run_id: int, pair_id: int) -> Rle | None:
    """Return what a run has not seen of a pair; None where it has seen everything."""
    alignment = load_alignment(store, run_id, pair_id)
    unseen = None if alignment is None else encode_rle(~decode_rle(alignment.valid))
    return unseen if unseen is not None and unseen.area else None


def _fits(item: Labelled, selection: Selection) -> bool:
    least = selection.least_px or 0
    most = selection.most_px
    if item.mask.area < least or (most is not None and item.mask.area > most):
        return False
    return not selection.annotators or item.origin.get("annotator") in selection.annotators
