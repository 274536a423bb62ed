"""Import splits into the store: all of a split or nothing of it, with every skipped file told.

Images stay where they are; the store keeps their path relative to the database. Where things lie is
the matter of `layouts`; `sequence` is paired by viewpoint, all others by file name.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reviewer.dataset.files import CheckedImage, check_image, hash_file, read_grey
from reviewer.dataset.layouts import (
    Layout,
    MaskReader,
    Polarity,
    Skipped,
    mask_reader,
    read_layout,
)
from reviewer.dataset.poses import StampedPose, closest_references, read_map, read_poses
from reviewer.errors import InvalidInput
from reviewer.masks import Rle, encode_rle
from reviewer.store.database import Store
from reviewer.store.pairs import NewImage, NewMap, NewPair, add_split, list_splits

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class ImportReport:
    """What became of a split: pairs written (or that would be), files skipped with the reason, how
    many pairs have a mask, and the polarity used."""

    split: str
    pairs: int
    skipped: tuple[Skipped, ...]
    polarity: str
    masks: int = 0
    already_there: bool = False


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """How to read a split.

    Attributes:
        layout: folder layout, see `layouts`.
        polarity: which mask colour is "changed"; "auto" takes the one with fewer pixels.
        max_distance: largest viewpoint distance of a pair, metres (layout `sequence`).
        metres_per_radian: weight of heading in the viewpoint distance.
    """

    layout: Layout = "sequence"
    polarity: Polarity = "auto"
    max_distance: float = 0.5
    metres_per_radian: float = 1.0


def import_split(
    store: Store,
    name: str,
    place: Path,
    settings: ImportSettings,
    progress: Progress,
    *,
    dry_run: bool = False,
) -> ImportReport:
    """Import one split; one that is there already is left alone.

    Args:
        place: as `layouts.find_splits` returns it.
        dry_run: read and check everything, write nothing.

    Raises:
        InvalidInput: for any bad file; the message names it, and nothing of the split is stored.
    """
    if not name or name in (".", "..") or set(name) & set("/\\:\0"):
        raise InvalidInput(f"split {name!r}: a name has no slash, colon or dots alone; use --split")
    if name in {split.name for split in list_splits(store)}:
        return ImportReport(name, 0, (), "", already_there=True)
    files = read_layout(place, settings.layout)
    folder = place.parent.parent if place.is_file() else place
    references, lives, masks, skipped = files.references, files.lives, files.masks, files.skipped
    poses = _poses(folder, settings.layout)
    matches, unpaired = _match(references, lives, poses, settings)
    skipped = skipped + unpaired
    if not matches:
        raise InvalidInput(f"{folder}: no pairs; {_why(skipped)}")
    used_references = sorted({reference for reference, _, _ in matches})
    jobs = [references[n] for n in used_references] + [lives[live] for _, live, _ in matches]
    checked = dict(zip(jobs, _parallel(check_image, jobs, name, progress), strict=True))
    for reference, live, _ in matches:
        _check_sizes(name, live, checked[references[reference]], checked[lives[live]])
    masked = [live for _, live, _ in matches if live in masks]
    black, polarity = _polarity([masks[live] for live in masked], settings)
    read = mask_reader(settings.layout, settings.polarity, black)
    truths = dict(zip(masked, _read_masks(masks, lives, masked, checked, read), strict=True))
    report = ImportReport(name, len(matches), tuple(skipped), polarity, len(masked))
    if dry_run:
        return report
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
    return report


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
    if settings.layout != "sequence":
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


def _check_sizes(split: str, name: str, reference: CheckedImage, live: CheckedImage) -> None:
    if (reference.height, reference.width) != (live.height, live.width):
        raise InvalidInput(
            f"pair {split}/{name}: live {live.path} is {live.width}x{live.height}"
            f" but reference {reference.path} is {reference.width}x{reference.height}"
        )


def _polarity(masks: Sequence[Path], settings: ImportSettings) -> tuple[bool, str]:
    """Return (black is changed, how that was decided); guesses from up to 50 masks."""
    wanted = settings.polarity
    known = {
        "vl-cmu-cd": "1 to 254 = changed (255 is sky)",
        "changesim": "not black = changed",
        "pscd": "above 0 = changed",
    }
    if settings.layout in ("vl-cmu-cd", "changesim") and wanted != "auto":
        raise InvalidInput(f"polarity {wanted}: masks of layout {settings.layout} have their own")
    if settings.layout in known and wanted == "auto":
        return False, f"{known[settings.layout]} (layout {settings.layout})"
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
    read: MaskReader,
) -> list[Rle]:
    def encoded(name: str) -> Rle:
        mask = read(masks[name])
        image = checked[lives[name]]
        if mask.shape != (image.height, image.width):
            raise InvalidInput(
                f"{masks[name]}: is {mask.shape[1]}x{mask.shape[0]} but its live image is"
                f" {image.width}x{image.height}"
            )
        return encode_rle(mask)

    with ThreadPoolExecutor() as pool:
        return list(pool.map(encoded, names))


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
