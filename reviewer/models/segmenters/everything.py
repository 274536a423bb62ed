"""`sam-everything`: all objects that SAM sees, asked at every point of a grid.

After the automatic mask generator of Kirillov et al., "Segment Anything", ICCV 2023: candidates are
kept when SAM is sure of them, when they hardly change with the threshold (stability), and when no
better one has nearly the same box. It reads neither M_o nor labels, so one search serves all
detectors of a reference/live pair.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from reviewer.caching import cache_folder
from reviewer.errors import InvalidInput
from reviewer.masks import Mask, crop_to_box
from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.clicks.sam import DEFAULT_SAM, sam_of_text
from reviewer.models.device import check_recorded
from reviewer.models.interfaces import Embedding, Image, Instance, Objects, PairView
from reviewer.models.segmenters.grounded import INSTEAD
from reviewer.models.segmenters.sides import check_frame, find_on_both
from reviewer.words import Precision, ReferenceFrame

Boxes = npt.NDArray[np.float32]
POINTS_AT_ONCE = 32
STABILITY_OFFSET = 1.0


@dataclass
class SamEverythingSegmenter:
    """Exhaustive over-segmentation.

    Attributes:
        sam: "sam:PATH" or "sam2:PATH", a directory or a hub id.
        points_per_side: points of the grid along the longer side.
        least_score: least IoU of a mask, as SAM predicts it.
        least_stability: IoU of the masks one logit above and one below the threshold.
        most_box_overlap: IoU of two boxes above which only the better mask stays.
        least_px: smaller masks are specks.
        most_share: larger masks, as a share of the image, are background.
        reference: "warped" searches the reference warped to live; "raw" searches it as it was
            taken, and warps the masks.
        precision: of SAM's encoder, "bfloat16" where the device is faster in it ("auto").
        weights: fingerprint; where given, the checkpoint must still hold those.
    """

    sam: str = DEFAULT_SAM
    points_per_side: int = 32
    least_score: float = 0.8
    least_stability: float = 0.92
    most_box_overlap: float = 0.7
    least_px: int = 20
    most_share: float = 0.25
    reference: ReferenceFrame = "warped"
    precision: Precision = "auto"
    weights: str = ""

    def __post_init__(self) -> None:
        """Load the net; raises InvalidInput when it cannot be, or a setting makes no sense."""
        check_frame(self.reference)
        if self.points_per_side < 1:
            raise InvalidInput(
                f"sam-everything: points_per_side must be >= 1, but is {self.points_per_side}"
            )
        self._sam = sam_of_text(
            self.sam, f"--segmenter sam-everything:{self.sam}", INSTEAD, self.precision
        )
        self.precision = self._sam.precision
        self.weights = check_recorded(
            "--segmenter sam-everything", self._sam.model_id, self.weights
        )
        self._cache = EmbeddingCache(self._sam, cache_folder("embeddings"))

    def segment(self, view: PairView) -> Objects:
        """Return everything on both images."""
        return find_on_both(view, self._find, self.reference)

    def _find(self, image: Image) -> list[Instance]:
        embedding = self._cache.embed(image)
        grid = grid_points(image.shape[0], image.shape[1], self.points_per_side)
        masks: list[Mask] = []
        scores: list[float] = []
        for start in range(0, len(grid), POINTS_AT_ONCE):
            found = self._candidates(embedding, grid[start : start + POINTS_AT_ONCE])
            masks += [mask for mask, _ in found]
            scores += [score for _, score in found]
        if not masks:
            return []
        crops = [crop for mask in masks if (crop := crop_to_box(mask)) is not None]
        boxes = np.array([crop.box_xyxy for crop in crops], np.float32)
        kept = suppress(boxes, np.asarray(scores, np.float32), self.most_box_overlap)
        return [Instance(masks[k], "", scores[k]) for k in kept]

    def _candidates(self, embedding: Embedding, points: Boxes) -> list[tuple[Mask, float]]:
        logits, scores = self._sam.predict_points(embedding, points)
        flat, sure = logits.flatten(0, 1), scores.reshape(-1)
        surely = (flat > STABILITY_OFFSET).sum((-1, -2)).float()
        maybe = (flat > -STABILITY_OFFSET).sum((-1, -2)).float()
        stability = (surely / maybe.clamp(min=1)).cpu().numpy()
        area = (flat > 0).sum((-1, -2)).cpu().numpy()
        most = self.most_share * flat.shape[-1] * flat.shape[-2]
        good = (
            (sure > self.least_score)
            & (stability > self.least_stability)
            & (area >= self.least_px)
            & (area <= most)
        )
        return [
            (np.ascontiguousarray((flat[k] > 0).cpu().numpy()), float(sure[k]))
            for k in np.flatnonzero(good)
        ]


def grid_points(height: int, width: int, per_side: int) -> Boxes:
    """Return centres of square cells, float32 (N, 2), `per_side` of them along the longer side."""
    step = max(height, width) / per_side
    xs = (np.arange(max(1, round(width / step))) + 0.5) * step
    ys = (np.arange(max(1, round(height / step))) + 0.5) * step
    x, y = np.meshgrid(np.minimum(xs, width - 0.5), np.minimum(ys, height - 0.5))
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float32)


def suppress(boxes: Boxes, scores: npt.NDArray[np.float32], most_overlap: float) -> list[int]:
    """Return the boxes (N, 4) that no better one overlaps by more than that IoU, best first."""
    area = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    order = np.argsort(-scores, kind="stable")
    kept: list[int] = []
    while len(order):
        best, rest = int(order[0]), order[1:]
        kept.append(best)
        shared = np.clip(
            np.minimum(boxes[best, 2:], boxes[rest, 2:])
            - np.maximum(boxes[best, :2], boxes[rest, :2]),
            0,
            None,
        ).prod(axis=1)
        order = rest[shared / (area[best] + area[rest] - shared) <= most_overlap]
    return kept
