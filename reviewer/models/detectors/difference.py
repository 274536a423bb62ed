"""Classical change detector: a colour difference that forgives light and small misalignment."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from reviewer.masks import Mask
from reviewer.models.interfaces import Field, Image


@dataclass(frozen=True, slots=True)
class DifferenceDetector:
    """Distance in CIELAB after local light matching, as a probability.

    A pixel counts as different only by what no neighbour within `tolerance_px` of the warped
    reference explains; the scale of "different" is the pair's own noise, so that it needs no
    training. Shadows and another exposure are smooth factors on lightness and are divided out.

    Attributes:
        tolerance_px: misalignment that is tolerated.
        light_px: standard deviation of the window in which lightness is matched.
        steepness, middle: logistic from distance (in units of the pair's noise) to probability.
        least_distance: smallest CIELAB distance that can be a change, even without noise.
    """

    tolerance_px: int = 2
    light_px: float = 32.0
    steepness: float = 1.1
    middle: float = 5.0
    least_distance: float = 1.6

    def detect(self, warped: Image, live: Image, valid: Mask) -> Field:
        """Return the probability of change, float32 (H, W)."""
        present, past = _lab(live), _lab(warped)
        past = _match_light(past, present, valid, self.light_px)
        size = 2 * self.tolerance_px + 1
        kernel = np.ones((size, size), np.uint8)
        high, low = cv2.dilate(past, kernel), cv2.erode(past, kernel)
        beyond = np.maximum(np.maximum(present - high, low - present), 0)
        distance = cv2.GaussianBlur(np.sqrt((beyond**2 @ WEIGHTS).astype(np.float32)), (0, 0), 1.2)
        seen = distance[valid]
        if seen.size == 0:
            return np.zeros(valid.shape, np.float32)
        noise = max(float(np.median(seen)) + 1.4826 * _spread(seen), self.least_distance)
        probability = 1 / (1 + np.exp(-self.steepness * (distance / noise - self.middle)))
        probability[~valid] = 0
        return np.asarray(probability, np.float32)


WEIGHTS = np.array([0.55, 1.3, 1.3], np.float32)
"""Lightness counts less than colour: shadows change lightness only."""


def _spread(values: Field) -> float:
    return float(np.median(np.abs(values - np.median(values))))


def _lab(image: Image) -> Field:
    smooth = cv2.GaussianBlur(image, (0, 0), 0.8).astype(np.float32) / 255
    return np.asarray(cv2.cvtColor(smooth, cv2.COLOR_RGB2LAB), np.float32)


def _match_light(past: Field, present: Field, valid: Mask, sigma: float) -> Field:
    """Scale lightness and shift colour of `past` to the local means of `present`."""
    height, width = valid.shape
    small = (width // 4, height // 4)
    weight = cv2.resize(valid.astype(np.float32), small, interpolation=cv2.INTER_AREA)
    even = cv2.GaussianBlur(weight, (0, 0), sigma / 4) + 1e-3

    def local_mean(image: Field) -> Field:
        shrunk = cv2.resize(image, small, interpolation=cv2.INTER_AREA) * weight[..., None]
        mean = cv2.GaussianBlur(shrunk, (0, 0), sigma / 4) / even[..., None]
        return np.asarray(cv2.resize(mean, (width, height)), np.float32)

    now, then = local_mean(present), local_mean(past)
    matched = past.copy()
    matched[..., 0] *= np.clip((now[..., 0] + 4) / (then[..., 0] + 4), 0.6, 1.6)
    matched[..., 1:] += np.clip(now[..., 1:] - then[..., 1:], -6, 6)
    return matched
