"""Look textures up: all textures of a scene in one stack, in linear light, with mip levels."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.demo.texture_library import make_texture


class TextureSet:
    """All textures of a scene, stacked, in linear light, with mip levels.

    Level k has side SIDE >> k; `sample` picks the level whose texel is about as large as the pixel.
    """

    LEVELS = 7

    def __init__(self, names: Sequence[str]) -> None:
        pyramids = [_pyramid(name, self.LEVELS) for name in names]
        self._levels = [np.stack(level) for level in zip(*pyramids, strict=True)]

    def sample(
        self,
        texture: npt.NDArray[np.int32],
        uv: npt.NDArray[np.float32],
        texels: npt.NDArray[np.float32],
    ) -> npt.NDArray[np.float32]:
        """Return linear RGB (N, 3), bilinear; `texels` is the pixel's footprint on level 0."""
        level = np.clip(np.log2(np.maximum(texels, 1e-6)) + 0.35, 0, self.LEVELS - 1).astype(
            np.int32
        )
        colours = np.empty((len(texture), 3), np.float32)
        for number in np.unique(level):
            chosen = np.flatnonzero(level == number)
            colours[chosen] = _bilinear(self._levels[number], texture[chosen], uv[chosen])
        return colours


@lru_cache(maxsize=512)
def _pyramid(name: str, levels: int) -> tuple[npt.NDArray[np.float32], ...]:
    """Return a texture in linear light, each level half the side of the one before."""
    level: npt.NDArray[np.float32] = make_texture(name).astype(np.float32)
    level = np.power(level / np.float32(255), np.float32(2.2))
    pyramid = [level]
    for _ in range(1, levels):
        side = level.shape[0] // 2
        level = cv2.resize(level, (side, side), interpolation=cv2.INTER_AREA).astype(np.float32)
        pyramid.append(level)
    return tuple(pyramid)


def _bilinear(
    stack: npt.NDArray[np.float32], texture: npt.NDArray[np.int32], uv: npt.NDArray[np.float32]
) -> npt.NDArray[np.float32]:
    side = stack.shape[1]
    flat = stack.reshape(-1, 3)
    x = (uv[:, 0] % 1.0) * side - 0.5
    y = (1.0 - uv[:, 1] % 1.0) * side - 0.5  # v counts upwards, rows downwards
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    left, upper = x0.astype(np.int32) % side, y0.astype(np.int32) % side
    right, lower = (left + 1) % side, (upper + 1) % side
    base = texture * (side * side)
    top = flat[base + upper * side + left] * (1 - fx) + flat[base + upper * side + right] * fx
    bottom = flat[base + lower * side + left] * (1 - fx) + flat[base + lower * side + right] * fx
    blended: npt.NDArray[np.float32] = top * (1 - fy) + bottom * fy
    return blended
