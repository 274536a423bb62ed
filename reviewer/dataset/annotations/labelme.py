"""labelme: one JSON file per image; masks, polygons, rectangles and circles.

Polygons are filled as labelme fills them (Pillow, the border belongs to it).
"""

from __future__ import annotations

import base64
import io
import math
from functools import partial
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
from PIL import Image as PillowImage
from PIL import ImageDraw

from reviewer.dataset.annotations.shapes import Annotated, Canvas, Point
from reviewer.dataset.documents import MALFORMED, read_json
from reviewer.errors import InvalidInput
from reviewer.masks import decode_png

NO_AREA = ("line", "linestrip", "point", "points")
AREAS = ("polygon", "rectangle", "circle", "oriented_rectangle")


def read_labelme(path: Path) -> list[Annotated]:
    """Return the images of a folder of labelme files, or of one file.

    Raises:
        InvalidInput: when a file is none of labelme's; the message names it.
    """
    if not path.is_dir():
        return [_read(path, path)]
    files = [file for file in sorted(path.rglob("*.json")) if not file.is_dir()]
    return [_read(file, path) for file in files if file.name != "manifest.json"]


def _read(file: Path, root: Path) -> Annotated:
    document = read_json(file, "a labelme file")
    try:
        name = PureWindowsPath(document["imagePath"]).as_posix()
        beside = file.parent.relative_to(root).as_posix() if file != root else "."
        image = Annotated(
            f"{beside}/{name}".removeprefix("./"),
            int(document["imageHeight"]),
            int(document["imageWidth"]),
            str(file),
        )
        for shape in document["shapes"]:
            _note(image, shape)
    except MALFORMED as error:
        raise InvalidInput(f"{file}: not a labelme file, {error!r}") from error
    return image


def _note(image: Annotated, shape: dict[str, Any]) -> None:
    label, kind, points = str(shape["label"]), shape["shape_type"], shape["points"]
    if kind == "mask":
        image.add(label, partial(_mask, coded=shape["mask"], points=points))
    elif kind in NO_AREA:
        image.left_out[kind] += 1
    elif kind in AREAS:
        image.add(label, partial(_area, kind=kind, points=points))
    else:
        raise InvalidInput(f"{image.place}: shape type {kind!r} is not known")


def _mask(canvas: Canvas, coded: str, points: list[Point]) -> None:
    data = base64.b64decode(coded, validate=True)
    (x, y), _ = points
    try:
        with PillowImage.open(io.BytesIO(data)) as header:
            width, height = header.size
    except (OSError, SyntaxError) as error:
        raise InvalidInput(f"{canvas.place}: a mask is no readable image, {error}") from error
    canvas.check_inside(height, width, int(x), int(y))
    canvas.paint(decode_png(data, name=f"{canvas.place}, mask"), int(x), int(y))


def _area(canvas: Canvas, kind: str, points: list[Point]) -> None:
    corners = [(float(x), float(y)) for x, y in points]
    canvas.check_near(f"a {kind}", [value for corner in corners for value in corner])
    painted = PillowImage.new("1", (canvas.width, canvas.height))
    draw = ImageDraw.Draw(painted)
    if kind == "circle":
        (x, y), rim = corners
        radius = math.dist((x, y), rim)
        draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=1, outline=1)
    elif kind == "rectangle":
        (x0, y0), (x1, y1) = corners
        draw.rectangle((min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)), fill=1)
    else:
        draw.polygon(corners, fill=1, outline=1)
    canvas.paint(np.asarray(painted, np.bool_))
