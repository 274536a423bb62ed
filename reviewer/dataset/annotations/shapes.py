"""The shapes of one image in a tool's file, and how they become pixels.

Readers only note the shapes: they are painted when the image has found its pair and has its size,
one image at a time, so a file that claims a huge image costs nothing.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from pycocotools import mask as coco

from reviewer.dataset.documents import MALFORMED
from reviewer.errors import InvalidInput
from reviewer.masks import Mask

Point = Sequence[float]
FARTHEST_PX = 100_000
ILL_POSED = "ill-posed"
"""Label of pixels that are not to be scored, unless another one is named."""


@dataclass(slots=True)
class Annotated:
    """Shapes of one image by label, not painted yet.

    Attributes:
        name: the image as the tool names it, a path with slashes.
        place: where this stands, for messages.
        shapes: label, how it is painted, and where it stands.
        left_out: shapes that are no areas, by kind.
    """

    name: str
    height: int
    width: int
    place: str
    shapes: list[tuple[str, Callable[[Canvas], None], str]] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        if not (0 < self.height <= 20000 and 0 < self.width <= 20000):
            raise InvalidInput(
                f"{self.place}: an image of {self.width}x{self.height}; sides go from 1 to 20000"
            )

    def add(self, label: str, draw: Callable[[Canvas], None], place: str = "") -> None:
        """Note a shape of a label, and where in the file it stands."""
        self.shapes.append((label, draw, place or self.place))

    @property
    def labels(self) -> set[str]:
        """The labels of its shapes."""
        return {label for label, _, _ in self.shapes}

    @property
    def layers(self) -> dict[str, Mask]:
        """Masks bool (H, W) by label, painted anew each time.

        Raises:
            InvalidInput: when a shape is malformed; the message says where it stands.
        """
        painted: dict[str, Mask] = {}
        for label, draw, place in self.shapes:
            if label not in painted:
                painted[label] = np.zeros((self.height, self.width), np.bool_)
            try:
                draw(Canvas(painted[label], place))
            except MALFORMED as error:
                raise InvalidInput(f"{place}: malformed shape, {error!r}") from error
        return painted


@dataclass(frozen=True, slots=True)
class Canvas:
    """The mask of one label, and how shapes are painted into it; pixels, (0, 0) is the corner."""

    layer: Mask
    place: str

    @property
    def height(self) -> int:
        """Rows of the image."""
        return len(self.layer)

    @property
    def width(self) -> int:
        """Columns of the image."""
        return int(self.layer.shape[1])

    def check_inside(self, height: int, width: int, x: int, y: int) -> None:
        """Refuse a mask that reaches beyond the image, before it is unpacked.

        Raises:
            InvalidInput: when it does, or is empty.
        """
        inside = x >= 0 and y >= 0 and x + width <= self.width and y + height <= self.height
        if not (inside and height > 0 and width > 0):
            raise InvalidInput(
                f"{self.place}: a mask of {width}x{height} at ({x}, {y}) reaches beyond the image"
                f" of {self.width}x{self.height}"
            )

    def paint(self, mask: Mask, x: int = 0, y: int = 0) -> None:
        """Add a mask whose upper left corner lies at (x, y).

        Raises:
            InvalidInput: when it reaches beyond the image.
        """
        height, width = mask.shape
        self.check_inside(height, width, x, y)
        self.layer[y : y + height, x : x + width] |= mask

    def polygon(self, points: Sequence[Point]) -> None:
        """Add a polygon of corners (x, y).

        Raises:
            InvalidInput: when it has fewer than three corners, or one far away.
        """
        if len(points) < 3:
            raise InvalidInput(f"{self.place}: a polygon has three corners, not {len(points)}")
        flat = [float(value) for point in points for value in point]
        self.check_near("a polygon's corner", flat)
        runs = coco.frPyObjects([flat], self.height, self.width)
        self.paint(coco.decode(runs)[..., 0].astype(np.bool_))

    def check_near(self, what: str, numbers: Iterable[float]) -> None:
        """Refuse coordinates that are NaN, infinite, or farther out than any image is large.

        Raises:
            InvalidInput: for such a number.
        """
        if not all(math.isfinite(value) and abs(value) < FARTHEST_PX for value in numbers):
            raise InvalidInput(f"{self.place}: {what} lies nowhere near the image")

    def box(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """Add a box."""
        if not all(math.isfinite(value) for value in (x0, y0, x1, y1)):
            raise InvalidInput(f"{self.place}: a box's corner is not a number")
        left, top = (max(0, round(min(v))) for v in ((x0, x1), (y0, y1)))
        right = min(self.width, round(max(x0, x1)))
        bottom = min(self.height, round(max(y0, y1)))
        if right > left and bottom > top:
            self.layer[top:bottom, left:right] = True

    def turned_box(
        self, x0: float, y0: float, x1: float, y1: float, degrees: float, pivot: Point
    ) -> None:
        """Add a box that is turned clockwise around a point."""
        if not degrees % 360:
            self.box(x0, y0, x1, y1)
            return
        self.check_near("a box's corner", (x0, y0, x1, y1, *pivot))
        cos, sin = _cos_sin(degrees)
        px, py = pivot
        self.polygon(
            [
                (px + (x - px) * cos - (y - py) * sin, py + (x - px) * sin + (y - py) * cos)
                for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
            ]
        )

    def ellipse(self, x: float, y: float, rx: float, ry: float, degrees: float = 0) -> None:
        """Add an ellipse around (x, y), turned clockwise; a pixel is in it when its middle is."""
        self.check_near("an ellipse", (x, y, rx, ry))
        if not (rx > 0 and ry > 0):
            raise InvalidInput(f"{self.place}: an ellipse has radii above 0, not {rx} and {ry}")
        cos, sin = _cos_sin(degrees)
        reach_x, reach_y = math.hypot(rx * cos, ry * sin), math.hypot(rx * sin, ry * cos)
        left, top = max(0, math.floor(x - reach_x)), max(0, math.floor(y - reach_y))
        window = self.layer[
            top : max(0, math.ceil(y + reach_y)), left : max(0, math.ceil(x + reach_x))
        ]
        rows, columns = np.ogrid[: window.shape[0], : window.shape[1]]
        across, down = columns + (left + 0.5 - x), rows + (top + 0.5 - y)
        along, beside = across * cos + down * sin, down * cos - across * sin
        window |= (along / rx) ** 2 + (beside / ry) ** 2 <= 1


def _cos_sin(degrees: float) -> tuple[float, float]:
    angle = math.radians(degrees)
    return math.cos(angle), math.sin(angle)
