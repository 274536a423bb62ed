"""An image as the GrabCut clicks see it: colour and change per pixel, and how good a mask looks.

Change is the difference to the other image, least within a pixel, since no alignment is exact.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from reviewer.masks import Mask, crop_to_box, dilate, fill_holes, keep_touched
from reviewer.models.interfaces import Click, Field, Image

Window = tuple[slice, slice]

CHANGE_SHARES = (0.6, 0.35)
LARGEST_GAP_PX = 128
USUAL_GAP_PX = 8.0
LARGEST_PATCH_PX = 64
LIGHT_SIGMA_PX, SHRINK = 32, 8
# Rim step (CIELAB) and gain of change at which a mask is as good as it gets; the factors are a
# least-squares fit of the true IoU over one-click candidates of the demo world.
SHARP_RIM, STRONG_CHANGE = 30.0, 25.0
RIM_FACTOR, CHANGE_FACTOR = 0.44, 0.30


@dataclass(frozen=True, slots=True)
class Scene:
    """An embedded image: features (H, W, 6), change (H, W)."""

    features: Field
    change: Field

    def pixel(self, click: Click) -> tuple[int, int]:
        height, width = self.change.shape
        return min(max(int(click.x), 0), width - 1), min(max(int(click.y), 0), height - 1)

    def window(self, x: int, y: int, reach: int) -> Window:
        height, width = self.change.shape
        rows = slice(max(0, y - reach), min(height, y + reach + 1))
        return rows, slice(max(0, x - reach), min(width, x + reach + 1))

    def gap(self, mask: Mask, x: int, y: int) -> float:
        """Distance from a pixel to the nearest pixel that is the other way, capped."""
        window = self.window(x, y, LARGEST_GAP_PX)
        other = (mask[window] != mask[y, x]).view(np.uint8)
        if not other.any():
            return USUAL_GAP_PX
        distance = cv2.distanceTransform(1 - other, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        return float(distance[y - window[0].start, x - window[1].start])

    def rate(self, mask: Mask) -> float:
        """Guess the IoU: how sharp the rim is, and how much more has changed inside."""
        if not mask.any():
            return 0.0
        x0, y0, x1, y1 = box_of(mask)
        part = np.s_[max(0, y0 - 4) : y1 + 4, max(0, x0 - 4) : x1 + 4]
        inside, features, change = mask[part], self.features[part], self.change[part]
        across = inside[:, 1:] != inside[:, :-1]
        down = inside[1:] != inside[:-1]
        steps = np.concatenate(
            [
                np.linalg.norm((features[:, 1:] - features[:, :-1])[across], axis=1),
                np.linalg.norm((features[1:] - features[:-1])[down], axis=1),
            ]
        )
        ring = dilate(inside, size_px=7) & ~inside
        rim = float(np.minimum(steps, 1.3 * SHARP_RIM).mean()) if steps.size else 0.0
        gain = float(np.median(change[inside]) - np.median(change[ring])) if ring.any() else 0.0
        gain = min(max(gain / STRONG_CHANGE, -1.0), 1.2)
        return min(max(RIM_FACTOR * rim / SHARP_RIM + CHANGE_FACTOR * gain, 0.0), 1.0)


def levels_of_change(scene: Scene, x: int, y: int) -> Iterable[Mask]:
    """Yield the changed patches around a pixel, at shares of the change there."""
    window = scene.window(x, y, LARGEST_PATCH_PX)
    change = cv2.GaussianBlur(scene.change, (0, 0), 0.6)[window]
    cy, cx = y - window[0].start, x - window[1].start
    peak = float(change[max(0, cy - 1) : cy + 2, max(0, cx - 1) : cx + 2].max())
    areas = set()
    for share in CHANGE_SHARES:
        patch = fill_holes(keep_touched(change > max(share * peak, 3.0), [(cx, cy)]))
        area = int(np.count_nonzero(patch))
        if area and area not in areas:
            areas.add(area)
            yield placed(scene, window, patch)


def disc(window: Window, x: int, y: int, radius: float) -> Mask:
    rows, columns = np.ogrid[window[0], window[1]]
    return np.asarray((rows - y) ** 2 + (columns - x) ** 2 <= radius * radius)


def placed(scene: Scene, window: Window, part: Mask) -> Mask:
    mask = np.zeros(scene.change.shape, np.bool_)
    mask[window] = part
    return mask


def to_lab(image: Image) -> Field:
    return np.asarray(cv2.cvtColor(image.astype(np.float32) / 255, cv2.COLOR_RGB2LAB), np.float32)


def change_between(present: Field, past: Field) -> Field:
    """Return the smallest difference within a pixel, less slow changes of the light."""
    light = _slow(np.clip(present - past, -12, 12))
    present, past = (cv2.GaussianBlur(lab, (0, 0), 0.7) for lab in (present, past + light))
    padded = cv2.copyMakeBorder(past, 1, 1, 1, 1, cv2.BORDER_REPLICATE)
    height, width = present.shape[:2]
    result = np.zeros_like(present)
    least = np.full((height, width), np.inf, np.float32)
    # OpenCV throughout: three times as fast as numpy here, and it lets other threads run.
    for dy in range(3):
        for dx in range(3):
            difference = cv2.subtract(present, padded[dy : dy + height, dx : dx + width])
            square = cv2.transform(cv2.multiply(difference, difference), np.ones((1, 3)))
            cv2.copyTo(difference, cv2.compare(square, least, cv2.CMP_LT), result)
            cv2.min(square, least, dst=least)
    return np.asarray(result, np.float32)


def _slow(field: Field) -> Field:
    """Return what of a field changes slowly, blurred where it is small."""
    height, width = field.shape[:2]
    size = (max(1, width // SHRINK), max(1, height // SHRINK))
    small = cv2.resize(field, size, interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), LIGHT_SIGMA_PX / SHRINK)
    return np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR))


def box_of(mask: Mask) -> tuple[int, int, int, int]:
    crop = crop_to_box(np.ascontiguousarray(mask))
    assert crop is not None, "asked only of masks that are not empty"
    return crop.box_xyxy
