"""Several flows of one pair, each from another start, and the best of them pixel by pixel.

Dense flow finds what moved by some pixels. Where a room was seen from farther aside, matched
features give homographies of its planes; flow from the picture that such a plane brings together
finds the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from reviewer.masks import Mask
from reviewer.models.aligners.planes import Matrix, features, flow_of_homography, matched_points
from reviewer.models.interfaces import Field, Image, ModelFailed
from reviewer.models.warping import inside, sample_field, warp_image

LEAST_INLIERS = 15
TOLERANCE_PX = 4.0
LOOSE_RATIO = 0.85
WINDOW_PX = 21
MOST_ERROR_PX = 4.0
ERROR_WEIGHT = 0.15

DenseFlow = Callable[[Image, Image], Field]


@dataclass(frozen=True, slots=True)
class BothWays:
    """Flows found independently, float32 (H, W, 2): live -> reference, reference -> live."""

    forward: Field
    backward: Field


def there_and_back(found: BothWays) -> Field:
    """Return how far one ends from where one began, pixels, float32 (H, W)."""
    landing = sample_field(found.backward, found.forward)
    return np.asarray(np.linalg.norm(found.forward + landing, axis=2), np.float32)


def by_planes(
    reference: Image, live: Image, present: Image, past: Image, dense: DenseFlow, most: int
) -> list[BothWays]:
    """Return flows that start from up to `most` homographies of matched features.

    Args:
        present, past: grey pictures (H, W) of even light, which `dense` compares.
    """
    height, width = present.shape
    rivals = []
    for matrix in _planes(reference, live, most):
        there = flow_of_homography(matrix, height, width)
        back = flow_of_homography(np.asarray(np.linalg.inv(matrix), np.float64), height, width)
        moved = warp_image(past, there)
        rest, rest_back = dense(present, moved), dense(moved, present)
        # live -> moved -> reference, and reference -> moved -> live.
        forward = rest + sample_field(there, rest)
        backward = back + sample_field(rest_back, back)
        rivals.append(BothWays(forward, backward))
    return rivals


def fused(found: Sequence[BothWays], present: Image, past: Image) -> BothWays:
    """Return at each pixel the flow that explains its surroundings best, in both directions."""
    turned = [BothWays(flows.backward, flows.forward) for flows in found]
    return BothWays(_best(found, present, past), _best(turned, past, present))


def _planes(reference: Image, live: Image, most: int) -> list[Matrix]:
    try:
        source, target = matched_points(features(live), features(reference), LOOSE_RATIO)
    except ModelFailed:
        return []
    found: list[Matrix] = []
    while len(found) < most and len(source) >= LEAST_INLIERS:
        cv2.setRNGSeed(0)
        matrix, inliers = cv2.findHomography(
            source, target, cv2.USAC_MAGSAC, TOLERANCE_PX, maxIters=2000, confidence=0.999
        )
        if matrix is None or int(inliers.sum()) < LEAST_INLIERS or not _is_a_view(matrix, live):
            break
        found.append(np.asarray(matrix, np.float64))
        rest = inliers.ravel() == 0
        source, target = source[rest], target[rest]
    return found


def _is_a_view(matrix: Matrix, live: Image) -> bool:
    """Say whether a homography keeps the picture's corners in order and its size within reason."""
    height, width = live.shape[:2]
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    if not (corners @ matrix[2, :2] + matrix[2, 2] > 0).all():
        return False
    moved = cv2.perspectiveTransform(corners[:, None], matrix)
    share = cv2.contourArea(moved, oriented=True) / (height * width)
    return bool(cv2.isContourConvex(moved) and 0.15 < share < 6)


def _best(found: Sequence[BothWays], source: Image, target: Image) -> Field:
    mine = _normalised(source)
    theirs = _normalised(target)
    height, width = source.shape
    costs = []
    for flows in found:
        unlike = np.abs(mine - sample_field(theirs, flows.forward))
        error = np.minimum(there_and_back(flows), MOST_ERROR_PX)
        cost = unlike + ERROR_WEIGHT * error
        cost[~inside(flows.forward, height, width)] = 2 + ERROR_WEIGHT * MOST_ERROR_PX
        costs.append(cv2.blur(cost, (WINDOW_PX, WINDOW_PX)))
    chosen = np.argmin(costs, axis=0).astype(np.uint8)
    chosen = cv2.medianBlur(chosen, 11)
    result = found[0].forward.copy()
    for number, flows in enumerate(found[1:], start=1):
        where: Mask = chosen == number
        result[where] = flows.forward[where]
    return result


def _normalised(picture: Image) -> Field:
    """Return the picture less its local mean, in units of its local contrast, within [-2, 2]."""
    values = picture.astype(np.float32)
    mean = cv2.GaussianBlur(values, (0, 0), 6)
    spread = np.sqrt(np.maximum(cv2.GaussianBlur(values**2, (0, 0), 6) - mean**2, 0))
    return np.asarray(np.clip((values - mean) / (spread + 8), -2, 2), np.float32)
