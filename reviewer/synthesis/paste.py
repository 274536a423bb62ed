"""Put a cutout on a picture: scaled, turned, matched in colour, with a soft rim and a shadow."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask
from reviewer.synthesis.bank import Cutout
from reviewer.synthesis.settings import SynthesisSettings

Rng = np.random.Generator
Picture = npt.NDArray[np.float32]
"""float32 RGB (H, W, 3), 0..255."""


@dataclass(frozen=True, slots=True)
class Placed:
    """An object ready to be laid on pictures: colours and alpha of its box, and where that is.

    Attributes:
        pixels: float32 (h, w, 3). alpha: float32 (h, w) in [0, 1], soft. solid: bool (h, w).
        x, y: upper left corner in the picture; the box may reach beyond it.
        shadow: float32 (h, w), the factor on light that its shadow leaves; None without one.
        shadow_x, shadow_y: how far the shadow is moved, pixels.
    """

    pixels: Picture
    alpha: npt.NDArray[np.float32]
    solid: Mask
    x: int
    y: int
    shadow: npt.NDArray[np.float32] | None
    shadow_x: int
    shadow_y: int


def place(
    cutout: Cutout,
    picture: Picture,
    settings: SynthesisSettings,
    rng: Rng,
    rows: tuple[int, int] | None = None,
) -> Placed | None:
    """Choose size, turn and place of a cutout on a picture; the whole of it lies inside.

    Args:
        rows: rows of the picture between which its middle is to lie; anywhere without.

    Returns:
        None when those rows leave it no place.
    """
    height, width = picture.shape[:2]
    low, high = settings.size_px
    high = min(high, 0.8 * min(height, width))
    longest = float(np.exp(rng.uniform(np.log(min(low, high)), np.log(high))))
    pixels, alpha = _turned(cutout, longest, settings, rng)
    h, w = alpha.shape
    x = int(rng.integers(0, max(1, width - w + 1)))
    first, last = 0, max(0, height - h)
    if rows is not None:
        first, last = max(first, rows[0] - h // 2), min(last, rows[1] - h // 2)
        if last < first:
            return None
    y = int(rng.integers(first, last + 1))
    solid = np.asarray(alpha >= 0.5)
    soft = float(rng.uniform(*settings.feather_px))
    if soft > 0:
        alpha = cv2.GaussianBlur(alpha, (0, 0), soft)
    around = picture[max(0, y - 4) : y + h + 4, max(0, x - 4) : x + w + 4]
    share = float(rng.uniform(*settings.colour_match))
    if solid.any() and share > 0:
        own = cv2.mean(pixels, solid.astype(np.uint8))[:3]
        there = np.asarray(cv2.mean(around)[:3], np.float32)
        pixels = pixels * (1 - share + share * (there + 8) / (np.asarray(own, np.float32) + 8))
    shadow, shift_x, shift_y = None, 0, 0
    if rng.random() < settings.shadow:
        reach = 0.04 + 0.08 * float(rng.random())
        shift_x = round(longest * float(rng.uniform(-reach, reach)))
        shift_y = round(longest * float(rng.uniform(0, reach)))
        spread = max(0.8, longest * float(rng.uniform(0.02, 0.08)))
        shadow = 1 - float(rng.uniform(0.15, 0.6)) * cv2.GaussianBlur(alpha, (0, 0), spread)
    return Placed(np.asarray(pixels, np.float32), alpha, solid, x, y, shadow, shift_x, shift_y)


def lay(picture: Picture, placed: Placed | None) -> None:
    """Draw a placed object and its shadow into a picture."""
    if placed is None:
        return
    if placed.shadow is not None:
        here, there = _overlap(
            picture.shape,
            placed.alpha.shape,
            placed.x + placed.shadow_x,
            placed.y + placed.shadow_y,
        )
        picture[here] *= placed.shadow[there][..., None]
    here, there = _overlap(picture.shape, placed.alpha.shape, placed.x, placed.y)
    alpha = placed.alpha[there][..., None]
    picture[here] += alpha * (placed.pixels[there] - picture[here])


def mark(mask: Mask, placed: Placed | None) -> None:
    """Set the pixels of a mask that the object covers."""
    if placed is None:
        return
    here, there = _overlap(mask.shape, placed.solid.shape, placed.x, placed.y)
    mask[here][placed.solid[there]] = True


def _turned(
    cutout: Cutout, longest: float, settings: SynthesisSettings, rng: Rng
) -> tuple[Picture, npt.NDArray[np.float32]]:
    """Scale, turn and mirror; the box has room for the soft rim and the shadow."""
    pixels, alpha = cutout.pixels, cutout.alpha
    scale = longest / max(alpha.shape)
    if scale < 0.6:
        # Averaging first: one bilinear sample of many pixels would alias.
        size = (max(2, round(alpha.shape[1] * scale)), max(2, round(alpha.shape[0] * scale)))
        pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
        alpha = cv2.resize(alpha, size, interpolation=cv2.INTER_AREA)
        scale = 1.0
    if rng.random() < 0.5:
        pixels, alpha = pixels[:, ::-1], alpha[:, ::-1]
    angle = float(rng.uniform(-settings.rotation_degrees, settings.rotation_degrees))
    h, w = alpha.shape
    turn = cv2.getRotationMatrix2D(((w - 1) / 2, (h - 1) / 2), angle, scale)
    margin = 3 + 0.12 * longest
    across = w * abs(turn[0, 0]) + h * abs(turn[0, 1]) + 2 * margin
    down = w * abs(turn[1, 0]) + h * abs(turn[1, 1]) + 2 * margin
    size = (int(np.ceil(across)), int(np.ceil(down)))
    turn[:, 2] += (size[0] - w) / 2, (size[1] - h) / 2
    colours = cv2.warpAffine(
        np.ascontiguousarray(pixels), turn, size, borderMode=cv2.BORDER_REPLICATE
    )
    cover = cv2.warpAffine(np.ascontiguousarray(alpha), turn, size)
    return colours.astype(np.float32), cover.astype(np.float32) / np.float32(255)


def _overlap(
    picture: tuple[int, ...], box: tuple[int, ...], x: int, y: int
) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return the slices of the picture and of the box where they lie on each other."""
    top, left = max(0, y), max(0, x)
    bottom, right = max(top, min(picture[0], y + box[0])), max(left, min(picture[1], x + box[1]))
    return (
        (slice(top, bottom), slice(left, right)),
        (slice(top - y, bottom - y), slice(left - x, right - x)),
    )
