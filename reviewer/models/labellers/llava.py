"""LLaVA-1.5 as a labeller: one question about what has changed, answered in words.

`llava` is shown the change cut out of the picture; `llava-alpha`, as in the paper, the whole one
with the change as Alpha-CLIP's fourth channel. Picture and mask go through one pad and one resize.
Answers are greedy, so they are the same each time.

Sources: Liu et al., "Improved Baselines with Visual Instruction Tuning", CVPR 2024; for the paper's
use of it see its section "Object Search".
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from PIL import Image as PillowImage
from transformers import AutoTokenizer, LlavaForConditionalGeneration

from reviewer.errors import InvalidInput
from reviewer.masks import Crop, Mask, components, crop_to_box
from reviewer.models.device import (
    best_device,
    check_recorded,
    choose_precision,
    sampled_fingerprint,
)
from reviewer.models.interfaces import Field, Image, ModelFailed, Said
from reviewer.models.labellers.alpha import AlphaBranch, alpha_of_mask
from reviewer.models.labellers.phrases import PROMPT, STOP_LIST, parse_label
from reviewer.models.weights.fetching import find_fetched
from reviewer.models.weights.hub import load_beside, load_pretrained
from reviewer.models.weights.presets import preset_of_name
from reviewer.words import Precision

INSTEAD = "use --labeller vocabulary:FILE.json, which needs no weights"
# CLIP's, in whose colours LLaVA's vision tower sees.
MEAN = np.array([0.48145466, 0.4578275, 0.40821073], np.float32)
STD = np.array([0.26862954, 0.26130258, 0.27577711], np.float32)
MARGIN = 0.5
LEAST_MARGIN_PX = 16


@dataclass
class LlavaLabeller:
    """Asks LLaVA about the change, cropped with some of its surroundings.

    Attributes:
        checkpoint: directory or hub id.
        prompt: the question; the paper's by default.
        per_component: ask about each component of M_o, largest first, not about the whole mask.
        most_components: most components that are asked about; a note is kept for the others.
        dilations, kernel_px: how often M_o is dilated before it is shown, and by which square.
        stop_list: labels that contain one of these are dropped.
        max_new_tokens: longest answer.
        precision: of the weights, "bfloat16" where the device is faster in it ("auto").
        weights: fingerprint; where given, the checkpoint must still hold those.
    """

    checkpoint: str = "llava-hf/llava-1.5-7b-hf"
    prompt: str = PROMPT
    per_component: bool = False
    most_components: int = 16
    dilations: int = 3
    kernel_px: int = 5
    stop_list: Sequence[str] = STOP_LIST
    max_new_tokens: int = 48
    precision: Precision = "auto"
    weights: str = ""

    def __post_init__(self) -> None:
        """Load the net; raises InvalidInput when it cannot be, or a setting makes no sense."""
        if self.dilations < 0 or self.kernel_px < 1:
            raise InvalidInput(
                "labeller llava: needs dilations >= 0 and kernel_px >= 1, not"
                f" {self.dilations} and {self.kernel_px}"
            )
        option = f"--labeller llava:{self.checkpoint}"
        self._device = best_device()
        self.precision = choose_precision(self.precision, self._device)
        self._net = load_pretrained(
            LlavaForConditionalGeneration,
            self.checkpoint,
            option,
            types={"llava"},
            instead=INSTEAD,
            dtype=getattr(torch, self.precision),
        )
        self._tokenizer: Any = load_beside(AutoTokenizer, self.checkpoint, option, INSTEAD)
        self._prepare()
        found = sampled_fingerprint(self._net)
        self.weights = check_recorded(f"labeller {self.checkpoint}", found, self.weights)
        self._net.to(self._device).eval()

    def _prepare(self) -> None:
        """Modifies the net before its weights are fingerprinted."""

    def name(self, live: Image, change: Mask, split: str) -> tuple[Said, ...]:
        """Return the answers about M_o; nothing for an empty mask."""
        del split
        if not change.any():
            return ()
        if not self.per_component:
            return (self._say(live, None, change),)
        _, parts = components(change)
        order = sorted(range(len(parts)), key=lambda k: (-parts[k].area, k))
        asked = set(order[: self.most_components])
        return tuple(
            self._say(live, k, _placed(part, change.shape))
            if k in asked
            else Said(k, "", "", f"not asked: smaller than {self.most_components} others")
            for k, part in enumerate(parts)
        )

    def _say(self, live: Image, component: int | None, mask: Mask) -> Said:
        shown: Mask = mask
        if self.dilations:
            kernel = np.ones((self.kernel_px, self.kernel_px), np.uint8)
            grown = cv2.dilate(mask.view(np.uint8), kernel, iterations=self.dilations)
            shown = np.asarray(grown, np.uint8).view(np.bool_)
        raw = self._answer(live, shown)
        label, note = parse_label(raw, self.stop_list)
        return Said(component, raw, label, note)

    def _answer(self, live: Image, shown: Mask) -> str:
        rows, columns = _around(shown)
        return self.ask(live[rows, columns], None)

    def ask(self, image: Image, mask: Mask | None) -> str:
        """Return the answer about a picture uint8 (H, W, 3), and a mask of it for the branch.

        Raises:
            ModelFailed: when the picture does not fit into the device's memory.
        """
        vision = self._net.config.vision_config
        side = int(vision.image_size)
        pixels = torch.from_numpy(prepare_picture(image, side)).to(self._device, self._net.dtype)
        given = self._tokens((side // int(vision.patch_size)) ** 2)
        try:
            with torch.inference_mode(), self._showing(mask, side):
                out = self._net.generate(
                    **given,
                    pixel_values=pixels,
                    do_sample=False,
                    max_new_tokens=self.max_new_tokens,
                )
        except torch.OutOfMemoryError as error:
            raise ModelFailed(
                f"labeller: the answer does not fit into the memory of {self._device}"
            ) from error
        new = out[0, given["input_ids"].shape[1] :]
        return str(self._tokenizer.decode(new, skip_special_tokens=True)).strip()

    def _showing(self, mask: Mask | None, side: int) -> Any:
        del mask, side
        return nullcontext()

    def _tokens(self, patches: int) -> dict[str, torch.Tensor]:
        """Return the question around as many image tokens as the tower has patches."""
        config = self._net.config
        count = patches + (config.vision_feature_select_strategy == "full")
        marker = self._tokenizer.convert_ids_to_tokens(config.image_token_index)
        # A question that holds the marker would ask for a second picture.
        question = self.prompt.replace(marker, " ")
        text = f"USER: {marker * count}\n{question} ASSISTANT:"
        tokens = self._tokenizer(text, return_tensors="pt").to(self._device)
        return {"input_ids": tokens["input_ids"], "attention_mask": tokens["attention_mask"]}


@dataclass
class LlavaAlphaLabeller(LlavaLabeller):
    """Asks LLaVA about the whole picture, with the change as Alpha-CLIP's fourth channel.

    Attributes:
        alpha: checkpoint of Alpha-CLIP's vision tower, as its authors publish it (CLIP-L/14@336);
            by default the one that was fetched.
    """

    alpha: str = ""

    def _prepare(self) -> None:
        fetched = find_fetched(preset_of_name("alpha-clip"))
        if not self.alpha and fetched is None:
            raise InvalidInput(
                "labeller llava-alpha: needs Alpha-CLIP's weights; `reviewer models fetch"
                " alpha-clip` brings them, or name yours, --labeller llava-alpha:FILE.pth"
            )
        self.alpha = self.alpha or str(fetched)
        self._branch = AlphaBranch(self._net.model.vision_tower)
        self._branch.load(Path(self.alpha), f"--labeller llava-alpha:{self.alpha}")

    def _answer(self, live: Image, shown: Mask) -> str:
        return self.ask(live, shown)

    def _showing(self, mask: Mask | None, side: int) -> Any:
        whole = np.ones((side, side), np.bool_)
        return self._branch.showing(
            alpha_of_mask(whole if mask is None else prepare_mask(mask, side))
        )


def prepare_picture(image: Image, side: int) -> Field:
    """Return a picture as LLaVA's tower sees it, float32 (1, 3, side, side).

    Padded to a square in CLIP's mean colour, resized bicubically, normalised.
    """
    square = _padded(image, tuple(int(value) for value in MEAN * 255))
    small = PillowImage.fromarray(square).resize((side, side), PillowImage.Resampling.BICUBIC)
    normal = (np.asarray(small, np.float32) / 255 - MEAN) / STD
    return np.ascontiguousarray(normal.transpose(2, 0, 1)[None])


def prepare_mask(mask: Mask, side: int) -> Mask:
    """Return a mask after the picture's pad and resize, bool (side, side); the pad is outside."""
    square = _padded(mask.astype(np.uint8) * 255, (0,))
    small = PillowImage.fromarray(square).resize((side, side), PillowImage.Resampling.BICUBIC)
    found: Mask = np.asarray(small) > 127
    return found


def _padded(array: Image, colour: tuple[int, ...]) -> Image:
    height, width = array.shape[:2]
    longer = max(height, width)
    square = np.empty((longer, longer, *array.shape[2:]), np.uint8)
    square[:] = colour if array.ndim == 3 else colour[0]
    y, x = (longer - height) // 2, (longer - width) // 2
    square[y : y + height, x : x + width] = array
    return square


def _around(mask: Mask) -> tuple[slice, slice]:
    """Return the window of a mask with half its size around it."""
    crop = crop_to_box(mask)
    assert crop is not None, "an empty mask is not asked about"
    x0, y0, x1, y1 = crop.box_xyxy
    margin = max(LEAST_MARGIN_PX, round(MARGIN * max(x1 - x0, y1 - y0)))
    height, width = mask.shape
    rows = slice(max(0, y0 - margin), min(height, y1 + margin))
    return rows, slice(max(0, x0 - margin), min(width, x1 + margin))


def _placed(part: Crop, shape: tuple[int, ...]) -> Mask:
    mask = np.zeros(shape, np.bool_)
    part.window(mask)[...] = part.pixels
    return mask
