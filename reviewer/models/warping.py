"""Apply a flow field to images, masks and other fields."""

from __future__ import annotations

import cv2
import numpy as np

from reviewer.masks import Mask
from reviewer.models.interfaces import Field, Image


def warp_image(image: Image, flow: Field) -> Image:
    """Sample `image` at (x + dx, y + dy), bilinear; the border repeats outwards."""
    x, y = targets(flow)
    warped = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(warped, np.uint8)


def sample_field(field: Field, flow: Field) -> Field:
    """Sample a field, (H, W) or (H, W, 2), at (x + dx, y + dy), bilinear; the border repeats."""
    x, y = targets(flow)
    sampled = cv2.remap(field, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(sampled, np.float32)


def warp_mask(mask: Mask, flow: Field) -> Mask:
    """Sample a mask at (x + dx, y + dy), nearest neighbour; outside is False."""
    x, y = targets(flow)
    warped = cv2.remap(mask.view(np.uint8), x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT)
    return np.asarray(warped, np.uint8).view(np.bool_)


def inside(flow: Field, height: int, width: int) -> Mask:
    """Say which pixels of a flow field land inside an image of the given size."""
    x, y = targets(flow)
    landed: Mask = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
    return landed


def targets(flow: Field) -> tuple[Field, Field]:
    """Return x and y of where each pixel of a flow field lands, float32 (H, W)."""
    height, width = flow.shape[:2]
    x = flow[..., 0] + np.arange(width, dtype=np.float32)[None, :]
    y = flow[..., 1] + np.arange(height, dtype=np.float32)[:, None]
    return x, y
