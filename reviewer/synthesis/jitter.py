"""How two pictures of one place differ although nothing changed: geometry, light, camera."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.masks import Mask
from reviewer.synthesis.paste import Picture
from reviewer.synthesis.settings import SynthesisSettings

Rng = np.random.Generator
Flow = npt.NDArray[np.float32]


def displacement(height: int, width: int, settings: SynthesisSettings, rng: Rng) -> Flow | None:
    """Return where each pixel comes from, float32 (H, W, 2) absolute (x, y); None for no move.

    A homography (the corners move) and a smooth flow (what dense alignment leaves over).
    """
    if settings.homography_px == 0 and settings.flow_px == 0:
        return None
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    reach = settings.homography_px * float(rng.random())
    moved = corners + rng.uniform(-reach, reach, (4, 2)).astype(np.float32)
    matrix = cv2.getPerspectiveTransform(corners, moved)
    # A homography this close to identity is smooth: a coarse grid of it is enough.
    rows, columns = max(2, height // 32), max(2, width // 32)
    x, y = np.meshgrid(np.linspace(0, width - 1, columns), np.linspace(0, height - 1, rows))
    grid = np.stack([x, y], axis=-1).reshape(-1, 1, 2).astype(np.float32)
    shift = (cv2.perspectiveTransform(grid, matrix) - grid).reshape(rows, columns, 2)
    size = settings.flow_px * float(rng.random()) ** 2 * 2
    shift += rng.normal(0, size / 2, shift.shape).astype(np.float32)
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    full = _stretched(shift, height, width)
    return np.asarray(full + np.stack([x, y], axis=-1), np.float32)


def moved(picture: Picture, flow: Flow | None) -> Picture:
    """Return the picture warped by the flow."""
    if flow is None:
        return picture
    out = cv2.remap(picture, flow, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT_101)
    return np.asarray(out, np.float32)


def moved_mask(mask: Mask, flow: Flow | None) -> Mask:
    """Return the mask warped by the flow: nearest pixel, never a mixture."""
    if flow is None:
        return mask
    out = cv2.remap(mask.view(np.uint8), flow, None, cv2.INTER_NEAREST)
    return np.asarray(out, np.uint8).view(np.bool_)


def relight(picture: Picture, settings: SynthesisSettings, rng: Rng) -> Picture:
    """Return the picture under another exposure, colour balance and soft light."""
    gain = settings.exposure ** float(rng.uniform(-1, 1))
    red, green, blue = (float(v) for v in gain * settings.colour_cast ** rng.uniform(-1, 1, 3))
    if settings.shade == 0:
        return np.asarray(cv2.multiply(picture, (red, green, blue, 1.0)), np.float32)
    light = _shade(picture.shape[0], picture.shape[1], settings.shade, rng)
    # OpenCV's own broadcast-free product: numpy takes three times as long over the colour axis.
    factor = cv2.merge([light * red, light * green, light * blue])
    return np.asarray(cv2.multiply(picture, factor), np.float32)


def _shade(height: int, width: int, strength: float, rng: Rng) -> npt.NDArray[np.float32]:
    """Slow changes of light, and in half of the pictures a shadow with a softer or harder edge."""
    knots = (max(2, height // 96), max(2, width // 96))
    slow = rng.normal(0, strength / 3, knots).astype(np.float32)
    light = 1 + _stretched(slow, height, width)
    if rng.random() < 0.5:
        small = np.zeros((max(2, height // 4), max(2, width // 4)), np.float32)
        h, w = small.shape
        centre = (int(rng.integers(0, w)), int(rng.integers(0, h)))
        axes = (int(rng.integers(2, max(3, w // 2))), int(rng.integers(2, max(3, h // 3))))
        cv2.ellipse(small, centre, axes, float(rng.uniform(0, 180)), 0, 360, 1.0, -1)
        small = cv2.GaussianBlur(small, (0, 0), float(np.exp(rng.uniform(np.log(0.8), np.log(8)))))
        light *= 1 - float(rng.uniform(-0.5, 1)) * strength * cv2.resize(small, (width, height))
    return np.asarray(np.clip(light, 0.3, 1.7), np.float32)


def _stretched(knots: Flow, height: int, width: int) -> Flow:
    """Return a smooth field through coarse knots: cubic to a quarter of the size, then linear."""
    quarter = (max(2, width // 4), max(2, height // 4))
    smooth = cv2.resize(knots, quarter, interpolation=cv2.INTER_CUBIC)
    return np.asarray(cv2.resize(smooth, (width, height)), np.float32)


def photograph(
    picture: Picture, settings: SynthesisSettings, rng: Rng, *, blurred: bool
) -> npt.NDArray[np.uint8]:
    """Return the picture as a camera takes it: blur on one of the two, noise, 8 bits."""
    if blurred and settings.blur_px > 0:
        sigma = settings.blur_px * float(rng.random())
        if sigma > 0.2:
            picture = cv2.GaussianBlur(picture, (0, 0), sigma)
    deviation = settings.noise * float(rng.random()) ** 2
    # Adds, rounds and saturates in one pass; the grain is a shifted tile, since drawing a normal
    # number for every value would cost more than all the rest.
    grain = _grain(picture.shape, rng)
    return np.asarray(
        cv2.addWeighted(picture, 1.0, grain, deviation, 0.0, dtype=cv2.CV_8U), np.uint8
    )


def _grain(shape: tuple[int, ...], rng: Rng) -> Picture:
    height, width = shape[:2]
    if height > _GRAIN.shape[0] // 2 or width > _GRAIN.shape[1] // 2:
        return rng.standard_normal(shape, dtype=np.float32)
    y = int(rng.integers(0, _GRAIN.shape[0] - height))
    x = int(rng.integers(0, _GRAIN.shape[1] - width))
    return _GRAIN[y : y + height, x : x + width]


_GRAIN = np.random.default_rng(0).standard_normal((1024, 1024, 3), dtype=np.float32)
