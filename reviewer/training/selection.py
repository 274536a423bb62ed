"""Which reference images a detector of some splits is trained on; live images and masks never are.

`same_split` takes the references of those very splits, as the paper does; `same_workspace` those of
every split of their workspaces; `others` those of all other workspaces.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.records import Image
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs, list_splits
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.words import TrainedOn


def select_references(store: Store, splits: Sequence[str], train_on: TrainedOn) -> list[Image]:
    """Return the reference images to train on, each once, in the order of splits and names.

    Args:
        splits: the splits that the detector is for; all when empty.

    Raises:
        NotFound: when a split does not exist.
        InvalidInput: when a split is of no workspace where that matters, or nothing is left.
    """
    chosen = _splits(store, splits, train_on)
    if not chosen:
        raise InvalidInput(
            f"train on {train_on}: no split is left beside {', '.join(splits) or 'all splits'}"
        )
    images = {pair.reference.id: pair.reference for pair in list_pairs(store, chosen)}
    if not images:
        raise InvalidInput(f"split {', '.join(chosen)}: has no pairs, so no reference image")
    return list(images.values())


def _splits(store: Store, splits: Sequence[str], train_on: TrainedOn) -> list[str]:
    known = list_splits(store)
    list_pairs(store, splits)  # names that do not exist are told here
    wanted = list(splits) or [split.name for split in known]
    if train_on == "same_split":
        return wanted
    workspaces = {split.workspace for split in known if split.name in wanted}
    if None in workspaces:
        odd = next(s.name for s in known if s.name in wanted and s.workspace is None)
        raise InvalidInput(
            f"split {odd}: its name tells no workspace (such as cs1), so train on same_split"
        )
    inside = train_on == "same_workspace"
    return [s.name for s in known if s.workspace and (s.workspace in workspaces) == inside]


def data_record(
    references: Sequence[Image], bank: Bank, synthesis: SynthesisSettings
) -> dict[str, Any]:
    """Return what a training's record says of its data; `sha256` stands for all of it."""
    images = sorted(image.sha256 for image in references)
    parts = {"references": images, "bank": bank.sha256, "synthesis": synthesis.record()}
    digest = hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
    return {
        "sha256": digest,
        "references": len(images),
        "objects": len(bank.objects),
        "bank_sha256": bank.sha256,
    }
