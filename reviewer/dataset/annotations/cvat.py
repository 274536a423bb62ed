"""CVAT for images 1.1: masks, polygons, boxes and ellipses of `annotations.xml`.

Boxes and ellipses may be turned: degrees clockwise around their middle.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from reviewer.dataset.annotations.shapes import Annotated, Canvas
from reviewer.dataset.documents import MALFORMED, read_xml
from reviewer.errors import InvalidInput
from reviewer.masks import Mask


def read_cvat(path: Path) -> list[Annotated]:
    """Return the images of an `annotations.xml`, those without shapes too.

    Raises:
        InvalidInput: when it is not of that format; the message names the image.
    """
    root = read_xml(path)
    if root.tag != "annotations" or root.find("image") is None:
        raise InvalidInput(f"{path}: holds no <image>; export as 'CVAT for images 1.1'")
    return [_read(element, path) for element in root.iter("image")]


def _read(element: ElementTree.Element, path: Path) -> Annotated:
    name = element.get("name", "")
    place = f"{path}, image {name!r}"
    try:
        image = Annotated(name, int(element.attrib["height"]), int(element.attrib["width"]), place)
    except MALFORMED as error:
        raise InvalidInput(f"{place}: malformed, {error!r}") from error
    for shape in element:
        draw = DRAWERS.get(shape.tag)
        if draw is not None:
            image.add(shape.get("label", ""), partial(draw, shape=shape.attrib))
        elif shape.tag != "tag":
            image.left_out[shape.tag] += 1
    return image


def _mask(canvas: Canvas, shape: Mapping[str, str]) -> None:
    left, top, width, height = (
        int(float(shape[key])) for key in ("left", "top", "width", "height")
    )
    canvas.check_inside(height, width, left, top)
    runs = [int(run) for run in shape["rle"].split(",")]
    canvas.paint(_by_rows(runs, height, width, canvas.place), left, top)


def _polygon(canvas: Canvas, shape: Mapping[str, str]) -> None:
    corners = [tuple(map(float, corner.split(","))) for corner in shape["points"].split(";")]
    canvas.polygon(corners)


def _box(canvas: Canvas, shape: Mapping[str, str]) -> None:
    x0, y0, x1, y1 = (float(shape[key]) for key in ("xtl", "ytl", "xbr", "ybr"))
    canvas.turned_box(x0, y0, x1, y1, _rotation(shape), ((x0 + x1) / 2, (y0 + y1) / 2))


def _ellipse(canvas: Canvas, shape: Mapping[str, str]) -> None:
    x, y, rx, ry = (float(shape[key]) for key in ("cx", "cy", "rx", "ry"))
    canvas.ellipse(x, y, rx, ry, _rotation(shape))


DRAWERS = {"mask": _mask, "polygon": _polygon, "box": _box, "ellipse": _ellipse}


def _rotation(shape: Mapping[str, str]) -> float:
    return float(shape.get("rotation", "0"))


def _by_rows(runs: list[int], height: int, width: int, place: str) -> Mask:
    if sum(runs) != height * width or min(runs) < 0:
        raise InvalidInput(
            f"{place}: run-lengths cover {sum(runs)} pixels, but the box {width}x{height} has"
            f" {height * width}"
        )
    flat = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    return flat.reshape(height, width)
