"""What a change detector may have said of views: the shipped one's answer, and worse ones.

A click net that believes a detector is of no use where the detector errs, or where people run
another one. So the answer is blurred, cut to a mask, and things are dropped from it and invented in
it; in part of the views there is none.
"""

from __future__ import annotations

import cv2
import numpy as np

from reviewer.masks import dilate
from reviewer.models.interfaces import ConfidentDetector, Field
from reviewer.training.aligned_views import AlignedViews

SILENT = 0.25
"""Share of views of which no detector says anything."""
AS_MASK = 0.3
DROPPED = 0.15
BLURRED = 0.3
INVENTED = 0.3


def said_of(views: AlignedViews, detector: ConfidentDetector, rng: np.random.Generator) -> Field:
    """Return a probability of change, float32 (H, W) in [0, 1]; 0 where nothing is compared."""
    shape = views.confidence.shape
    if rng.random() < SILENT or not views.valid.any():
        return np.zeros(shape, np.float32)
    said = detector.detect_confident(views.warped, views.live, views.valid, views.confidence)
    for thing in (*views.came, *views.went):
        if rng.random() < DROPPED:
            said = np.where(dilate(thing, size_px=5), said * float(rng.uniform(0, 0.4)), said)
    if rng.random() < INVENTED:
        said = np.maximum(said, _blob(shape, rng))
    if rng.random() < BLURRED:
        said = cv2.GaussianBlur(said, (0, 0), float(rng.uniform(0.7, 3.0)))
    # Detectors differ in how sure they are.
    odds = float(np.exp(rng.normal(0, 0.7)))
    said = said * odds / (said * odds + (1 - said) + 1e-6)
    if rng.random() < AS_MASK:
        said = (said > float(rng.uniform(0.35, 0.65))).astype(np.float32)
    return np.where(views.valid, said, 0).astype(np.float32)


def _blob(shape: tuple[int, ...], rng: np.random.Generator) -> Field:
    blob = np.zeros(shape, np.float32)
    middle = (int(rng.integers(shape[1])), int(rng.integers(shape[0])))
    axes = (int(rng.integers(2, 30)), int(rng.integers(2, 30)))
    cv2.ellipse(
        blob, middle, axes, float(rng.uniform(0, 180)), 0, 360, float(rng.uniform(0.5, 1)), -1
    )
    return blob
