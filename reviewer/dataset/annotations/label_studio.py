"""Label Studio JSON: brush masks, polygons, rectangles and ellipses; the newest annotation counts.

A brush is a bit stream of run-lengths over RGBA bytes (the packing of thi.ng/rle-pack): 32 bits the
number of values, 5 bits the size of a value, four times 4 bits sizes of run-lengths; then blocks of
one bit (a run of one value, or single values), two bits which size, the length, and the values.
The mask is where alpha is not 0. Other shapes are in percent of the image, and are turned in
pixels: clockwise, a rectangle around its upper left corner, an ellipse around its middle.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from reviewer.dataset.annotations.shapes import Annotated, Canvas
from reviewer.dataset.documents import MALFORMED, read_json
from reviewer.errors import InvalidInput
from reviewer.masks import Mask


def read_label_studio(path: Path) -> list[Annotated]:
    """Return the images of a JSON export that have an annotation.

    Raises:
        InvalidInput: when it is no export of Label Studio; the message names the task.
    """
    tasks = read_json(path, "a Label Studio export")
    try:
        if not isinstance(tasks, list):
            raise ValueError("a list of tasks is expected; export as 'JSON', not 'JSON-MIN'")
        found = [_read(task, path) for task in tasks]
    except MALFORMED as error:
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
        _note(image, result)
    return image


def _name(data: dict[str, Any], place: str) -> str:
    texts = [str(value) for value in (data.get("image"), *data.values()) if isinstance(value, str)]
    if not texts:
        raise InvalidInput(f"{place}: its data name no image")
    # "/data/local-files/?d=sets/cs1/0001.png", "/data/upload/1/1a2b3c4d-0001.png", "s3://.."
    uploaded = re.fullmatch(r".*/upload/(?:.*/)?[0-9a-f]{8}-([^/]+)", texts[0])
    return uploaded[1] if uploaded else texts[0].partition("?d=")[2] or texts[0]


def _note(image: Annotated, result: Mapping[str, Any]) -> None:
    if result.get("image_rotation"):
        raise InvalidInput(
            f"{image.place}: the picture is turned by {result['image_rotation']} degrees there;"
            " turn it back in Label Studio and export again"
        )
    kind, value = str(result["type"]), result["value"]
    label = str((value.get(kind) or ["change"])[0])
    for keys, draw in DRAWERS:
        if keys <= value.keys():
            image.add(label, partial(draw, value=value))
            return
    image.left_out[kind] += 1


def _brush(canvas: Canvas, value: Mapping[str, Any]) -> None:
    canvas.paint(unpack_brush(value["rle"], canvas.height, canvas.width, canvas.place))


def _polygon(canvas: Canvas, value: Mapping[str, Any]) -> None:
    canvas.polygon([(x / 100 * canvas.width, y / 100 * canvas.height) for x, y in value["points"]])


def _ellipse(canvas: Canvas, value: Mapping[str, Any]) -> None:
    x, rx = (value[key] / 100 * canvas.width for key in ("x", "radiusX"))
    y, ry = (value[key] / 100 * canvas.height for key in ("y", "radiusY"))
    canvas.ellipse(x, y, rx, ry, value.get("rotation") or 0)


def _rectangle(canvas: Canvas, value: Mapping[str, Any]) -> None:
    left, wide = (value[key] / 100 * canvas.width for key in ("x", "width"))
    top, high = (value[key] / 100 * canvas.height for key in ("y", "height"))
    degrees = value.get("rotation") or 0
    canvas.turned_box(left, top, left + wide, top + high, degrees, (left, top))


DRAWERS = (
    ({"rle"}, _brush),
    ({"points"}, _polygon),
    ({"x", "y", "radiusX", "radiusY"}, _ellipse),
    ({"x", "y", "width", "height"}, _rectangle),
)
"""How a shape is painted, by the keys of its value."""


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
    if total != 4 * height * width:
        raise InvalidInput(
            f"{place}: the brush has {total} values, but {width}x{height} has {4 * height * width}"
        )
    size = take(5) + 1
    lengths = [take(4) + 1 for _ in range(4)]
    values = np.zeros(total, np.bool_)
    filled = 0
    while filled < total:
        is_run, which = take(1), take(2)
        length = take(lengths[which]) + 1
        if filled + length > total:
            raise InvalidInput(f"{place}: the brush's run-lengths go beyond its {total} values")
        if is_run:
            values[filled : filled + length] = take(size) > 0
        else:
            values[filled : filled + length] = [take(size) > 0 for _ in range(length)]
        filled += length
    mask: Mask = values.reshape(height, width, 4)[..., 3]
    return mask
