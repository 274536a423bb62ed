"""Import masks from another annotation tool for existing pairs: all of them, or none.

An image of the tool is a live image here when its file has that name, and a folder of its path, if
it has any, is the split's or the live image's own. A path from elsewhere is believed only inside a
split that the user names. An image without any shape says nothing, unless the user says that it
means "nothing changed".
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from reviewer.dataset.annotations.coco import read_coco
from reviewer.dataset.annotations.cvat import read_cvat
from reviewer.dataset.annotations.label_studio import read_label_studio
from reviewer.dataset.annotations.labelme import read_labelme
from reviewer.dataset.annotations.shapes import ILL_POSED, Annotated
from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.masks import Mask, Rle, empty_rle, encode_rle
from reviewer.records import Pair
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs, list_splits
from reviewer.store.revisions import NewRevision, add_revisions, newest_revisions
from reviewer.words import AnnotationTool

READERS: dict[AnnotationTool, Callable[[Path], list[Annotated]]] = {
    "coco": read_coco,
    "labelme": read_labelme,
    "cvat": read_cvat,
    "label-studio": read_label_studio,
}


LEFT_OUT = "left out"


@dataclass(frozen=True, slots=True)
class MaskReport:
    """What became of a tool's file.

    Attributes:
        written: pairs that got a mask (or would), with its changed pixels.
        unchanged: pairs whose newest mask is that already.
        strangers: images that no pair here has.
        empty: images without a shape that means anything here; written only with `empty`.
        labels: shapes' labels with how they were read: "change", "ill-posed" or "left out".
        left_out: shapes that are no areas, by kind.
    """

    written: tuple[tuple[str, int], ...]
    unchanged: int
    strangers: tuple[str, ...]
    empty: tuple[str, ...]
    labels: Mapping[str, str]
    left_out: Mapping[str, int]


def import_masks(
    store: Store,
    tool: AnnotationTool,
    path: Path,
    *,
    splits: Sequence[str] = (),
    change: Sequence[str] = (),
    ill_posed: str = ILL_POSED,
    empty: bool = False,
    replace: bool = False,
    dry_run: bool = False,
) -> MaskReport:
    """Read a tool's file and append a revision to every pair whose mask it changes.

    Args:
        splits: only pairs of these.
        change: labels that mean "changed"; all but `ill_posed` when empty.
        ill_posed: label of pixels that are not to be scored.
        empty: an image without any shape means that nothing has changed.
        replace: also where there is ground truth already, whose revisions stay in the history.
        dry_run: read and check everything, write nothing.

    Raises:
        InvalidInput: for a malformed file, an image that fits several pairs, another size, or a
            label that the file does not have.
        NotFound: when the file does not exist, or none of its images is here.
        Conflict: when a pair has another ground truth and `replace` is not said.
    """
    if not path.exists():
        raise NotFound(f"{path}: does not exist")
    pairs = list_pairs(store, splits)
    images = READERS[tool](path)
    labels = sorted(set[str]().union(*(image.labels for image in images)))
    for label in change:
        if label not in labels:
            there = ", ".join(map(repr, labels)) or "none"
            raise InvalidInput(f"{path}: has no label {label!r}; there are {there}")
    reading = {label: _reading(label, change, ill_posed) for label in labels}
    named = {split.name for split in list_splits(store)}
    wanted: dict[int, tuple[Pair, Rle, Rle | None]] = {}
    strangers, blank, left_out = [], [], Counter[str]()
    for image in images:
        left_out.update(image.left_out)
        pair = _pair_of(image, pairs, named, narrowed=bool(splits))
        if pair is None:
            strangers.append(image.name)
            continue
        _check_size(image, pair)
        shapeless = not image.shapes and not image.left_out
        if not any(reading[label] != LEFT_OUT for label in image.labels) and not (
            shapeless and empty
        ):
            blank.append(image.name)
            continue
        if pair.id in wanted:
            raise InvalidInput(
                f"{image.place}: pair {pair.title} has a mask from this file already"
            )
        wanted[pair.id] = pair, *_masks(image, reading)
    if not wanted and not blank:
        some = f", such as {strangers[0]}," if strangers else ""
        raise NotFound(f"{path}: none of its {len(images)} images{some} is a live image here")
    newest = newest_revisions(store)
    revisions, written, unchanged = [], [], 0
    for pair, mask, ignore in wanted.values():
        known = newest.get(pair.id)
        if known and (known.mask, known.ignore_rle) == (mask, ignore and ignore.counts):
            unchanged += 1
            continue
        if known and not replace:
            raise Conflict(
                f"pair {pair.title}: has ground truth already (revision {known.number});"
                " --replace puts this above it, and keeps it in the history"
            )
        number = known.number if known else 0
        # An empty layer says that there is none, where None would keep the one before.
        cleared = ignore or empty_rle(mask.height, mask.width)
        revisions.append(NewRevision(pair.id, mask, number, cleared))
        written.append((pair.title, mask.area))
    if not dry_run:
        add_revisions(store, revisions)
    return MaskReport(tuple(written), unchanged, tuple(strangers), tuple(blank), reading, left_out)


def _reading(label: str, change: Sequence[str], ill_posed: str) -> str:
    if label == ill_posed:
        return "ill-posed"
    return "change" if not change or label in change else LEFT_OUT


def _pair_of(
    image: Annotated, pairs: Sequence[Pair], splits: set[str], *, narrowed: bool
) -> Pair | None:
    """Return the pair whose live image this is.

    Args:
        splits: names of all splits; a path that names one is of that one.
        narrowed: the user named splits, so a path from elsewhere is believed.
    """
    path = PurePosixPath(image.name)
    folders = [part for part in path.parts[:-1] if part not in ("/", ".", "..")]
    found = [p for p in pairs if path.stem in (p.name, p.live.path.stem)]
    if splits.intersection(folders):
        found = [p for p in found if p.split in folders]
    elif folders and not narrowed:
        found = [p for p in found if set(p.live.path.parts[:-1]).intersection(folders)]
    if len(found) > 1:
        titles = ", ".join(p.title for p in found[:4])
        raise InvalidInput(
            f"{image.place}: {image.name} may be {titles}; narrow it with --split, or name the"
            " split as a folder of the image's path"
        )
    return found[0] if found else None


def _check_size(image: Annotated, pair: Pair) -> None:
    if (image.height, image.width) != (pair.live.height, pair.live.width):
        raise InvalidInput(
            f"{image.place}: is {image.width}x{image.height}, but the live image of pair"
            f" {pair.title} is {pair.live.width}x{pair.live.height}"
        )


def _masks(image: Annotated, reading: Mapping[str, str]) -> tuple[Rle, Rle | None]:
    layers = image.layers

    def union(kind: str) -> Mask:
        whole = np.zeros((image.height, image.width), np.bool_)
        for label, layer in layers.items():
            if reading[label] == kind:
                whole |= layer
        return whole

    ignored = union("ill-posed")
    return encode_rle(union("change")), encode_rle(ignored) if ignored.any() else None
