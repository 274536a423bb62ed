"""Objects to paste: cut out of COCO images by their instance masks, kept in memory.

Polygons and run-lengths are read, crowds are not objects. Of a large file only as many objects are
cut out as the bank holds, chosen by the seed.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from pycocotools import mask as coco

from reviewer.dataset.files import hash_file, read_rgb
from reviewer.errors import InvalidInput, NotFound
from reviewer.masks import Mask, decode_rle, read_rle

LARGEST_SIDE_PX = 256
"""Cutouts are kept no larger: nothing larger is pasted on a 640x480 picture."""


@dataclass(frozen=True, slots=True)
class Cutout:
    """An object: uint8 RGB (h, w, 3), uint8 alpha (h, w; 255 = object), its category.

    Colours go on beyond the alpha's edge, so that scaling it brings no background with it.
    """

    pixels: npt.NDArray[np.uint8]
    alpha: npt.NDArray[np.uint8]
    category: str


@dataclass(frozen=True, slots=True)
class Bank:
    """Objects to choose from, what was left out and why, and a hash of all that decides them."""

    objects: tuple[Cutout, ...]
    left_out: dict[str, int]
    sha256: str

    def split(self, held_out: float) -> tuple[Bank, Bank]:
        """Return the bank in two, so that validation meets objects that training never saw."""
        count = max(1, round(len(self.objects) * held_out))
        if count >= len(self.objects):
            raise InvalidInput(
                f"object bank: {len(self.objects)} object is too few to keep some for validation"
            )
        # Every k-th, not the first few: neighbours in a file are of one image or category.
        step = len(self.objects) / count
        kept = {int(k * step) for k in range(count)}
        rest = tuple(o for k, o in enumerate(self.objects) if k not in kept)
        held = tuple(o for k, o in enumerate(self.objects) if k in kept)
        return Bank(rest, self.left_out, self.sha256), Bank(held, self.left_out, self.sha256)


def load_bank(
    instances: Path,
    images: Path,
    *,
    categories: Sequence[str] = (),
    least_area_px: int = 400,
    size: int = 2000,
    seed: int = 0,
) -> Bank:
    """Cut objects out of a COCO instances file.

    Args:
        instances: JSON file with `images`, `annotations`, `categories`.
        images: folder with the images that the file names.
        categories: names of the categories wanted; all when empty.
        least_area_px: objects with fewer pixels are left out.
        size: most objects to cut out.

    Raises:
        InvalidInput: when the file is no COCO instances file, or no object is left; says why.
        NotFound: when a category or the image folder does not exist.
    """
    content = _read(instances)
    if not images.is_dir():
        raise NotFound(f"{images}: is not a folder; images of {instances} are looked for there")
    names = {c["id"]: c["name"] for c in content["categories"]}
    for wanted in categories:
        if wanted not in names.values():
            raise NotFound(f"{instances}: no category {wanted!r}; there are {_few(names)}")
    chosen, left_out = _choose(content, names, categories, least_area_px)
    rng = np.random.default_rng(seed)
    if len(chosen) > size:
        left_out["more than the bank holds"] += len(chosen) - size
        chosen = [chosen[k] for k in sorted(rng.choice(len(chosen), size, replace=False))]
    objects = _cut_all(content, chosen, names, images, instances, left_out)
    if not objects:
        reasons = ", ".join(f"{count} {reason}" for reason, count in sorted(left_out.items()))
        raise InvalidInput(f"{instances}: no object to paste; {reasons or 'no annotations'}")
    settings = [hash_file(instances), sorted(categories), least_area_px, size, seed]
    digest = hashlib.sha256(json.dumps(settings).encode()).hexdigest()
    return Bank(tuple(objects), dict(left_out), digest)


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise NotFound(f"{path}: does not exist") from error
    except (OSError, ValueError) as error:
        raise InvalidInput(f"{path}: not a readable JSON file, {error}") from error
    missing = [k for k in ("images", "annotations", "categories") if k not in content]
    if missing:
        raise InvalidInput(f"{path}: a COCO instances file has {', '.join(missing)}; this has none")
    return dict(content)


def _choose(
    content: dict[str, Any], names: dict[int, str], categories: Sequence[str], least_area_px: int
) -> tuple[list[dict[str, Any]], Counter[str]]:
    chosen, left_out = [], Counter[str]()
    for annotation in content["annotations"]:
        segmentation = annotation.get("segmentation")
        if annotation.get("iscrowd"):
            left_out["crowds"] += 1
        elif not segmentation:
            left_out["without polygon or mask"] += 1
        elif categories and names.get(annotation["category_id"]) not in categories:
            left_out["of other categories"] += 1
        elif annotation.get("area", least_area_px) < least_area_px:
            left_out[f"smaller than {least_area_px} px"] += 1
        else:
            chosen.append(annotation)
    return chosen, left_out


def _cut_all(
    content: dict[str, Any],
    chosen: list[dict[str, Any]],
    names: dict[int, str],
    images: Path,
    instances: Path,
    left_out: Counter[str],
) -> list[Cutout]:
    files = {image["id"]: image["file_name"] for image in content["images"]}
    of_image = defaultdict(list)
    for annotation in chosen:
        of_image[annotation["image_id"]].append(annotation)
    objects = []
    for image_id, wanted in of_image.items():
        path = images / files.get(image_id, "")
        if image_id not in files or not path.is_file():
            left_out["whose image is missing"] += len(wanted)
            continue
        picture = read_rgb(path)
        for annotation in wanted:
            place = f"{instances}: annotation {annotation.get('id')}"
            mask = _mask(annotation["segmentation"], picture.shape[0], picture.shape[1], place)
            category = names.get(annotation["category_id"], "")
            cutout = cut_out(picture, mask, category)
            if cutout is None:
                left_out["whose mask is empty"] += 1
            else:
                objects.append(cutout)
    return objects


def _mask(segmentation: Any, height: int, width: int, place: str) -> Mask:
    try:
        if isinstance(segmentation, list):
            runs = coco.merge(coco.frPyObjects(segmentation, height, width))
            mask = coco.decode(runs).view(np.bool_)
        elif isinstance(segmentation["counts"], list):
            mask = coco.decode(coco.frPyObjects(segmentation, height, width)).view(np.bool_)
        else:
            rows, columns = segmentation["size"]
            mask = decode_rle(read_rle(rows, columns, segmentation["counts"]))
    except Exception as error:  # pycocotools has no error class of its own
        raise InvalidInput(f"{place}: unreadable segmentation, {str(error)[:200]}") from error
    if mask.shape != (height, width):
        raise InvalidInput(
            f"{place}: mask is {mask.shape[1]}x{mask.shape[0]}, but its image is {width}x{height}"
        )
    return np.ascontiguousarray(mask)


def cut_out(picture: npt.NDArray[np.uint8], mask: Mask, category: str) -> Cutout | None:
    """Cut an object to its box; None when the mask has no pixel."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    if not width:
        return None
    pixels = np.ascontiguousarray(picture[y : y + height, x : x + width])
    alpha = mask[y : y + height, x : x + width].astype(np.uint8) * 255
    shrink = LARGEST_SIDE_PX / max(width, height)
    if shrink < 1:
        size = (max(1, round(width * shrink)), max(1, round(height * shrink)))
        pixels = _grown(pixels, alpha)
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
        alpha = cv2.resize(alpha, size, interpolation=cv2.INTER_AREA)
        if alpha.max() < 128:
            return None
    return Cutout(_grown(pixels, alpha), alpha, category)


def _grown(pixels: npt.NDArray[np.uint8], alpha: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Give every pixel outside the object the colour of the object's nearest pixel."""
    outside = (alpha < 128).astype(np.uint8)
    if not outside.any() or outside.all():
        return pixels
    _, labels = cv2.distanceTransformWithLabels(
        outside, cv2.DIST_L2, 3, labelType=cv2.DIST_LABEL_PIXEL
    )
    inside = outside == 0
    colours = np.zeros((int(labels.max()) + 1, 3), np.uint8)
    colours[labels[inside]] = pixels[inside]
    return np.ascontiguousarray(colours[labels])


def _few(names: dict[int, str]) -> str:
    known = sorted(names.values())
    return ", ".join(known[:12]) + (" .." if len(known) > 12 else "")
