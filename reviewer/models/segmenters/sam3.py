"""`sam3`: objects that words name, boxes and masks by one net.

Source: SAM 3 (Meta, 2025), as `transformers` implements it. Its weights are gated: whoever uses
them asks for them first. The picture is prepared and the masks are read here, as the library's
processor does it, because that one needs torchvision.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F
from transformers import AutoTokenizer, Sam3Model

from reviewer.models.device import best_device, check_weights
from reviewer.models.interfaces import Image, Instance, Objects, PairView
from reviewer.models.segmenters.grounded import INSTEAD
from reviewer.models.segmenters.sides import check_frame, find_on_both
from reviewer.models.weights.hub import load_beside, load_pretrained
from reviewer.words import ReferenceFrame

LONGEST_TEXT = 32


@dataclass
class Sam3Segmenter:
    """Objects that the labels name; none without a label.

    Attributes:
        checkpoint: directory or hub id.
        least_score: least score of an instance, times the probability that there is any.
        reference: "warped" searches the reference warped to live; "raw" searches it as it was
            taken, and warps the masks.
        weights: fingerprint; where given, the checkpoint must still hold those.
    """

    checkpoint: str = "facebook/sam3"
    least_score: float = 0.5
    reference: ReferenceFrame = "warped"
    weights: str = ""

    def __post_init__(self) -> None:
        """Load the net; raises InvalidInput when it cannot be."""
        check_frame(self.reference)
        option = f"--segmenter sam3:{self.checkpoint}"
        # The published checkpoint calls itself a video model; it holds the image model too.
        types = {"sam3", "sam3_video"}
        self._net = load_pretrained(
            Sam3Model, self.checkpoint, option, types=types, instead=INSTEAD
        )
        self._tokenizer: Any = load_beside(AutoTokenizer, self.checkpoint, option, INSTEAD)
        self.weights = check_weights(self.checkpoint, self._net, self.weights)
        self._device = best_device()
        self._net.to(self._device).eval()

    def segment(self, view: PairView) -> Objects:
        """Return the named objects of both images."""
        return find_on_both(view, lambda image: self._find(image, view.labels), self.reference)

    @torch.inference_mode()
    def _find(self, image: Image, labels: tuple[str, ...]) -> list[Instance]:
        if not labels:
            return []
        seen = self._net.get_vision_features(pixel_values=self._pixels(image))
        found: list[Instance] = []
        for label in labels:
            words = self._tokenizer(
                label,
                return_tensors="pt",
                padding="max_length",
                max_length=LONGEST_TEXT,
                truncation=True,
            ).to(self._device)
            out = self._net(
                vision_embeds=seen,
                input_ids=words["input_ids"],
                attention_mask=words["attention_mask"],
            )
            found += self._instances(out, label, *image.shape[:2])
        return found

    def _instances(self, out: Any, label: str, height: int, width: int) -> list[Instance]:
        scores = (out.pred_logits.sigmoid() * out.presence_logits.sigmoid())[0].float()
        kept = torch.nonzero(scores > self.least_score).flatten()
        if not len(kept):
            return []
        chances = out.pred_masks[0, kept].float().sigmoid()
        whole = F.interpolate(chances[None], (height, width), mode="bilinear")[0]
        masks = (whole > 0.5).cpu().numpy()
        return [
            Instance(np.ascontiguousarray(mask), label, float(scores[k]))
            for k, mask in zip(kept.tolist(), masks, strict=True)
        ]

    def _pixels(self, image: Image) -> torch.Tensor:
        """Return the picture squashed to the net's square, in [-1, 1]."""
        side = int(self._net.config.image_size)
        pixels = torch.from_numpy(np.array(image)).permute(2, 0, 1)[None]
        small = F.interpolate(pixels, (side, side), mode="bilinear", antialias=True)
        return ((small.float() / 255 - 0.5) / 0.5).to(self._device)
