"""Folder layouts of change detection sets: where references, live images and masks lie.

    sequence    reference/ live/ mask/ poses.csv map.yaml: two drives, paired by viewpoint
    t0t1        t0/ t1/ mask/ (or gt/), or A/ B/ label/ with list/*.txt: pairs by file name
                (PCD, pcd_5cv, VL-CMU-CD, ChangeVPR, LEVIR-CD, WHU)
    vl-cmu-cd   NNN/RGB/1_XX.png 2_XX.png, NNN/GT/gtXX.png: changed where 0 < value < 255
    pscd        t0/ t1/ mask_t1/ (mask_t0/ is in the other frame and is not read)
    changesim   .../Seq_N/ with rgb/, t0/rgb/ and change_segmentation/: changed where not black

Reads names, never pixels; what the masks mean is the matter of `truths`, the rest of `importer`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from reviewer.dataset.documents import read_text
from reviewer.dataset.files import list_images
from reviewer.errors import InvalidInput, NotFound
from reviewer.words import Layout

Skipped = tuple[Path, str]

FOLDERS: dict[Layout, list[tuple[str, str, str]]] = {
    "sequence": [("reference", "live", "mask")],
    "t0t1": [("t0", "t1", "mask"), ("A", "B", "label"), ("t0", "t1", "gt")],
    "vl-cmu-cd": [("RGB", "RGB", "GT")],
    "pscd": [("t0", "t1", "mask_t1")],
    "changesim": [("t0/rgb", "rgb", "change_segmentation")],
}
"""Folder names of reference, live and mask; a set that is there with its masks goes first."""
DEPTH: dict[Layout, int] = {"t0t1": 2, "vl-cmu-cd": 2, "changesim": 4}
"""Levels below the folder at which splits are looked for, where not 1."""
PREFIXES = ("1_", "2_", "gt")


@dataclass(frozen=True, slots=True)
class LayoutFiles:
    """Files of a split by pair name, and what was skipped with the reason."""

    references: dict[str, Path]
    lives: dict[str, Path]
    masks: dict[str, Path]
    skipped: list[Skipped]


def find_splits(folder: Path, layout: Layout) -> list[tuple[str, Path]]:
    """Return (name, place) of the split in `folder`, or of those below; a place is a folder, or a
    list of file names inside one.

    Raises:
        NotFound: when there is none.
    """
    if not folder.is_dir():
        raise NotFound(f"{folder}: is not a folder")
    found = _below(folder.resolve(), layout, DEPTH.get(layout, 1), "")
    if not found:
        wanted = " or ".join(f"{a}/ {b}/" for a, b, _ in FOLDERS[layout])
        levels = DEPTH.get(layout, 1)
        below = "one level below" if levels == 1 else f"in {levels} levels below"
        raise NotFound(f"{folder}: no {wanted} in it nor {below} (layout {layout})")
    return found


def _below(folder: Path, layout: Layout, depth: int, name: str) -> list[tuple[str, Path]]:
    if names_in(folder, layout):
        own = name or folder.name
        lists = sorted((folder / "list").glob("*.txt")) if layout == "t0t1" else []
        return [(f"{own}-{each.stem}", each) for each in lists] or [(own, folder)]
    if not depth:
        return []
    found = []
    for path in sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith(".")):
        found += _below(path, layout, depth - 1, f"{name}-{path.name}" if name else path.name)
    return found


def names_in(folder: Path, layout: Layout) -> tuple[str, str, str] | None:
    """Return the folder names of a split; None when it has not this layout."""
    found = [names for names in FOLDERS[layout] if all((folder / n).is_dir() for n in names[:2])]
    with_masks = [names for names in found if (folder / names[2]).is_dir()]
    return next(iter(with_masks + found), None)


def read_layout(place: Path, layout: Layout) -> LayoutFiles:
    """Return the files of a split; `place` as `find_splits` returns it.

    Raises:
        NotFound: when it has not this layout.
        InvalidInput: for two files of one name, or a link that leads out of the folder.
    """
    only = None
    if place.is_file():
        only = {
            Path(line.split()[0]).stem for line in read_text(place).splitlines() if line.strip()
        }
        place = place.parent.parent
    names = names_in(place, layout)
    if names is None:
        raise NotFound(f"{place}: does not have the layout {layout}")
    if layout == "vl-cmu-cd":
        return _numbered(place)
    references, skipped = list_images(place / names[0], place)
    lives, more = list_images(place / names[1], place)
    masks, others = _if_there(place / names[2], place)
    skipped += more + others
    if only is not None:
        missing = sorted(only - set(lives))
        if missing:
            raise InvalidInput(f"{place}: its list names {missing[0]}, which is not in {names[1]}/")
        references, lives, masks = (
            {name: path for name, path in found.items() if name in only}
            for found in (references, lives, masks)
        )
    skipped += [(path, "no live image of that name") for n, path in masks.items() if n not in lives]
    return LayoutFiles(references, lives, {n: p for n, p in masks.items() if n in lives}, skipped)


def _numbered(place: Path) -> LayoutFiles:
    """VL-CMU-CD as it was published: one folder for both pictures, told by the prefix."""
    pictures, skipped = list_images(place / "RGB", place)
    truths, more = _if_there(place / "GT", place)
    references, lives, masks = (
        {n.removeprefix(prefix): p for n, p in found.items() if n.startswith(prefix)}
        for prefix, found in zip(PREFIXES, (pictures, pictures, truths), strict=True)
    )
    odd = [p for n, p in pictures.items() if not n.startswith(PREFIXES[:2])]
    odd += [p for n, p in truths.items() if not n.startswith(PREFIXES[2])]
    skipped += more + [(path, "its name begins with none of 1_, 2_, gt") for path in odd]
    return LayoutFiles(references, lives, masks, skipped)


def _if_there(folder: Path, root: Path) -> tuple[dict[str, Path], list[Skipped]]:
    return list_images(folder, root) if folder.is_dir() else ({}, [])
