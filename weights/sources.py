"""Gather what the shipped nets learn from: free pictures and models out of Debian packages.

    python weights/sources.py TARGET [--packages FOLDER]

Packages are fetched with `apt-get download` (or taken from FOLDER) and unpacked; that needs Debian.
TARGET is written whole or not at all. It then holds

- `backgrounds/*.jpg`: photographs, paintings and surfaces, no side over 1600 px,
- `objects/instances.json`, `objects/images/*.png`: cut-outs with their masks, as a COCO file,
- `models/**/*.obj`: three-dimensional models, for `rooms.py`,
- `sources.csv`: every package with version, licence and hash. The one beside this script is of the
  nets that are shipped; what differs from it is told.

No photograph of a benchmark is among them. The licences are those that the packages state.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import skimage
from models import unpack_models
from procedural import draw_things
from pycocotools import mask as coco

from reviewer.atomic import whole_folder

Row = tuple[str, ...]

LONGEST_PX = 1600
LEAST_SURFACE_PX = 128
PROCEDURAL = 1500
RECORDED = Path(__file__).parent / "sources.csv"


@dataclass(frozen=True, slots=True)
class Package:
    """A Debian package, what its copyright file says, and what is taken: globs inside it."""

    name: str
    licence: str
    backgrounds: tuple[str, ...] = ()
    cutouts: tuple[str, ...] = ()
    furniture: str = ""


PACKAGES = (
    Package(
        "sweethome3d-furniture",
        "CC-BY-3.0 and CC0-1.0 (Kator and Legaz, Reallusion, Scopia, BlendSwap contributors)",
        furniture="usr/share/sweethome3d/furniture/*.sh3f",
    ),
    Package(
        "tuxpaint-stamps-default",
        "GPL-2 (Bill Kendrick and contributors)",
        cutouts=tuple(
            f"usr/share/tuxpaint/stamps/{part}/**/*.png"
            for part in (
                *("animals", "clothes", "food", "hobbies", "household", "plants", "seasonal"),
                *("sports", "symbols/money", "town/roadsigns", "vehicles", "military"),
            )
        ),
    ),
    Package(
        "gnome-backgrounds",
        "CC-BY-SA-3.0, GPL-2+ (GNOME artists)",
        backgrounds=("usr/share/backgrounds/gnome/*.webp",),
    ),
    Package(
        "plasma-workspace-wallpapers",
        "GPL-2+ (KDE Visual Design Group)",
        backgrounds=("usr/share/wallpapers/*/contents/images*/[0-9]*x*.*",),
    ),
    Package(
        "mate-backgrounds",
        "GPL-2+, CC-BY-SA-4.0 (MATE artists)",
        backgrounds=(
            "usr/share/backgrounds/mate/nature/*.jpg",
            "usr/share/backgrounds/mate/abstract/Elephants.jpg",
        ),
    ),
    Package(
        "ukui-wallpapers",
        "CC-BY-SA-3.0 (Ubuntu Kylin contributors)",
        backgrounds=("usr/share/backgrounds/*.jpg", "usr/share/backgrounds/*.png"),
    ),
)

SKIMAGE = ("astronaut", "coffee", "chelsea", "rocket", "brick", "grass", "gravel")
"""Pictures in scikit-image's wheel: public domain or CC0."""


def unpacked(package: Package, cache: Path, target: Path) -> tuple[Path, Path]:
    """Return the .deb and the folder of its files."""
    found = sorted(cache.glob(f"{package.name}_*.deb"))
    if not found:
        subprocess.run(["apt-get", "download", package.name], cwd=cache, check=True)
        found = sorted(cache.glob(f"{package.name}_*.deb"))
    folder = target / package.name
    subprocess.run(["dpkg-deb", "-x", str(found[-1]), str(folder)], check=True)
    return found[-1], folder


def write_background(picture: npt.NDArray[np.uint8] | None, path: Path) -> None:
    """Write a picture as JPEG, made smaller where it is large; tiny and blank ones are left out."""
    if picture is None or min(picture.shape[:2]) < LEAST_SURFACE_PX or picture.std() < 4:
        return
    if picture.ndim == 2:
        picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), np.uint8)
    shrink = LONGEST_PX / max(picture.shape[:2])
    if shrink < 1:
        picture = cv2.resize(picture, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(path), picture[..., :3], [cv2.IMWRITE_JPEG_QUALITY, 95])


def solid_cutout(picture: npt.NDArray[np.uint8] | None) -> npt.NDArray[np.uint8] | None:
    """Return a BGRA picture that has something solid and something empty in it, else None."""
    if picture is None or picture.ndim != 3 or picture.shape[2] != 4:
        return None
    solid = picture[..., 3] > 127
    fits = 0.02 < solid.mean() < 0.98 and solid.sum() > 150
    return picture if fits else None


