"""labelme: a JSON file an image; masks, polygons, rectangles and circles.

Polygons are filled as labelme fills them (Pillow, the border belongs to it).
"""

from __future__ import annotations

import base64
import binascii
import json
import math
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
from PIL import Image as PillowImage
from PIL import ImageDraw

from reviewer.dataset.annotations.shapes import Annotated
from reviewer.errors import InvalidInput
from reviewer.masks import decode_png

NO_AREA = ("line", "linestrip", "point", "points")


def read_labelme(path: Path) -> list[Annotated]:
    """Return the images of a folder of labelme files, or of one file.

    Raises:
        InvalidInput: when a file is none of labelme's; the message names it.
    """
    files = [path] if path.is_file() else sorted(path.rglob("*.json"))
    return [_read(file, path) for file in files if file.name != "manifest.json"]


def _read(file: Path, root: Path) -> Annotated:
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
        name = PureWindowsPath(document["imagePath"]).as_posix()
        beside = file.parent.relative_to(root).as_posix() if file != root else "."
        image = Annotated(
            f"{beside}/{name}".removeprefix("./"),
            int(document["imageHeight"]),
            int(document["imageWidth"]),
            str(file),
        )
        for shape in document["shapes"]:
            _paint(image, shape)
    except (OSError, UnicodeDecodeError, KeyError, TypeError, ValueError) as error:
        raise InvalidInput(f"{file}: not a labelme file, {error!r}") from error
    return image


def _paint(image: Annotated, shape: dict[str, Any]) -> None:
    label, kind, points = str(shape["label"]), shape["shape_type"], shape["points"]
    if kind == "mask":
        try:
            data = base64.b64decode(shape["mask"], validate=True)
        except binascii.Error as error:
            raise InvalidInput(f"{image.place}: a mask is not base64, {error}") from error
        (x, y), _ = points
        image.paint(label, decode_png(data, name=f"{image.place}, mask"), int(x), int(y))
    elif kind in NO_AREA:
        image.left_out[kind] += 1
    elif kind in ("polygon", "rectangle", "circle", "oriented_rectangle"):
        canvas = PillowImage.new("1", (image.width, image.height))
        draw = ImageDraw.Draw(canvas)
        corners = [(float(x), float(y)) for x, y in points]
        if kind == "circle":
            (x, y), rim = corners
            radius = math.dist((x, y), rim)
            draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=1, outline=1)
        elif kind == "rectangle":
            (x0, y0), (x1, y1) = corners
            draw.rectangle((min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)), fill=1)
        else:
            draw.polygon(corners, fill=1, outline=1)
        image.paint(label, np.asarray(canvas, np.bool_))
    else:
        raise InvalidInput(f"{image.place}: shape type {kind!r} is not known")
