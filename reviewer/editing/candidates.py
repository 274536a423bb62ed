"""Candidates: small places that look changed and that nothing proposes, so that a person is asked.

What is left of the difference after alignment, less slow changes of the light and the least within
a pixel, is compared with its surroundings at the size of small things, against how much the place
differs anyhow (noise, edges), and weighed by how sure the alignment is that the reference shows
it. The strongest places outside everything that is proposed come first. Pure: arrays in, masks out.
"""

from __future__ import annotations

import cv2
import numpy as np

from reviewer.masks import Mask, dilate
from reviewer.models.clicks.scene import change_between, to_lab
from reviewer.models.interfaces import Field, Image

MOST = 5
LARGEST_SIDE_PX = 1600
"""Larger pictures are looked at scaled down to this."""
SMALL_PX, AROUND_PX, NOISE_PX = 1.5, 6.0, 12.0
COLOUR = np.array([0.7, 1.3, 1.3], np.float32)
LEAST_NOISE, EDGES, MOST_CHANGE = 3.0, 0.5, 30.0
REACH_PX, APART_PX = 24, 8
COVERED_PX = 5
LEAST_STRENGTH = 0.5


def find_candidates(
    live: Image, warped: Image, sure: Field, covered: Mask
) -> list[tuple[float, Mask]]:
    """Return at most `MOST` candidates, the strongest first: its strength in [0, 1], and its mask.

    Args:
        live, warped: uint8 RGB (H, W, 3), the live image and the reference warped to it.
        sure: float32 (H, W) in [0, 1], how sure it is that the reference shows a pixel; 0 = unseen.
        covered: bool (H, W), what is proposed already.
    """
    height, width = covered.shape
    step = -(-max(height, width) // LARGEST_SIDE_PX)
    if step == 1:
        return _find(live, warped, sure, covered)
    size = (width // step, height // step)
    small = [cv2.resize(each, size, interpolation=cv2.INTER_AREA) for each in (live, warped)]
    least = cv2.resize(sure, size, interpolation=cv2.INTER_NEAREST)
    found = _find(small[0], small[1], least, _resized(covered, size))
    return [(strength, _resized(mask, (width, height))) for strength, mask in found]


def _find(live: Image, warped: Image, sure: Field, covered: Mask) -> list[tuple[float, Mask]]:
    change = cv2.transform(change_between(to_lab(live), to_lab(warped)), np.diag(COLOUR))
    residual = np.asarray(np.linalg.norm(change, axis=2), np.float32)
    residual[~_well_inside(sure > 0)] = 0
    noise = LEAST_NOISE + _blurred(np.minimum(residual, MOST_CHANGE), NOISE_PX)
    noise += EDGES * _edges(warped)
    contrast = np.maximum(_blurred(residual, SMALL_PX) - _blurred(residual, AROUND_PX), 0)
    strength = contrast / noise * sure
    strength[dilate(covered, size_px=COVERED_PX)] = 0
    smooth = _blurred(residual, 0.8)
    found: list[tuple[float, Mask]] = []
    while len(found) < MOST:
        y, x = (int(v) for v in np.unravel_index(int(strength.argmax()), strength.shape))
        value = float(strength[y, x])
        if value < LEAST_STRENGTH:
            break
        mask = _thing_at(smooth, x, y)
        found.append((value / (1 + value), mask))
        strength[dilate(mask, size_px=3)] = 0
        cv2.circle(strength, (x, y), APART_PX, 0, -1)
    return found


def _thing_at(residual: Field, x: int, y: int) -> Mask:
    """Return the patch around a pixel that differs at least half as much as it."""
    top, left = max(0, y - REACH_PX), max(0, x - REACH_PX)
    window = np.s_[top : y + REACH_PX + 1, left : x + REACH_PX + 1]
    high = (residual[window] > 0.5 * residual[y, x]).astype(np.uint8)
    _, labels = cv2.connectedComponents(high)
    mask = np.zeros(residual.shape, np.bool_)
    mask[window] = labels == labels[y - top, x - left]
    return mask


def _edges(picture: Image) -> Field:
    """Return how steep a picture is: there the least misalignment makes a difference."""
    grey = picture.astype(np.float32).mean(axis=2)
    across, down = (cv2.Sobel(grey, cv2.CV_32F, dx, 1 - dx) / 8 for dx in (1, 0))
    return _blurred(cv2.magnitude(across, down), 2)


def _well_inside(mask: Mask) -> Mask:
    return np.asarray(cv2.erode(mask.view(np.uint8), np.ones((5, 5), np.uint8))).astype(np.bool_)


def _blurred(field: Field, sigma_px: float) -> Field:
    return np.asarray(cv2.GaussianBlur(field, (0, 0), sigma_px), np.float32)


def _resized(mask: Mask, size: tuple[int, int]) -> Mask:
    pixels = cv2.resize(mask.view(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    return np.asarray(pixels).astype(np.bool_)
