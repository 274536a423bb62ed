"""Which masks an export takes: the newest ground truth, of chosen splits and review states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from reviewer.errors import NotFound
from reviewer.records import MaskRevision, Pair
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import newest_revisions


@dataclass(frozen=True, slots=True)
class Labelled:
    """A pair with its newest ground truth."""

    pair: Pair
    revision: MaskRevision


def select_labelled(store: Store, splits: Sequence[str]) -> tuple[list[Labelled], list[Pair]]:
    """Return the pairs that have ground truth (all-zero masks too), and those that have none.

    Raises:
        NotFound: when a split does not exist, or no pair has ground truth.
    """
    revisions = newest_revisions(store)
    pairs = list_pairs(store, splits)
    labelled = [Labelled(pair, revisions[pair.id]) for pair in pairs if pair.id in revisions]
    if not labelled:
        raise NotFound(f"export: none of {len(pairs)} pairs has ground truth yet")
    return labelled, [pair for pair in pairs if pair.id not in revisions]
