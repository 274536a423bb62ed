"""Import splits into the store: all of a split or nothing of it, with every skipped file told.

Images stay where they are; the store keeps their path relative to the database. Two layouts:
`sequence` (two drives with poses, paired by viewpoint) and `t0t1` (pairs by file name).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from reviewer.dataset.files import (
    CheckedImage,
    check_image,
    hash_file,
    list_images,
    read_grey,
    read_mask,
)
from reviewer.dataset.poses import StampedPose, closest_references, read_map, read_poses
from reviewer.errors import InvalidInput, NotFound
from reviewer.masks import Rle, encode_rle
from reviewer.store.database import Store
from reviewer.store.pairs import NewImage, NewMap, NewPair, add_split, list_splits

Layout = Literal["sequence", "t0t1"]
Polarity = Literal["auto", "white", "black"]
Progress = Callable[[str, int, int], None]

FOLDERS: dict[Layout, list[tuple[str, str, str]]] = {
    "sequence": [("reference", "live", "mask")],
    "t0t1": [("t0", "t1", "mask"), ("A", "B", "label"), ("t0", "t1", "gt")],
}
"""Folder names of reference, live and mask; a set that is there with its masks goes first."""


@dataclass(frozen=True, slots=True)
class ImportReport:
    """What became of a split: pairs written, files skipped with the reason, the polarity used."""

    split: str
    pairs: int
    skipped: tuple[tuple[Path, str], ...]
    polarity: str
    already_there: bool = False


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """How to read a split.

    Attributes:
        layout: folder layout.
        polarity: which mask colour is "changed"; "auto" takes the one with fewer pixels.
        max_distance: largest viewpoint distance of a pair, metres (layout `sequence`).
        metres_per_radian: weight of heading in the viewpoint distance.
    """

    layout: Layout = "sequence"
    polarity: Polarity = "auto"
    max_distance: float = 0.5
    metres_per_radian: float = 1.0


def find_splits(folder: Path, layout: Layout) -> list[tuple[str, Path]]:
    """Return (name, folder) of the split in `folder`, or of those one level below.

    Raises:
        NotFound: when there is none.
    """
    if not folder.is_dir():
        raise NotFound(f"{folder}: is not a folder")
    if _names(folder, layout):
        return [(folder.resolve().name, folder)]
    below = [p for p in sorted(folder.iterdir()) if p.is_dir() and _names(p, layout)]
    if not below:
        wanted = " or ".join(f"{a}/ {b}/" for a, b, _ in FOLDERS[layout])
        raise NotFound(f"{folder}: no {wanted} in it nor one level below (layout {layout})")
    return [(path.name, path) for path in below]


def import_split(
    store: Store, name: str, folder: Path, settings: ImportSettings, progress: Progress
) -> ImportReport:
    """Import one split; one that is there already is left alone.

    Raises:
        InvalidInput: for any bad file; the message names it, and nothing of the split is stored.
    """
    if name in {split.name for split in list_splits(store)}:
        return ImportReport(name, 0, (), "", already_there=True)
    names = _names(folder, settings.layout)
    if names is None:
        raise NotFound(f"{folder}: does not have the layout {settings.layout}")
    references, skipped = list_images(folder / names[0], folder)
    lives, more = list_images(folder / names[1], folder)
    skipped += more
    poses = _poses(folder, settings.layout)
    matches, unpaired = _match(references, lives, poses, settings)
    skipped += unpaired
    if not matches:
        raise InvalidInput(f"{folder}: no pairs; {_why(skipped)}")
    masks, unused = _list_masks(folder, names[2], lives)
    skipped += unused
    used_references = sorted({reference for reference, _, _ in matches})
    jobs = [references[n] for n in used_references] + [lives[live] for _, live, _ in matches]
    checked = dict(zip(jobs, _parallel(check_image, jobs, name, progress), strict=True))
    for reference, live, _ in matches:
        _check_sizes(name, live, checked[references[reference]], checked[lives[live]])
    masked = [live for _, live, _ in matches if live in masks]
    black, polarity = _polarity([masks[live] for live in masked], settings.polarity)
    truths = dict(zip(masked, _read_masks(masks, lives, masked, checked, black), strict=True))
    add_split(
        store,
        name,
        settings.layout,
        [
            *_new_images(store, "reference", used_references, references, checked, poses),
            *_new_images(store, "live", [m[1] for m in matches], lives, checked, poses),
        ],
        [NewPair(live, ref, live, distance, truths.get(live)) for ref, live, distance in matches],
        _map(store, folder),
    )
    return ImportReport(name, len(matches), tuple(skipped), polarity)


def _names(folder: Path, layout: Layout) -> tuple[str, str, str] | None:
    found = [names for names in FOLDERS[layout] if all((folder / n).is_dir() for n in names[:2])]
    with_masks = [names for names in found if (folder / names[2]).is_dir()]
    return next(iter(with_masks + found), None)


def _why(skipped: Sequence[tuple[Path, str]]) -> str:
    if not skipped:
        return "the folders hold no images"
    path, reason = skipped[0]
    return f"{len(skipped)} files skipped, the first is {path.name}: {reason}"


def _poses(folder: Path, layout: Layout) -> dict[tuple[str, str], StampedPose]:
    path = folder / "poses.csv"
    if path.exists():
        return read_poses(path)
    if layout == "sequence":
        raise InvalidInput(f"{path}: is missing; pairs of layout sequence are made from poses")
    return {}


def _match(
    references: dict[str, Path],
    lives: dict[str, Path],
    poses: dict[tuple[str, str], StampedPose],
    settings: ImportSettings,
) -> tuple[list[tuple[str, str, float | None]], list[tuple[Path, str]]]:
    """Return (reference, live, distance) triples and the live images that found no reference."""
    if settings.layout == "t0t1":
        alone = [(lives[n], "no reference of that name") for n in lives if n not in references]
        alone += [(references[n], "no live of that name") for n in references if n not in lives]
        return [(n, n, None) for n in lives if n in references], alone
    for session, images in (("reference", references), ("live", lives)):
        for name in images:
            if (session, name) not in poses:
                raise InvalidInput(f"{images[name]}: has no row in poses.csv")
    if not references:
        return [], [(path, "there are no reference images") for path in lives.values()]
    past = list(references)
    found = closest_references(
        [poses["live", name].pose for name in lives],
        [poses["reference", name].pose for name in past],
        metres_per_radian=settings.metres_per_radian,
    )
    matches: list[tuple[str, str, float | None]] = []
    alone = []
    for name, (index, distance) in zip(lives, found, strict=True):
        if distance <= settings.max_distance:
            matches.append((past[index], name, distance))
        else:
            reason = f"closest reference is {distance:.2f} m away (limit {settings.max_distance})"
            alone.append((lives[name], reason))
    return matches, alone


def _list_masks(
    folder: Path, name: str, lives: dict[str, Path]
) -> tuple[dict[str, Path], list[tuple[Path, str]]]:
    if not (folder / name).is_dir():
        return {}, []
    masks, skipped = list_images(folder / name, folder)
    skipped += [(path, "no live image of that name") for n, path in masks.items() if n not in lives]
    return {n: path for n, path in masks.items() if n in lives}, skipped


def _check_sizes(split: str, name: str, reference: CheckedImage, live: CheckedImage) -> None:
    if (reference.height, reference.width) != (live.height, live.width):
        raise InvalidInput(
            f"pair {split}/{name}: live {live.path} is {live.width}x{live.height}"
            f" but reference {reference.path} is {reference.width}x{reference.height}"
        )


def _polarity(masks: Sequence[Path], wanted: Polarity) -> tuple[bool, str]:
    """Return (black is changed, how that was decided); guesses from up to 50 masks."""
    if wanted != "auto":
        return wanted == "black", f"{wanted} = changed (as told)"
    if not masks:
        return False, "no masks"
    sample = masks[:: max(1, len(masks) // 50)]
    share = float(np.mean([np.mean(read_grey(path) != 0) for path in sample]))
    black = share > 0.5
    colour = "black" if black else "white"
    return black, f"{colour} = changed (guessed: {share:.1%} of {len(sample)} masks is not black)"


def _read_masks(
    masks: dict[str, Path],
    lives: dict[str, Path],
    names: Sequence[str],
    checked: dict[Path, CheckedImage],
    black: bool,
) -> list[Rle]:
    def read(name: str) -> Rle:
        mask = read_mask(masks[name], black_is_changed=black)
        image = checked[lives[name]]
        if mask.shape != (image.height, image.width):
            raise InvalidInput(
                f"{masks[name]}: is {mask.shape[1]}x{mask.shape[0]} but its live image is"
                f" {image.width}x{image.height}"
            )
        return encode_rle(mask)

    with ThreadPoolExecutor() as pool:
        return list(pool.map(read, names))


def _parallel(
    work: Callable[[Path], CheckedImage], paths: Sequence[Path], name: str, progress: Progress
) -> Iterator[CheckedImage]:
    with ThreadPoolExecutor() as pool:
        for done, result in enumerate(pool.map(work, paths), start=1):
            progress(name, done, len(paths))
            yield result


def _new_images(
    store: Store,
    session: str,
    names: Iterable[str],
    paths: dict[str, Path],
    checked: dict[Path, CheckedImage],
    poses: dict[tuple[str, str], StampedPose],
) -> list[NewImage]:
    images = []
    for name in names:
        image, stamped = checked[paths[name]], poses.get((session, name))
        images.append(
            NewImage(
                session,
                name,
                relative_path(store, image.path),
                image.sha256,
                image.height,
                image.width,
                stamped.stamp if stamped else None,
                stamped.pose if stamped else None,
            )
        )
    return images


def _map(store: Store, folder: Path) -> NewMap | None:
    description = folder / "map.yaml"
    if not description.exists():
        return None
    image, grid = read_map(description, folder)
    return NewMap(relative_path(store, image), hash_file(image), grid)


def relative_path(store: Store, path: Path) -> str:
    """Return a path as the store keeps it: relative to the database's folder, with slashes."""
    return Path(os.path.relpath(path.resolve(), store.folder)).as_posix()
