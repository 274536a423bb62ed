"""Grounding DINO: boxes of the objects that words name.

Source: Liu et al., "Grounding DINO", ECCV 2024, as `transformers` implements it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from transformers import GroundingDinoForObjectDetection, GroundingDinoProcessor

from reviewer.models.device import best_device, fingerprint
from reviewer.models.interfaces import Image
from reviewer.models.weights.hub import load_beside, load_pretrained

# [CLS], [SEP], full stop, question mark and padding part the phrases, as in the network itself.
SEPARATORS = (101, 102, 1012, 1029, 0)


@dataclass(frozen=True, slots=True)
class FoundBox:
    """A box float32 (x0, y0, x1, y1) in pixels, its score in [0, 1], and the phrase it answers."""

    box_xyxy: npt.NDArray[np.float32]
    score: float
    phrase: str


class GroundingDino:
    """A loaded checkpoint; not thread-safe: one worker a device calls it."""

    def __init__(self, name: str, option: str, instead: str) -> None:
        """Load a local directory or a fetched hub id; raises InvalidInput when it cannot be."""
        self._device = best_device()
        self.model = load_pretrained(
            GroundingDinoForObjectDetection,
            name,
            option,
            types={"grounding-dino"},
            instead=instead,
        )
        self._processor: Any = load_beside(GroundingDinoProcessor, name, option, instead)
        self.weights = fingerprint(self.model)
        self.model.to(self._device).eval()

    def find(
        self, image: Image, phrases: Sequence[str], box_threshold: float, text_threshold: float
    ) -> list[FoundBox]:
        """Return the boxes of all phrases, best first; the phrase is "" where no word is sure.

        A box counts when its best word exceeds `box_threshold`, as the library has it; it answers
        the phrase of its best word, when that exceeds `text_threshold`.
        """
        found: list[FoundBox] = []
        for group in self._groups(phrases):
            found += self._find(image, group, box_threshold, text_threshold)
        return sorted(found, key=lambda box: -box.score)

    def _groups(self, phrases: Sequence[str]) -> list[list[str]]:
        """Cut a long list into texts that the network can read."""
        most = int(self.model.config.max_text_len)
        groups: list[list[str]] = [[]]
        for phrase in phrases:
            longer = [*groups[-1], phrase]
            if groups[-1] and len(self._ids(longer)) > most:
                groups.append([phrase])
            else:
                groups[-1] = longer
        return [group for group in groups if group]

    def _ids(self, phrases: Sequence[str]) -> list[int]:
        return list(self._processor.tokenizer(_text(phrases)).input_ids)

    def _find(
        self, image: Image, phrases: list[str], box_threshold: float, text_threshold: float
    ) -> list[FoundBox]:
        inputs = self._processor(
            images=np.ascontiguousarray(image),
            text=_text(phrases),
            return_tensors="pt",
            truncation=True,
            max_length=self.model.config.max_text_len,
            input_data_format="channels_last",
        )
        with torch.inference_mode():
            out = self.model(**inputs.to(self._device))
        height, width = image.shape[:2]
        chances = out.logits[0].float().sigmoid().cpu()
        centre_x, centre_y, w, h = out.pred_boxes[0].float().cpu().unbind(-1)
        corners = torch.stack(
            [centre_x - w / 2, centre_y - h / 2, centre_x + w / 2, centre_y + h / 2], -1
        )
        boxes = (corners * torch.tensor([width, height, width, height])).numpy()
        boxes = np.clip(boxes, 0, [width, height, width, height]).astype(np.float32)
        spans = _spans(inputs["input_ids"][0].tolist())
        found = []
        for box, words in zip(boxes, chances, strict=True):
            score = float(words.max())
            large = (box[2:] - box[:2]).min() >= 1
            if score <= box_threshold or not large:
                continue
            sure = [float(words[a:b].max()) for a, b in spans]
            best = int(np.argmax(sure))
            phrase = phrases[best] if sure[best] > text_threshold else ""
            found.append(FoundBox(box, score, phrase))
        return found


def _text(phrases: Sequence[str]) -> str:
    """Return phrases as the network reads them: each ends with a full stop."""
    cleaned = [" ".join(phrase.lower().replace(".", " ").split()) for phrase in phrases]
    return " ".join(f"{phrase}." for phrase in cleaned)


def _spans(ids: Sequence[int]) -> list[tuple[int, int]]:
    """Return where the phrases' words lie, by the separators between them."""
    found: list[tuple[int, int]] = []
    start: int | None = None
    for place, token in enumerate([*ids, SEPARATORS[1]]):
        if token in SEPARATORS:
            if start is not None:
                found.append((start, place))
            start = None
        elif start is None:
            start = place
    return found
