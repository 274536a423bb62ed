"""CVAT for images 1.1: masks, polygons, boxes and ellipses of `annotations.xml`."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from reviewer.dataset.annotations.shapes import Annotated
from reviewer.errors import InvalidInput
from reviewer.masks import Mask


def read_cvat(path: Path) -> list[Annotated]:
    """Return the images of an `annotations.xml`, those without shapes too.

    Raises:
        InvalidInput: when it is not of that format; the message names the image.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError) as error:
        raise InvalidInput(f"{path}: not readable XML, {error}") from error
    if root.tag != "annotations" or root.find("image") is None:
        raise InvalidInput(f"{path}: holds no <image>; export as 'CVAT for images 1.1'")
    return [_read(element, path) for element in root.iter("image")]


def _read(element: ElementTree.Element, path: Path) -> Annotated:
    name = element.get("name", "")
    place = f"{path}, image {name!r}"
    try:
        image = Annotated(name, int(element.attrib["height"]), int(element.attrib["width"]), place)
        for shape in element:
            _paint(image, shape)
    except (KeyError, ValueError) as error:
        raise InvalidInput(f"{place}: malformed, {error!r}") from error
    return image


def _paint(image: Annotated, shape: ElementTree.Element) -> None:
    label, kind = shape.get("label", ""), shape.tag

    def number(name: str) -> float:
        return float(shape.attrib[name])

    if kind == "mask":
        height, width = int(number("height")), int(number("width"))
        runs = [int(run) for run in shape.attrib["rle"].split(",")]
        image.paint(
            label,
            _by_rows(runs, height, width, image.place),
            int(number("left")),
            int(number("top")),
        )
    elif kind == "polygon":
        corners = [
            [float(value) for value in corner.split(",")]
            for corner in shape.attrib["points"].split(";")
        ]
        image.polygon(label, corners)
    elif kind == "box" and not number_or_zero(shape, "rotation"):
        image.box(label, number("xtl"), number("ytl"), number("xbr"), number("ybr"))
    elif kind == "box":
        image.polygon(label, _turned(shape))
    elif kind == "ellipse" and not number_or_zero(shape, "rotation"):
        image.ellipse(label, number("cx"), number("cy"), number("rx"), number("ry"))
    elif kind != "tag":
        image.left_out[kind] += 1


def number_or_zero(shape: ElementTree.Element, name: str) -> float:
    """Return an attribute that may be missing."""
    return float(shape.get(name, "0"))


def _by_rows(runs: list[int], height: int, width: int, place: str) -> Mask:
    if sum(runs) != height * width or min(runs) < 0:
        raise InvalidInput(
            f"{place}: run-lengths cover {sum(runs)} pixels, but the box {width}x{height} has"
            f" {height * width}"
        )
    flat = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    return flat.reshape(height, width)


def _turned(shape: ElementTree.Element) -> list[list[float]]:
    """Return the corners of a box that is turned around its middle, degrees clockwise."""
    x0, y0, x1, y1 = (float(shape.attrib[key]) for key in ("xtl", "ytl", "xbr", "ybr"))
    middle_x, middle_y = (x0 + x1) / 2, (y0 + y1) / 2
    angle = math.radians(float(shape.attrib["rotation"]))
    cos, sin = math.cos(angle), math.sin(angle)
    return [
        [
            middle_x + (x - middle_x) * cos - (y - middle_y) * sin,
            middle_y + (x - middle_x) * sin + (y - middle_y) * cos,
        ]
        for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    ]