def cutouts_of(folder: Path, package: Package) -> Iterator[npt.NDArray[np.uint8]]:
    """Yield the BGRA cut-outs of a package."""
    for pattern in package.cutouts:
        for path in sorted(folder.glob(pattern)):
            cutout = solid_cutout(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
            if cutout is not None:
                yield cutout


def open_furniture(archive: Path, models: Path, backgrounds: Path) -> list[npt.NDArray[np.uint8]]:
    """Unpack models, put their surfaces with the backgrounds; return the pictures of the models."""
    folder = models / archive.stem
    with zipfile.ZipFile(archive) as content:
        content.extractall(folder)
    for path in sorted(folder.rglob("*.jpg")):
        if path.stat().st_size > 20_000:
            name = "-".join(path.relative_to(models).parts)
            write_background(cv2.imread(str(path)), backgrounds / f"surface-{name}")
    icons = sorted(folder.glob("*/*.png"))
    pictures = (solid_cutout(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)) for path in icons)
    return [picture for picture in pictures if picture is not None]


def write_objects(cutouts: list[tuple[str, npt.NDArray[np.uint8]]], folder: Path) -> None:
    """Write cut-outs as a COCO instances file with one picture each."""
    (folder / "images").mkdir(parents=True)
    names = sorted({name for name, _ in cutouts})
    images, annotations = [], []
    for number, (name, cutout) in enumerate(cutouts, start=1):
        file = f"{number:05}.png"
        mask = np.asfortranarray(cutout[..., 3] > 127)
        height, width = mask.shape
        cv2.imwrite(str(folder / "images" / file), cutout[..., :3])
        runs = coco.encode(mask.view(np.uint8))
        images.append({"id": number, "file_name": file, "height": height, "width": width})
        annotations.append(
            {
                "id": number,
                "image_id": number,
                "category_id": names.index(name) + 1,
                "iscrowd": 0,
                "area": int(mask.sum()),
                "bbox": [float(v) for v in coco.toBbox(runs)],
                "segmentation": {"size": [height, width], "counts": runs["counts"].decode()},
            }
        )
    categories = [{"id": k, "name": name} for k, name in enumerate(names, start=1)]
    content = {"images": images, "annotations": annotations, "categories": categories}
    (folder / "instances.json").write_text(json.dumps(content))


def differing(rows: Sequence[Row], recorded: Path) -> list[str]:
    """Return what was gathered from other packages than those that are recorded."""
    with recorded.open(newline="") as file:
        known = {row[0]: row for row in csv.reader(file)}
    return [
        f"{row[0]}: is {' '.join(row[1:])}, but the shipped nets learned from"
        f" {' '.join(known.get(row[0], ('', 'none'))[1:])}"
        for row in rows
        if list(row) != known.get(row[0])
    ]


def gather(target: Path, packages: Path | None) -> list[Row]:
    """Fill a folder; return a row of `sources.csv` for every package."""
    backgrounds = target / "backgrounds"
    backgrounds.mkdir()
    cutouts: list[tuple[str, npt.NDArray[np.uint8]]] = []
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as place:
        for package in PACKAGES:
            cache = (packages or Path(place)).resolve()
            deb, folder = unpacked(package, cache, Path(place))
            for pattern in package.backgrounds:
                for path in sorted(folder.glob(pattern)):
                    name = "-".join((package.name, *path.parts[-4:])).rpartition(".")[0]
                    write_background(cv2.imread(str(path)), backgrounds / f"{name}.jpg")
            cutouts += [(package.name, c) for c in cutouts_of(folder, package)]
            archives = sorted(folder.glob(package.furniture)) if package.furniture else []
            unpack_models(archives, target / "models")
            for archive in archives:
                pictures = open_furniture(archive, Path(place) / "models", backgrounds)
                cutouts += [(package.name, picture) for picture in pictures]
            digest = hashlib.sha256(deb.read_bytes()).hexdigest()
            rows.append((package.name, deb.name.split("_")[1], package.licence, digest))
    for name in SKIMAGE:
        picture = np.asarray(getattr(skimage.data, name)())
        turned = picture[..., ::-1] if picture.ndim == 3 else picture
        write_background(np.ascontiguousarray(turned), backgrounds / f"skimage-{name}.jpg")
    rows.append(("scikit-image", version("scikit-image"), "public domain, CC0-1.0", ""))
    read = (cv2.imread(str(path)) for path in sorted(backgrounds.glob("*.jpg")))
    surfaces = [np.asarray(surface, np.uint8) for surface in read]
    cutouts += [("procedural", c) for c in draw_things(surfaces, PROCEDURAL, seed=0)]
    write_objects(cutouts, target / "objects")
    with (target / "sources.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("package", "version", "licence", "sha256"), *rows])
    print(f"{len(surfaces)} backgrounds, {len(cutouts)} cut-outs")
    return rows


def main() -> None:
    """Gather everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", type=Path)
    parser.add_argument("--packages", type=Path, help="folder of .deb files; fetched if missing")
    given = parser.parse_args()
    for tool in ("apt-get", "dpkg-deb"):
        if shutil.which(tool) is None:
            sys.exit(f"{tool}: is not here; packages of Debian are needed, and what unpacks them")
    with whole_folder(given.target) as work:
        rows = gather(work, given.packages)
    for line in differing(rows, RECORDED):
        print(line)


if __name__ == "__main__":
    main()
