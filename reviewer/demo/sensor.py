"""Turn linear light into a camera picture: lens, exposure, tone curve, noise, 8 bits."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True)
class Exposure:
    """One session's camera state: gain, colour balance, noise in 8-bit steps."""

    gain: float
    balance: tuple[float, float, float]
    noise: float = 1.6


def develop(
    light: npt.NDArray[np.float32], exposure: Exposure, rng: np.random.Generator
) -> npt.NDArray[np.uint8]:
    """Return the uint8 RGB (H, W, 3) picture of linear light (H, W, 3)."""
    height, width = light.shape[:2]
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    radius = ((x / width - 0.5) ** 2 + (y / height - 0.5) ** 2)[..., None]
    exposed = (
        light * np.asarray(exposure.balance, np.float32) * (exposure.gain * (1 - 0.45 * radius))
    )
    exposed = cv2.GaussianBlur(exposed, (0, 0), 0.55)
    # A filmic shoulder keeps lamps from burning out flat, then the sRGB-like gamma.
    toned = exposed * (1 + exposed * 0.12) / (1 + exposed * 0.45)
    picture = 255 * np.clip(toned, 0, 1) ** (1 / 2.2)
    grain = rng.standard_normal(picture.shape, dtype=np.float32)
    picture += grain * exposure.noise * (1.25 - 0.5 * picture / 255)
    developed: npt.NDArray[np.uint8] = np.clip(picture + 0.5, 0, 255).astype(np.uint8)
    return developed
