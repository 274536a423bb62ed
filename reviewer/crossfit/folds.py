"""What each fold is fitted to: pairs exported once, divided so that no test pair leaks."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from reviewer.errors import Conflict, InvalidInput
from reviewer.export.folds import Fold
from reviewer.export.selection import Labelled, Selection
from reviewer.export.t0t1 import export_t0t1
from reviewer.records import Pair, Run
from reviewer.store.database import Store
from reviewer.synthesis.bank import Bank
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.synthesis.shelf import Shelf
from reviewer.training.labelled import LabelledData, LabelledFiles
from reviewer.training.selection import data_record
from reviewer.training.stream import SyntheticData

EVERY = 8
"""One reference image of so many is held out of training, to choose the checkpoint by."""


@dataclass(frozen=True, slots=True)
class FoldData:
    """A fold with the files it is fitted to, and the reference images of its synthetic pairs."""

    fold: Fold
    data: LabelledData
    shelf: Shelf | None = None


def write_truth(
    store: Store, labelled: Sequence[Labelled], folder: Path, selection: Selection, warper: Run
) -> dict[int, LabelledFiles]:
    """Export the pairs into `folder` once, references warped; return their files by pair id.

    Raises:
        Conflict: when the folder holds another ground truth than the store has now.
        NotFound: when a pair is not aligned in `warper`.
    """
    if not folder.exists():
        export_t0t1(store, labelled, folder, selection, warped_by=warper, ignore="255")
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    entries = {entry["pair"]: entry for entry in manifest["pairs"]}
    for item in labelled:
        entry = entries.pop(item.pair.title, None)
        if entry is None or entry["revision"] != item.origin["revision"]:
            was = "is not in it" if entry is None else f"was at revision {entry['revision']}"
            raise Conflict(
                f"{folder}: was exported from another ground truth, pair {item.pair.title} {was};"
                " give this training a name of its own with --name"
            )
    if entries or manifest["settings"]["warped_by"] != warper.name:
        raise Conflict(
            f"{folder}: was exported with other pairs, or warped by another run;"
            " give this training a name of its own with --name"
        )
    found = {entry["pair"]: entry["files"] for entry in manifest["pairs"]}
    return {item.pair.id: _files(item.pair, folder, found[item.pair.title]) for item in labelled}


def _files(pair: Pair, folder: Path, hashes: Mapping[str, str]) -> LabelledFiles:
    by_kind = {Path(path).parent.name: folder / path for path in hashes}
    digest = hashlib.sha256(json.dumps(hashes, sort_keys=True).encode()).hexdigest()
    return LabelledFiles(pair.title, by_kind["t0"], by_kind["t1"], by_kind["mask"], digest)


@dataclass(frozen=True, slots=True)
class Pasting:
    """Synthetic pairs that are mixed into a fold: objects pasted on its own reference images.

    Attributes:
        share: of all pairs that the net is shown, in [0, 1).
    """

    bank: Bank
    settings: SynthesisSettings
    share: float


def fold_data(
    folds: Sequence[Fold],
    files: Mapping[int, LabelledFiles],
    record: Mapping[str, str],
    pasting: Pasting | None = None,
) -> list[FoldData]:
    """Return what each fold is fitted to.

    Raises:
        InvalidInput: when a live image of the test pairs is among those trained on, or a fold has
            too few reference images to hold one out.
    """
    made = []
    for fold in folds:
        seen = {pair.live.sha256: pair for pair in fold.train}
        for pair in fold.test:
            if pair.live.sha256 in seen:
                twin = seen[pair.live.sha256]
                raise InvalidInput(
                    f"fold {fold.name}: pair {pair.title} is to be tested, but {twin.title}, which"
                    " is trained on, has the same live image"
                )
        training, validation = _held_out(fold)
        shelf = synthetic = None
        if pasting:
            shelf, synthetic = _synthetic(training, pasting)
        data = LabelledData(
            [files[pair.id] for pair in training],
            [files[pair.id] for pair in validation],
            {**record, "fold": fold.name},
            synthetic=synthetic,
            share=pasting.share if pasting else 0.0,
        )
        made.append(FoldData(fold, data, shelf))
    return made


def _synthetic(pairs: Sequence[Pair], pasting: Pasting) -> tuple[Shelf, SyntheticData]:
    references = list({pair.reference.sha256: pair.reference for pair in pairs}.values())
    record = data_record(references, pasting.bank, pasting.settings)
    shelf = Shelf([image.path for image in references])
    return shelf, SyntheticData(shelf, pasting.bank, pasting.settings, record)


def _held_out(fold: Fold) -> tuple[list[Pair], list[Pair]]:
    """Divide a fold's pairs to train on; those that share a reference image stay together."""
    places = {
        sha256: place
        for place, sha256 in enumerate(dict.fromkeys(p.reference.sha256 for p in fold.train))
    }
    if len(places) < 2:
        raise InvalidInput(
            f"fold {fold.name}: is trained on {len(places)} reference images, needs 2 or more"
        )
    chosen = [pair for pair in fold.train if places[pair.reference.sha256] % EVERY == 1]
    return [pair for pair in fold.train if pair not in chosen], chosen
