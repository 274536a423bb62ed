"""`folds`: lists of pairs to train and to test on, made so that nothing leaks.

    same-split     k parts of every split; pairs that share a reference image stay together
    split          one split is tested, the others are trained on
    workspace      one workspace is tested, the others are trained on

Each fold is a folder with `train.txt` and `test.txt`, a `split/pair` a line.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from reviewer.atomic import whole_folder
from reviewer.errors import InvalidInput
from reviewer.export.manifest import pair_entry, write_manifest
from reviewer.export.selection import Labelled, Selection
from reviewer.records import Pair
from reviewer.store.database import Store
from reviewer.store.pairs import list_splits
from reviewer.words import FoldKind


@dataclass(frozen=True, slots=True)
class Fold:
    """Pairs to train and to test on; none is in both."""

    name: str
    train: tuple[Pair, ...]
    test: tuple[Pair, ...]


def make_folds(store: Store, pairs: Sequence[Pair], kind: FoldKind, parts: int = 5) -> list[Fold]:
    """Return the folds of a kind.

    Args:
        parts: k of `same-split`.

    Raises:
        InvalidInput: when there are too few pairs, splits or workspaces to make any.
    """
    if kind == "same-split":
        return _same_split(pairs, parts)
    workspace = {split.name: split.workspace or split.name for split in list_splits(store)}
    key: Callable[[Pair], str] = (
        (lambda pair: pair.split) if kind == "split" else (lambda pair: workspace[pair.split])
    )
    names = sorted({key(pair) for pair in pairs})
    if len(names) < 2:
        raise InvalidInput(f"folds by {kind}: need two or more, but there is only {names[0]}")
    return [
        Fold(
            name,
            tuple(pair for pair in pairs if key(pair) != name),
            tuple(pair for pair in pairs if key(pair) == name),
        )
        for name in names
    ]


def _same_split(pairs: Sequence[Pair], parts: int) -> list[Fold]:
    if parts < 2:
        raise InvalidInput(f"folds: need two or more parts, not {parts}")
    part_of: dict[int, int] = {}
    # A reference image that is both trained and tested on would be known already; splits of one
    # workspace may share a drive, so it is told by its content.
    part_of_image: dict[str, int] = {}
    for split in sorted({pair.split for pair in pairs}):
        groups: dict[str, list[Pair]] = {}
        for pair in pairs:
            if pair.split == split:
                groups.setdefault(pair.reference.sha256, []).append(pair)
        if len(groups) < parts:
            raise InvalidInput(
                f"folds: split {split} has {len(groups)} reference images, fewer than {parts} parts"
            )
        for place, (sha256, group) in enumerate(groups.items()):
            part = part_of_image.setdefault(sha256, place * parts // len(groups))
            for pair in group:
                part_of[pair.id] = part
    return [
        Fold(
            f"part-{k + 1}",
            tuple(pair for pair in pairs if part_of[pair.id] != k),
            tuple(pair for pair in pairs if part_of[pair.id] == k),
        )
        for k in range(parts)
    ]


def export_folds(
    store: Store,
    labelled: Sequence[Labelled],
    target: Path,
    selection: Selection,
    kind: FoldKind,
    parts: int = 5,
) -> int:
    """Write the lists; return the number of folds.

    Raises:
        Conflict: when `target` exists and is not empty.
        InvalidInput: see `make_folds`.
    """
    folds = make_folds(store, [item.pair for item in labelled], kind, parts)
    with whole_folder(target) as folder:
        for fold in folds:
            (folder / fold.name).mkdir()
            for name, pairs in (("train", fold.train), ("test", fold.test)):
                lines = "".join(f"{pair.title}\n" for pair in pairs)
                (folder / fold.name / f"{name}.txt").write_text(lines)
        settings = {**selection.record(), "kind": kind, "parts": parts}
        write_manifest(folder, "folds", settings, [pair_entry(item, {}) for item in labelled])
    return len(folds)
