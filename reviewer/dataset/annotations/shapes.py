"""What a tool's file says of one image, and how its shapes become pixels."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from pycocotools import mask as coco

from reviewer.errors import InvalidInput
from reviewer.masks import Mask

Point = Sequence[float]
FARTHEST_PX = 100_000
ILL_POSED = "ill-posed"
"""Label of pixels that are not to be scored, unless another one is named."""


@dataclass(slots=True)
class Annotated:
    """Shapes of one image, painted by label.

    Attributes:
        name: the image as the tool names it, a path with slashes.
        place: where this stands, for messages.
        layers: masks bool (H, W) by label.
        left_out: shapes that are no areas, by kind.
    """

    name: str
    height: int
    width: int
    place: str
    layers: dict[str, Mask] = field(default_factory=dict)
    left_out: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        if not (0 < self.height <= 20000 and 0 < self.width <= 20000):
            raise InvalidInput(
                f"{self.place}: an image of {self.width}x{self.height}; sides go from 1 to 20000"
            )

    def paint(self, label: str, mask: Mask, x: int = 0, y: int = 0) -> None:
        """Add a mask whose upper left corner lies at (x, y) to a label.

        Raises:
            InvalidInput: when it reaches beyond the image.
        """
        height, width = mask.shape
        if x < 0 or y < 0 or x + width > self.width or y + height > self.height:
            raise InvalidInput(
                f"{self.place}: a mask of {width}x{height} at ({x}, {y}) reaches beyond the image"
                f" of {self.width}x{self.height}"
            )
        layer = self.layers.setdefault(label, np.zeros((self.height, self.width), np.bool_))
        layer[y : y + height, x : x + width] |= mask

    def polygon(self, label: str, points: Sequence[Point]) -> None:
        """Add a polygon; corners (x, y) in pixels, (0, 0) is the image's corner.

        Raises:
            InvalidInput: when it has fewer than three corners.
        """
        if len(points) < 3:
            raise InvalidInput(f"{self.place}: a polygon has three corners, not {len(points)}")
        flat = [float(value) for point in points for value in point]
        if not all(math.isfinite(value) and abs(value) < FARTHEST_PX for value in flat):
            raise InvalidInput(f"{self.place}: a polygon's corner lies nowhere near the image")
        runs = coco.frPyObjects([flat], self.height, self.width)
        self.paint(label, coco.decode(runs)[..., 0].astype(np.bool_))

    def box(self, label: str, x0: float, y0: float, x1: float, y1: float) -> None:
        """Add a box, in pixels."""
        if not all(math.isfinite(value) for value in (x0, y0, x1, y1)):
            raise InvalidInput(f"{self.place}: a box's corner is not a number")
        left, top = (max(0, round(min(v))) for v in ((x0, x1), (y0, y1)))
        right = min(self.width, round(max(x0, x1)))
        bottom = min(self.height, round(max(y0, y1)))
        if right > left and bottom > top:
            self.paint(label, np.ones((bottom - top, right - left), np.bool_), left, top)

    def ellipse(self, label: str, x: float, y: float, rx: float, ry: float) -> None:
        """Add an ellipse around (x, y), in pixels."""
        if not (rx > 0 and ry > 0 and math.isfinite(x + y + rx + ry)):
            raise InvalidInput(f"{self.place}: an ellipse has radii above 0, not {rx} and {ry}")
        rows, columns = np.ogrid[: self.height, : self.width]
        inside = ((columns + 0.5 - x) / rx) ** 2 + ((rows + 0.5 - y) / ry) ** 2 <= 1
        self.paint(label, inside)
