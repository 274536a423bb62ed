"""`grounded-sam`: the labels' boxes by Grounding DINO, their masks by SAM or SAM 2.

What lang-segment-anything does, which the paper uses on both images: box threshold 0.3, text
threshold 0.25, no suppression of overlapping boxes. Embeddings are kept where the workbench's
clicks look for them: a pair that was searched is a pair that clicks at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reviewer.caching import cache_folder
from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.clicks.sam import DEFAULT_SAM, sam_of_text
from reviewer.models.device import check_recorded
from reviewer.models.interfaces import Image, Instance, Objects, PairView
from reviewer.models.segmenters.grounding import GroundingDino
from reviewer.models.segmenters.sides import check_frame, find_on_both
from reviewer.words import Precision, ReferenceFrame

INSTEAD = "use --segmenter oversegment, which needs no weights"


@dataclass
class GroundedSamSegmenter:
    """Objects that the labels name; none without a label.

    Attributes:
        grounding: Grounding DINO, a directory or a hub id.
        sam: "sam:PATH" or "sam2:PATH", a directory or a hub id.
        box_threshold: least score of a box.
        text_threshold: least score of a word in the box's phrase; below it a box has no phrase.
        reference: "warped" searches the reference warped to live; "raw" searches it as it was
            taken, and warps the masks.
        precision: of SAM's encoder, "bfloat16" where the device is faster in it ("auto").
        weights: fingerprints of both; where given, the checkpoints must still hold those.
    """

    grounding: str = "IDEA-Research/grounding-dino-base"
    sam: str = DEFAULT_SAM
    box_threshold: float = 0.3
    text_threshold: float = 0.25
    reference: ReferenceFrame = "warped"
    precision: Precision = "auto"
    weights: str = ""

    def __post_init__(self) -> None:
        """Load both nets.

        Raises:
            InvalidInput: when one cannot be loaded, or holds other weights than the run began with.
        """
        check_frame(self.reference)
        option = f"--segmenter grounded-sam, grounding={self.grounding}"
        self._dino = GroundingDino(self.grounding, option, INSTEAD)
        self._sam = sam_of_text(
            self.sam, f"--segmenter grounded-sam:{self.sam}", INSTEAD, self.precision
        )
        self.precision = self._sam.precision
        self.weights = check_recorded(
            "--segmenter grounded-sam", f"{self._dino.weights} {self._sam.model_id}", self.weights
        )
        self._cache = EmbeddingCache(self._sam, cache_folder("embeddings"))

    def segment(self, view: PairView) -> Objects:
        """Return the named objects of both images."""
        if not view.labels:
            return Objects((), ())
        return find_on_both(view, lambda image: self._find(image, view.labels), self.reference)

    def _find(self, image: Image, labels: tuple[str, ...]) -> list[Instance]:
        found = self._dino.find(image, labels, self.box_threshold, self.text_threshold)
        if not found:
            return []
        embedding = self._cache.embed(image)
        boxes = np.stack([box.box_xyxy for box in found])
        masks, _ = self._sam.predict_boxes(embedding, boxes)
        return [
            Instance(np.ascontiguousarray(mask), box.phrase, box.score)
            for box, mask in zip(found, masks, strict=True)
        ]
