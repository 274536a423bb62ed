"""Intelligent scissors: the path between two points that follows edges (OpenCV).

Source: Mortensen and Barrett, Intelligent scissors for image composition (SIGGRAPH 1995).
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from threading import Lock
from typing import Any

import cv2
import numpy as np

from reviewer.models.interfaces import Image

Corner = tuple[int, int]
KEPT = 16
REACH_PX = 160
CANNY = (32, 100)
LARGEST_GRADIENT = 200.0


@dataclass(frozen=True, slots=True)
class _PathMap:
    """Paths from one start to every pixel of a window around it."""

    tool: Any
    left: int
    top: int
    width: int
    height: int

    def path_to(self, end: Corner) -> list[Corner]:
        x = min(max(end[0] - self.left, 0), self.width - 1)
        y = min(max(end[1] - self.top, 0), self.height - 1)
        contour = np.asarray(self.tool.getContour((x, y))).reshape(-1, 2)
        points = [(int(u) + self.left, int(v) + self.top) for u, v in contour]
        return points if points and points[-1] == end else [*points, end]


class Scissors:
    """Paths on images; keeps the last path maps, so following a pointer is quick. Thread-safe."""

    def __init__(self) -> None:
        self._maps: OrderedDict[Hashable, _PathMap] = OrderedDict()
        self._lock = Lock()

    def path(
        self, key: Hashable, load: Callable[[], Image], start: Corner, end: Corner
    ) -> list[Corner]:
        """Return the path from `start` to `end`, both (x, y) inside the image.

        An end out of reach of the start is joined by a straight line. `key` names the image, which
        `load` brings when no map for this start is kept.
        """
        with self._lock:
            found = self._maps.pop((key, start), None) or _prepare(load(), start)
            self._maps[key, start] = found
            while len(self._maps) > KEPT:
                self._maps.popitem(last=False)
            return found.path_to(end)


def _prepare(image: Image, start: Corner) -> _PathMap:
    height, width = image.shape[:2]
    left, top = max(0, start[0] - REACH_PX), max(0, start[1] - REACH_PX)
    right, bottom = min(width, start[0] + REACH_PX + 1), min(height, start[1] + REACH_PX + 1)
    tool = cv2.segmentation.IntelligentScissorsMB()
    tool.setEdgeFeatureCannyParameters(*CANNY)
    tool.setGradientMagnitudeMaxLimit(LARGEST_GRADIENT)
    tool.applyImage(np.ascontiguousarray(image[top:bottom, left:right]))
    tool.buildMap((start[0] - left, start[1] - top))
    return _PathMap(tool, left, top, right - left, bottom - top)
