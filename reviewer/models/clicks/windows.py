"""Windows of a picture as the click net sees them, and its masks back in the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask
from reviewer.models.interfaces import Click, Field, Image
from reviewer.models.nets.click_net import CHANNELS, SIDE

DISC_PX = 3
"""Radius of a click in the window, pixels of the net."""
DIFFERENCE_GAIN = 3.0
LEAST_SIDE_PX = 32.0
LOOSE = 1.7
"""A second look is so much wider than the mask and the clicks."""


@dataclass(frozen=True, slots=True)
class Square:
    """A square of a picture: its middle and its side in pixels; it may reach beyond the picture."""

    x: float
    y: float
    side: float

    def matrix(self) -> npt.NDArray[np.float64]:
        """Return the affine map (2, 3) from picture to window, pixel centres at whole numbers."""
        scale = SIDE / self.side
        # A pixel's centre lies half a pixel in; both grids count so.
        shift_x = (0.5 - self.x) * scale + SIDE / 2 - 0.5
        shift_y = (0.5 - self.y) * scale + SIDE / 2 - 0.5
        return np.array([[scale, 0, shift_x], [0, scale, shift_y]])


@dataclass(frozen=True, slots=True)
class Sight:
    """What there is to look at, all in one frame.

    Attributes:
        picture, other: RGB (H, W, 3) in [0, 255], the clicked picture and the other time's.
        confidence: float32 (H, W) in [0, 1]; 0 where `other` says nothing.
        change: float32 (H, W) in [0, 1], a detector's probability of change; 0 without one.
    """

    picture: Image | Field
    other: Image | Field
    confidence: Field
    change: Field


def square_around(mask: Mask, clicks: Sequence[Click]) -> Square:
    """Return the square of a second look at a mask and its clicks; the mask may be empty."""
    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    xs = [click.x for click in clicks] + ([x, x + width] if width else [])
    ys = [click.y for click in clicks] + ([y, y + height] if width else [])
    side = LOOSE * max(max(xs) - min(xs), max(ys) - min(ys))
    return Square((max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2, max(side, LEAST_SIDE_PX))


def look(sight: Sight, square: Square, clicks: Sequence[Click], previous: Mask | None) -> Field:
    """Return what the net sees, float32 (14, 96, 96); `previous`, bool (H, W), is the mask."""
    matrix = square.matrix()
    out = np.empty((CHANNELS, SIDE, SIDE), np.float32)
    mine, theirs = (_cut(image, square, matrix) for image in (sight.picture, sight.other))
    out[0:3] = mine.transpose(2, 0, 1)
    out[3:6] = theirs.transpose(2, 0, 1)
    out[0:6] /= 255
    out[6:9] = np.abs(out[0:3] - out[3:6]) * DIFFERENCE_GAIN
    out[9] = _cut(sight.confidence, square, matrix)
    out[6:9] *= out[9]
    out[3:6] *= out[9] > 0
    out[10:13] = 0
    for click in clicks:
        middle = matrix[:, :2] @ (click.x - 0.5, click.y - 0.5) + matrix[:, 2]
        disc = out[10 if click.positive else 11]
        cv2.circle(disc, [round(float(v)) for v in middle], DISC_PX, 1.0, -1)
    if previous is not None and previous.any():
        out[12] = _cut(previous.astype(np.float32), square, matrix, outside=cv2.BORDER_CONSTANT)
    out[13] = _cut(sight.change, square, matrix, outside=cv2.BORDER_CONSTANT)
    return out


def _cut(
    image: Image | Field, square: Square, matrix: npt.NDArray[np.float64],
    outside: int = cv2.BORDER_REPLICATE,
) -> Field:  # fmt: skip
    """Sample a square; a large one is averaged, not skipped through."""
    step = int(square.side // SIDE)
    if step >= 2:
        height, width = image.shape[:2]
        size = (-(-width // step), -(-height // step))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.float32)
        grid = np.array([[width / size[0], 0], [0, height / size[1]]])
        half = (np.array([width / size[0], height / size[1]]) - 1) / 2
        matrix = np.hstack([matrix[:, :2] @ grid, (matrix[:, :2] @ half + matrix[:, 2])[:, None]])
    cut = cv2.warpAffine(image, matrix, (SIDE, SIDE), flags=cv2.INTER_LINEAR, borderMode=outside)
    return np.asarray(cut, np.float32)


def placed_back(values: Field, square: Square, shape: tuple[int, int]) -> tuple[Field, Mask]:
    """Return a window's values (96, 96) in the picture, and where the window lies (bool)."""
    height, width = shape
    half = square.side / 2
    left, top = max(0, int(np.ceil(square.x - half))), max(0, int(np.ceil(square.y - half)))
    right, bottom = min(width, int(square.x + half)), min(height, int(square.y + half))
    full, covered = np.zeros(shape, np.float32), np.zeros(shape, np.bool_)
    if right <= left or bottom <= top:
        return full, covered
    matrix = square.matrix()
    matrix[:, 2] += matrix[:, :2] @ (left, top)
    part = cv2.warpAffine(
        values, matrix, (right - left, bottom - top),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    full[top:bottom, left:right] = part
    covered[top:bottom, left:right] = True
    return full, covered


def corrected(mask: Mask, probability: Field, square: Square) -> Mask:
    """Return a mask (H, W) with what the net says in its window; outside it stays as it was."""
    full, covered = placed_back(probability, square, mask.shape)
    return np.asarray((full > 0.5) | (mask & ~covered))
