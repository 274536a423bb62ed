"""How sure it is that the reference shows a place: from what is found again around it.

A changed thing has no counterpart of its own, so its own pixels say nothing; its surroundings do.
"""

from __future__ import annotations

import cv2
import numpy as np

from reviewer.masks import Mask
from reviewer.models.interfaces import Field, Image

NEAR_PX, FAR_PX = 24.0, 80.0
FOLLOWING_PX = 1.5
CLIPPED, BRIGHT = 252, 170


def confidence_of(flow: Field, agreed: Mask, plane: Field | None) -> Field:
    """Return the confidence of each live pixel, float32 (H, W) in [0, 1].

    Near pixels whose flow agrees there and back, a pixel is as sure as they are many. Farther off,
    as inside a large new thing, it is as sure as the agreeing pixels around follow one plane, which
    is what its flow is taken from.

    Args:
        agreed: bool (H, W), pixels whose flow agrees there and back.
        plane: the flow of the plane that most of them follow; None without one.
    """
    height, width = agreed.shape
    share = cv2.blur(agreed.astype(np.float32), (5, 5))
    size = max(1, width // 8), max(1, height // 8)
    small = cv2.resize(share, size, interpolation=cv2.INTER_AREA)
    near = cv2.GaussianBlur(small, (0, 0), NEAR_PX / 8)
    sure = np.minimum(2 * near, 1)
    if plane is not None:
        follows = agreed & (np.linalg.norm(flow - plane, axis=2) < FOLLOWING_PX)
        flat = cv2.resize(follows.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        far, flat = (cv2.GaussianBlur(part, (0, 0), FAR_PX / 8) for part in (small, flat))
        one_plane = flat / np.maximum(far, 1e-4)
        sure = np.maximum(sure, np.minimum(one_plane, 1) ** 4 * np.minimum(3 * far, 1))
    wide = cv2.resize(sure, (width, height), interpolation=cv2.INTER_LINEAR)
    return np.asarray(np.clip(np.maximum(wide, share), 0, 1), np.float32)


def clipped(live: Image, warped: Image) -> Mask:
    """Return where one picture is clipped and the other bright: no evidence of a change there."""
    darkest = [image.min(axis=2) for image in (live, warped)]
    burnt = (darkest[0] >= CLIPPED) | (darkest[1] >= CLIPPED)
    both: Mask = burnt & (darkest[0] >= BRIGHT) & (darkest[1] >= BRIGHT)
    return both
