"""A small picture of what was found: the live image around it, with its rim."""

from __future__ import annotations

import io

import cv2
import numpy as np
from PIL import Image as PillowImage

from reviewer.dataset.pictures import read_picture
from reviewer.masks import Mask, components, decode_rle
from reviewer.pipeline.stored import live_masks, region_pixels
from reviewer.records import StoredRegion
from reviewer.store.database import Store
from reviewer.store.finds import Find
from reviewer.store.layers import load_detection
from reviewer.store.pairs import pair_of_id
from reviewer.store.regions import load_regions, region_of_id

SIDE = 176
LEAST_CROP_PX = 72
RIM = (255, 196, 0)


def draw_thumbnail(store: Store, find: Find) -> bytes:
    """Return a square JPEG of SIDE pixels.

    Raises:
        NotFound: when the image or the region is gone.
    """
    live = read_picture(pair_of_id(store, find.pair_id).live)
    mask = _mask(store, find)
    rows, columns = _square(find.box_xyxy, *live.shape[:2])
    part = np.ascontiguousarray(live[rows, columns])
    scale = SIDE / max(part.shape[:2])
    size = (max(1, round(part.shape[1] * scale)), max(1, round(part.shape[0] * scale)))
    picture = cv2.resize(part, size, interpolation=cv2.INTER_CUBIC)
    shown = cv2.resize(mask[rows, columns].astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(shown, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(picture, outlines, -1, RIM, 1, cv2.LINE_AA)
    canvas = np.full((SIDE, SIDE, 3), 24, np.uint8)
    y, x = (SIDE - size[1]) // 2, (SIDE - size[0]) // 2
    canvas[y : y + size[1], x : x + size[0]] = picture
    buffer = io.BytesIO()
    PillowImage.fromarray(canvas).save(buffer, "JPEG", quality=88)
    return buffer.getvalue()


def _mask(store: Store, find: Find) -> Mask:
    run_id, pair_id = region_of_id(store, find.region_id)
    stored = next(r for r in load_regions(store, run_id, pair_id) if r.id == find.region_id)
    detection = load_detection(store, run_id, pair_id)
    assert detection is not None, "a region is made from a detection"
    return _pixels(store, run_id, pair_id, stored, decode_rle(detection.mask))


def _pixels(store: Store, run_id: int, pair_id: int, stored: StoredRegion, change: Mask) -> Mask:
    labels, _ = components(change)
    thing, parts = region_pixels(stored.region, live_masks(store, run_id, pair_id), labels)
    return thing if stored.outcome == "adopt" and thing is not None else parts


def _square(box: tuple[int, int, int, int], height: int, width: int) -> tuple[slice, slice]:
    """Return a square window around a box with some of what surrounds it, inside the image."""
    x0, y0, x1, y1 = box
    side = min(max(LEAST_CROP_PX, round(1.6 * max(x1 - x0, y1 - y0))), height, width)
    left = min(max(0, (x0 + x1 - side) // 2), width - side)
    top = min(max(0, (y0 + y1 - side) // 2), height - side)
    return slice(top, top + side), slice(left, left + side)
