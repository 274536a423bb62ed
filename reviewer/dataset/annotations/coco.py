"""COCO instances JSON: polygons and run-lengths, compressed or not; crowds are ill-posed."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pycocotools import mask as coco

from reviewer.dataset.annotations.shapes import ILL_POSED, Annotated, Canvas
from reviewer.dataset.documents import MALFORMED, read_json
from reviewer.errors import InvalidInput
from reviewer.masks import decode_rle, read_rle


def read_coco(path: Path) -> list[Annotated]:
    """Return the images of a COCO file, those without annotations too.

    Raises:
        InvalidInput: when the file is no COCO instances JSON.
    """
    document = read_json(path, "a COCO instances file")
    try:
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
            image, segmentation = found[entry["image_id"]], entry.get("segmentation")
            if not segmentation:
                image.left_out["box without a mask"] += 1
                continue
            label = ILL_POSED if entry.get("iscrowd") else names[entry["category_id"]]
            place = f"{path}, annotation {entry.get('id')}"
            image.add(label, partial(_paint, segmentation=segmentation), place)
    except MALFORMED as error:
        raise InvalidInput(f"{path}: not a COCO instances file, {error!r}") from error
    return list(found.values())


def _paint(canvas: Canvas, segmentation: Any) -> None:
    if isinstance(segmentation, list):
        for polygon in segmentation:
            canvas.polygon(np.reshape(polygon, (-1, 2)).tolist())
        return
    height, width = segmentation["size"]
    if (height, width) != (canvas.height, canvas.width):
        raise InvalidInput(
            f"{canvas.place}: its run-lengths are of {width}x{height}, but the image is"
            f" {canvas.width}x{canvas.height}"
        )
    counts = segmentation["counts"]
    if isinstance(counts, list):
        counts = _compressed(canvas, [int(run) for run in counts])
    try:
        rle = read_rle(canvas.height, canvas.width, counts)
    except InvalidInput as error:
        raise InvalidInput(f"{canvas.place}: {error}") from error
    canvas.paint(decode_rle(rle))


def _compressed(canvas: Canvas, runs: list[int]) -> str:
    height, width = canvas.height, canvas.width
    if sum(runs) != height * width or min(runs) < 0:
        raise InvalidInput(
            f"{canvas.place}: its run-lengths cover {sum(runs)} pixels, but {width}x{height} has"
            f" {height * width}"
        )
    whole = {"size": [height, width], "counts": runs}
    return str(coco.frPyObjects(whole, height, width)["counts"].decode("ascii"))
