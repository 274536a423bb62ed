"""Label Studio JSON: brush masks, polygons, rectangles and ellipses; the newest annotation counts.

A brush is a bit stream of run-lengths over RGBA bytes (the packing of thi.ng/rle-pack): 32 bits the
number of values, 5 bits the size of a value, four times 4 bits sizes of run-lengths; then blocks of
one bit (a run of one value, or single values), two bits which size, the length, and the values.
The mask is where alpha is not 0. Other shapes are in percent of the image.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from reviewer.dataset.annotations.shapes import Annotated
from reviewer.errors import InvalidInput
from reviewer.masks import Mask

LARGEST = 4 * 64_000_000
"""Bytes that a brush may unpack to; more than any image the importer takes."""


def read_label_studio(path: Path) -> list[Annotated]:
    """Return the images of a JSON export that have an annotation.

    Raises:
        InvalidInput: when it is no export of Label Studio; the message names the task.
    """
    try:
        tasks = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(tasks, list):
            raise ValueError("a list of tasks is expected; export as 'JSON', not 'JSON-MIN'")
        found = [_read(task, path) for task in tasks]
    except (OSError, UnicodeDecodeError, KeyError, TypeError, ValueError) as error:
        raise InvalidInput(f"{path}: not a Label Studio export, {error!r}") from error
    return [image for image in found if image is not None]


def _read(task: dict[str, Any], path: Path) -> Annotated | None:
    place = f"{path}, task {task.get('id')}"
    done = [each for each in task["annotations"] if not each.get("was_cancelled")]
    if not done:
        return None
    results = max(done, key=lambda each: str(each.get("updated_at", "")))["result"]
    sized = [result for result in results if "original_height" in result]
    if not sized:
        return None
    height, width = int(sized[0]["original_height"]), int(sized[0]["original_width"])
    image = Annotated(_name(task["data"], place), height, width, place)
    for result in sized:
        _paint(image, result)
    return image


def _name(data: dict[str, Any], place: str) -> str:
    texts = [str(value) for value in (data.get("image"), *data.values()) if isinstance(value, str)]
    if not texts:
        raise InvalidInput(f"{place}: its data name no image")
    # "/data/local-files/?d=sets/cs1/0001.png", "/data/upload/1/1a2b3c4d-0001.png", "s3://.."
    uploaded = re.fullmatch(r".*/upload/(?:.*/)?[0-9a-f]{8}-([^/]+)", texts[0])
    return uploaded[1] if uploaded else texts[0].partition("?d=")[2] or texts[0]


def _paint(image: Annotated, result: dict[str, Any]) -> None:
    kind, value = str(result["type"]), result["value"]
    names = value.get(kind) or ["change"]
    label, height, width = str(names[0]), image.height, image.width
    if "rle" in value:
        image.paint(label, unpack_brush(value["rle"], height, width, image.place))
    elif "points" in value:
        image.polygon(label, [(x / 100 * width, y / 100 * height) for x, y in value["points"]])
    elif "radiusX" in value:
        image.ellipse(
            label,
            value["x"] / 100 * width,
            value["y"] / 100 * height,
            value["radiusX"] / 100 * width,
            value["radiusY"] / 100 * height,
        )
    elif {"x", "y", "width", "height"} <= value.keys() and not value.get("rotation"):
        left, top = value["x"] / 100 * width, value["y"] / 100 * height
        right, bottom = left + value["width"] / 100 * width, top + value["height"] / 100 * height
        image.box(label, left, top, right, bottom)
    else:
        image.left_out[kind] += 1


def unpack_brush(packed: list[int], height: int, width: int, place: str = "brush") -> Mask:
    """Return the mask of a brush, bool (H, W).

    Raises:
        InvalidInput: when the stream is cut off, or is of another size.
    """
    bits = np.unpackbits(np.array(packed, np.uint8))
    at = 0

    def take(count: int) -> int:
        nonlocal at
        if at + count > len(bits):
            raise InvalidInput(f"{place}: the brush's run-lengths are cut off")
        value = 0
        for bit in bits[at : at + count].tolist():
            value = value * 2 + bit
        at += count
        return value

    total = take(32)
    if total != 4 * height * width or total > LARGEST:
        raise InvalidInput(
            f"{place}: the brush has {total} values, but {width}x{height} has {4 * height * width}"
        )
    size = take(5) + 1
    lengths = [take(4) + 1 for _ in range(4)]
    values = np.zeros(total, np.int64)
    filled = 0
    while filled < total:
        is_run, which = take(1), take(2)
        length = take(lengths[which]) + 1
        if filled + length > total:
            raise InvalidInput(f"{place}: the brush's run-lengths go beyond its {total} values")
        if is_run:
            values[filled : filled + length] = take(size)
        else:
            values[filled : filled + length] = [take(size) for _ in range(length)]
        filled += length
    mask: Mask = values.reshape(height, width, 4)[..., 3] > 0
    return mask
