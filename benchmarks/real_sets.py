"""Pairs made of real photographs, written as folders that the importer reads (layout `t0t1`).

Three sets. `parallax`: two real views of a room, far apart, the later one with small objects on it.
`same_view`: one real view, shown twice with other light, noise and compression; things were added
or taken away. `people`: fixed indoor cameras with masks drawn by people, as they are.

Objects are instances of photographs, 6 to 60 px long. They are put in here by another compositor
than training's: Poisson blending or an alpha border, a cast shadow, the sharpness of the place.
One pair in ten is empty. The same seed writes the same bytes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from pycocotools.coco import COCO

from reviewer.dataset.files import read_rgb
from reviewer.masks import Mask, encode_png
from reviewer.models.interfaces import Image

WIDTH, HEIGHT = 640, 480
EMPTY_SHARE = 0.1
TAKEN_SHARE = 0.3
"""How many objects of `same_view` are only in the reference."""
POISSON_SHARE = 0.5
LONG_PX = (6.0, 60.0)
MOST_OBJECTS = 4
LEAST_SOURCE_PX = 24
"""Shortest side of an instance that is used: smaller ones are smears when enlarged."""


@dataclass(frozen=True, slots=True)
class Thing:
    """A cut-out: uint8 RGB (h, w, 3) and bool (h, w)."""

    picture: Image
    mask: Mask


def read_things(folder: Path) -> list[Thing]:
    """Return the instances of a COCO folder that are whole and large enough."""
    with redirect_stdout(sys.stderr):  # it tells of its progress on the way
        coco = COCO(str(folder / "instances.json"))
    found = []
    for note in coco.loadAnns(coco.getAnnIds(iscrowd=False)):
        (about,) = coco.loadImgs(note["image_id"])
        mask = coco.annToMask(note).astype(bool)
        x, y, width, height = (round(v) for v in note["bbox"])
        inside = (
            x > 1 and y > 1 and x + width < mask.shape[1] - 1 and y + height < mask.shape[0] - 1
        )
        if not inside or min(width, height) < LEAST_SOURCE_PX:
            continue
        window = np.s_[y - 1 : y + height + 1, x - 1 : x + width + 1]
        picture = read_rgb(folder / "images" / about["file_name"])
        found.append(Thing(picture[window].copy(), mask[window].copy()))
    return found


def scaled(thing: Thing, long_px: float, rng: np.random.Generator) -> Thing:
    """Return a cut-out turned by some degrees, `long_px` on its longer side."""
    height, width = thing.mask.shape
    angle = np.deg2rad(rng.uniform(-40, 40))
    factor = long_px / max(height, width)
    side = int(np.ceil(long_px * 1.5)) + 4
    cosine, sine = factor * np.cos(angle), factor * np.sin(angle)
    to = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0]])
    to[:, 2] = side / 2 - to[:, :2] @ (width / 2, height / 2)
    # Shrinking by `warpAffine` alone would skip pixels.
    blur = max(0.0, 0.4 / factor - 0.4)
    source = cv2.GaussianBlur(thing.picture, (0, 0), blur) if blur > 0.1 else thing.picture
    solid = thing.mask.astype(np.float32)
    solid = cv2.GaussianBlur(solid, (0, 0), blur) if blur > 0.1 else solid
    picture = cv2.warpAffine(source, to, (side, side), borderMode=cv2.BORDER_REPLICATE)
    mask = cv2.warpAffine(solid, to, (side, side)) > 0.5
    return Thing(np.asarray(picture, np.uint8), mask)


def put(
    picture: Image, taken: Mask, things: list[Thing], rng: np.random.Generator
) -> tuple[Image, Mask]:
    """Put a thing on a picture where nothing was put yet; return the picture and its mask."""
    height, width = picture.shape[:2]
    for _ in range(50):
        thing = scaled(
            things[rng.integers(len(things))], np.exp(rng.uniform(*np.log(LONG_PX))), rng
        )
        side = len(thing.mask)
        top, left = rng.integers(2, height - side - 2), rng.integers(2, width - side - 2)
        window = np.s_[top : top + side, left : left + side]
        if thing.mask.sum() >= 12 and not taken[window].any():
            break
    else:
        return picture, np.zeros((height, width), np.bool_)
    mask = np.zeros((height, width), np.bool_)
    mask[window] = thing.mask
    result = _shadowed(picture, mask, rng)
    sharp = _sharpness(picture[window])
    own = cv2.GaussianBlur(thing.picture, (0, 0), sharp)
    if rng.random() < POISSON_SHARE:
        grown = cv2.dilate(thing.mask.astype(np.uint8), np.ones((3, 3), np.uint8)) * 255
        rows, columns = (np.flatnonzero(grown.any(axis=axis)) for axis in (1, 0))
        middle = (
            int(left + (columns[0] + columns[-1] + 1) // 2),
            int(top + (rows[0] + rows[-1] + 1) // 2),
        )
        blended = cv2.seamlessClone(own, result, grown, middle, cv2.NORMAL_CLONE)
        # Blending may dissolve a thing; half of its own colour keeps it there to be found.
        own_full = result.copy()
        own_full[window][thing.mask] = own[thing.mask]
        result = cv2.addWeighted(blended, 0.5, own_full, 0.5, 0)
    else:
        alpha = cv2.GaussianBlur(thing.mask.astype(np.float32), (0, 0), sharp)[..., None]
        place = result[window].astype(np.float32)
        result[window] = np.uint8(place * (1 - alpha) + own * alpha)
    return np.asarray(result, np.uint8), mask


def _shadowed(picture: Image, mask: Mask, rng: np.random.Generator) -> Image:
    """Darken the ground beside a thing, softly."""
    reach = 1 + 0.15 * np.sqrt(mask.sum())
    by = np.float32([[1, 0, rng.uniform(-reach, reach)], [0, 1, rng.uniform(0.3, 1) * reach]])
    moved = cv2.warpAffine(mask.astype(np.float32), by, mask.shape[::-1])
    soft = cv2.GaussianBlur(moved, (0, 0), reach)[..., None] * rng.uniform(0.1, 0.4)
    return np.asarray(picture * (1 - soft), np.uint8)


def _sharpness(place: Image) -> float:
    """Return the blur, standard deviation in pixels, that makes a thing as soft as its place."""
    grey = cv2.cvtColor(place, cv2.COLOR_RGB2GRAY)
    edges = float(np.percentile(np.abs(cv2.Laplacian(grey, cv2.CV_32F)), 98))
    return float(np.clip(1.3 - edges / 60, 0.4, 1.2))


def shown_again(picture: Image, rng: np.random.Generator) -> Image:
    """Return a picture under other light: exposure, white balance, gamma, noise, compression."""
    light = picture.astype(np.float32) / 255
    gain = rng.uniform(0.82, 1.18) * rng.uniform(0.96, 1.04, 3)
    light = np.clip(light ** rng.uniform(0.9, 1.1) * gain, 0, 1) * 255
    light += rng.normal(0, rng.uniform(1, 4), light.shape)
    coded = np.clip(light, 0, 255).astype(np.uint8)
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(80, 96))]
    _, data = cv2.imencode(".jpg", coded[..., ::-1], quality)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR)[..., ::-1])


def view_pairs(folder: Path) -> Iterator[tuple[str, Image, Image]]:
    """Yield two views of each room, in both orders."""
    for line in (folder / "real_frames/pairs.txt").read_text().splitlines():
        first, second = (_sized(read_rgb(folder / "real_frames" / n)) for n in line.split()[:2])
        scene = line.split("_frame")[0]
        yield f"{scene}-a", first, second
        yield f"{scene}-b", second, first


def _sized(picture: Image) -> Image:
    return np.asarray(cv2.resize(picture, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA))


def write_sets(data: Path, target: Path, seed: int) -> dict[str, list[Path]]:
    """Write `parallax` and `same_view`; return the folders of every set, `people` among them."""
    things = read_things(data / "tiny_coco")
    for name in ("parallax", "same_view"):
        rng = np.random.default_rng([seed, len(name)])
        for title, past, present in view_pairs(data):
            if name == "same_view":
                past = present
            _write_pair(target / name, title, *_changed(name, past, present, things, rng))
    people = sorted(p for p in (data / "real_pairs").iterdir() if p.is_dir())
    return {
        "parallax": [target / "parallax"],
        "same_view": [target / "same_view"],
        "people": people,
    }


def _changed(
    name: str, past: Image, present: Image, things: list[Thing], rng: np.random.Generator
) -> tuple[Image, Image, Mask]:
    past, present = past.copy(), present.copy()
    mask = np.zeros(present.shape[:2], np.bool_)
    if rng.random() >= EMPTY_SHARE:
        for _ in range(rng.integers(1, MOST_OBJECTS + 1)):
            # Where a thing stood in the live view is known only when both views are one.
            if name == "same_view" and rng.random() < TAKEN_SHARE:
                past, own = put(past, mask, things, rng)
            else:
                present, own = put(present, mask, things, rng)
            mask |= own
    return past, shown_again(present, rng), mask


def _write_pair(folder: Path, title: str, past: Image, present: Image, mask: Mask) -> None:
    for part, picture in (("t0", past), ("t1", present)):
        (folder / part).mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(folder / part / f"{title}.png"), picture[..., ::-1])
    (folder / "mask").mkdir(exist_ok=True)
    (folder / "mask" / f"{title}.png").write_bytes(encode_png(mask))
