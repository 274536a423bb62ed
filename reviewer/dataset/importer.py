"""Import splits into the store, each completely or not at all; skipped files are reported.

Images stay where they are; the store keeps their path relative to the database. Where things lie is
the matter of `layouts`, what goes together of `matching`, what masks mean of `truths`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from reviewer.dataset.files import CheckedImage, check_image, hash_file, image_size
from reviewer.dataset.layouts import Skipped, read_layout
from reviewer.dataset.matching import Match, Poses, match_images, poses_of
from reviewer.dataset.poses import read_map
from reviewer.dataset.settings import ImportSettings
from reviewer.dataset.truths import MaskRule, find_rule
from reviewer.errors import InvalidInput
from reviewer.masks import Rle, encode_rle
from reviewer.store.database import Store
from reviewer.store.pairs import NewImage, NewMap, NewPair, add_split, list_splits

__all__ = ["ImportReport", "ImportSettings", "import_split", "relative_path"]

T = TypeVar("T")
Progress = Callable[[str, int, int], None]
Checked = Mapping[Path, CheckedImage | InvalidInput]


@dataclass(frozen=True, slots=True)
class ImportReport:
    """What became of a split: pairs written (or that would be), files skipped with the reason, how
    many pairs have a mask, how masks were read, and sentences about what a user may not expect."""

    split: str
    pairs: int
    skipped: tuple[Skipped, ...]
    polarity: str
    masks: int = 0
    already_there: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class _Truth:
    """A mask as it is kept: changed, not scored (None: all is), and how many pixels were stray."""

    changed: Rle
    ignored: Rle | None
    stray_px: int


def import_split(
    store: Store,
    name: str,
    place: Path,
    settings: ImportSettings,
    progress: Progress,
    *,
    dry_run: bool = False,
) -> ImportReport:
    """Import one split; a split that already exists is left unchanged.

    Args:
        place: as `layouts.find_splits` returns it.
        dry_run: read and check everything, write nothing.

    Raises:
        InvalidInput: for any bad file; the message names it, and nothing of the split is stored.
    """
    if not name.isprintable() or not name or name in (".", "..") or set(name) & set("/\\:"):
        raise InvalidInput(f"split {name!r}: a name has no slash, colon or dots alone; use --split")
    if name in {split.name for split in list_splits(store)}:
        return ImportReport(name, 0, (), "", already_there=True)
    files = read_layout(place, settings.layout)
    folder = place.parent.parent if place.is_file() else place
    references, lives, masks = files.references, files.lives, files.masks
    poses = poses_of(folder, settings)
    matches, unpaired = match_images(references, lives, poses, settings)
    skipped = [*files.skipped, *unpaired]
    jobs = [
        *(references[n] for n in sorted({m[0] for m in matches})),
        *(lives[m[1]] for m in matches),
    ]
    checked = dict(zip(jobs, _parallel(_attempt(check_image), jobs, name, progress), strict=True))
    bad = {
        live: error
        for reference, live, _ in matches
        if (error := _fault(name, live, checked, references[reference], lives[live], masks))
    }
    matches = _without(matches, lives, bad, settings, skipped)
    masked = [live for _, live, _ in matches if live in masks]
    rule = find_rule([masks[live] for live in masked], settings)
    with ThreadPoolExecutor() as pool:
        read = pool.map(_attempt(_reader(rule)), [masks[live] for live in masked])
        found = dict(zip(masked, read, strict=True))
    truths = {live: truth for live, truth in found.items() if isinstance(truth, _Truth)}
    bad = {live: error for live, error in found.items() if isinstance(error, InvalidInput)}
    matches = _without(matches, lives, bad, settings, skipped)
    if not matches:
        raise InvalidInput(f"{folder}: no pairs; {_why(skipped)}")
    used = {m[0]: references[m[0]] for m in sorted(matches)}, {m[1]: lives[m[1]] for m in matches}
    images = {
        path: image
        for paths in used
        for path in paths.values()
        if isinstance(image := checked[path], CheckedImage)
    }
    notes = _notes(folder, poses, settings, list(images.values()), list(truths.values()))
    grid = _map(store, folder)
    report = ImportReport(
        name, len(matches), tuple(skipped), rule.says, len(truths), notes=tuple(notes)
    )
    if dry_run:
        return report
    add_split(
        store,
        name,
        settings.layout,
        [
            *_new_images(store, "reference", used[0], images, poses),
            *_new_images(store, "live", used[1], images, poses),
        ],
        [_new_pair(match, truths) for match in matches],
        grid,
    )
    return report


def _why(skipped: Sequence[tuple[Path, str]]) -> str:
    if not skipped:
        return "the folders hold no images"
    path, reason = skipped[0]
    return f"{len(skipped)} files skipped, the first is {path.name}: {reason}"


def _fault(
    split: str, name: str, checked: Checked, past: Path, present: Path, masks: Mapping[str, Path]
) -> InvalidInput | None:
    """Return what is wrong with the images of a pair, or with the size of its mask."""
    reference, live = checked[past], checked[present]
    if isinstance(reference, InvalidInput):
        return reference
    if isinstance(live, InvalidInput):
        return live
    if (reference.height, reference.width) != (live.height, live.width):
        return InvalidInput(
            f"pair {split}/{name}: live {live.path} is {live.width}x{live.height}"
            f" but reference {reference.path} is {reference.width}x{reference.height}"
        )
    if name not in masks:
        return None
    # The header is enough, and a mask that claims to be huge is not decoded.
    size = _attempt(image_size)(masks[name])
    if isinstance(size, InvalidInput):
        return size
    if size != (live.height, live.width):
        return InvalidInput(
            f"{masks[name]}: is {size[1]}x{size[0]} but its live image is"
            f" {live.width}x{live.height}"
        )
    return None


def _without(
    matches: list[Match],
    lives: Mapping[str, Path],
    bad: Mapping[str, InvalidInput],
    settings: ImportSettings,
    skipped: list[Skipped],
) -> list[Match]:
    """Return the matches without bad pairs, which are skipped with the reason.

    Raises:
        InvalidInput: the first reason, when bad pairs are not to be skipped.
    """
    if bad and not settings.skip_bad:
        first = next(iter(bad.values()))
        raise InvalidInput(f"{first} (--skip-bad leaves such pairs out)") from first
    skipped += [(lives[live], f"bad pair, {error}") for live, error in bad.items()]
    return [match for match in matches if match[1] not in bad]


def _attempt(work: Callable[[Path], T]) -> Callable[[Path], T | InvalidInput]:
    def tried(path: Path) -> T | InvalidInput:
        try:
            return work(path)
        except InvalidInput as error:
            return error

    return tried


def _reader(rule: MaskRule) -> Callable[[Path], _Truth]:
    def read(path: Path) -> _Truth:
        truth = rule.read(path)
        ignored = None if truth.ignored is None else encode_rle(truth.ignored)
        return _Truth(encode_rle(truth.changed), ignored, truth.stray_px)

    return read


def _notes(
    folder: Path,
    poses: Poses,
    settings: ImportSettings,
    images: Sequence[CheckedImage],
    truths: Sequence[_Truth],
) -> Iterator[str]:
    """Return notices about what was changed in files on reading."""
    if poses:
        unit = "degrees" if settings.heading == "degrees" else "radians"
        yield f"viewpoints are x, y in metres and heading (column theta) in {unit}"
    turned = sum(image.turned for image in images)
    if turned:
        yield f"{turned} images are turned as their EXIF orientation says"
    clear = sum(image.transparent for image in images)
    if clear:
        yield f"{clear} images have transparency, which is left out"
    ignored = sum(truth.ignored is not None for truth in truths)
    if ignored:
        yield f"{ignored} masks hold pixels that are not scored"
    stray = [truth.stray_px for truth in truths if truth.stray_px]
    if stray:
        yield (
            f"{sum(stray)} stray pixels in {len(stray)} masks count as the nearest level that means"
            " something"
        )


def _parallel(
    work: Callable[[Path], T], paths: Sequence[Path], name: str, progress: Progress
) -> Iterator[T]:
    with ThreadPoolExecutor() as pool:
        for done, result in enumerate(pool.map(work, paths), start=1):
            progress(name, done, len(paths))
            yield result


def _new_pair(match: Match, truths: Mapping[str, _Truth]) -> NewPair:
    reference, live, distance = match
    truth = truths.get(live)
    if truth is None:
        return NewPair(live, reference, live, distance, None)
    return NewPair(live, reference, live, distance, truth.changed, truth.ignored)


def _new_images(
    store: Store,
    session: str,
    paths: Mapping[str, Path],
    checked: Mapping[Path, CheckedImage],
    poses: Poses,
) -> list[NewImage]:
    images = []
    for name, path in paths.items():
        image, stamped = checked[path], poses.get((session, name))
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
    if not (description.exists() or description.is_symlink()):
        return None
    image, grid = read_map(description, folder)
    return NewMap(relative_path(store, image), hash_file(image), grid)


def relative_path(store: Store, path: Path) -> str:
    """Return a path as the store keeps it: relative to the database's folder, with slashes."""
    return Path(os.path.relpath(path.resolve(), store.folder)).as_posix()
