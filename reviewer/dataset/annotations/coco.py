"""COCO instances JSON: polygons and run-lengths, compressed or not; crowds are ill-posed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from pycocotools import mask as coco

from reviewer.dataset.annotations.shapes import ILL_POSED, Annotated
from reviewer.errors import InvalidInput
from reviewer.masks import decode_rle, read_rle


def read_coco(path: Path) -> list[Annotated]:
    """Return the images of a COCO file, those without annotations too.

    Raises:
        InvalidInput: when the file is no COCO instances JSON; the message names the annotation.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        names = {entry["id"]: str(entry["name"]) for entry in document["categories"]}
        found = {
            entry["id"]: Annotated(
                str(entry["file_name"]),
                int(entry["height"]),
                int(entry["width"]),
                f"{path}, image {entry['id']}",
            )
            for entry in document["images"]
        }
        for entry in document["annotations"]:
            image = found[entry["image_id"]]
            image.place = f"{path}, annotation {entry.get('id')}"
            label = ILL_POSED if entry.get("iscrowd") else names[entry["category_id"]]
            _paint(image, label, entry.get("segmentation"))
    except (OSError, UnicodeDecodeError, KeyError, TypeError, ValueError) as error:
        raise InvalidInput(f"{path}: not a COCO instances file, {error!r}") from error
    return list(found.values())


def _paint(image: Annotated, label: str, segmentation: Any) -> None:
    if not segmentation:
        image.left_out["box without a mask"] += 1
        return
    if isinstance(segmentation, list):
        for polygon in segmentation:
            image.polygon(label, np.reshape(polygon, (-1, 2)).tolist())
        return
    height, width = segmentation["size"]
    if (height, width) != (image.height, image.width):
        raise InvalidInput(
            f"{image.place}: its run-lengths are of {width}x{height}, but the image is"
            f" {image.width}x{image.height}"
        )
    counts = segmentation["counts"]
    if isinstance(counts, list):
        counts = coco.frPyObjects(segmentation, height, width)["counts"].decode("ascii")
    image.paint(label, decode_rle(read_rle(height, width, counts)))
