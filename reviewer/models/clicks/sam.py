"""Click segmenters SAM and SAM 2, with the networks of `transformers`.

Loads a local directory or a hub id. Preprocessing is done here, so neither torchvision nor the
processors of `transformers` are needed: SAM scales the longest side and pads, SAM 2 squashes to a
square. The encoder runs in bfloat16 where the device is faster in it; the small decoder always in
float32. Called by the registry for `--click sam:PATH` and `--click sam2:PATH`.

Sources: Kirillov et al., Segment Anything (ICCV 2023); Ravi et al., SAM 2 (2024).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import torch
import torch.nn.functional as F
from transformers import Sam2Model, SamModel

from reviewer.errors import InvalidInput
from reviewer.masks import Mask
from reviewer.models.device import best_device, choose_precision, fingerprint
from reviewer.models.interfaces import Candidate, Embedding, Field, Image, Prompt
from reviewer.models.weights.hub import load_pretrained
from reviewer.words import Precision, SamFamily

Floats = npt.NDArray[np.float32]
Masks = npt.NDArray[np.bool_]
CLASSES: dict[SamFamily, Any] = {"sam": SamModel, "sam2": Sam2Model}
# The published SAM 2.1 checkpoints call themselves "sam2_video"; they hold the image model too.
MODEL_TYPES: dict[SamFamily, set[str]] = {"sam": {"sam"}, "sam2": {"sam2", "sam2_video"}}
DEFAULT_SAM = "sam2:facebook/sam2.1-hiera-small"
INSTEAD = "name a directory or a hub id, or use --click grabcut, which needs no weights"
MEAN = torch.tensor([0.485, 0.456, 0.406]).view(1, 3, 1, 1)
STD = torch.tensor([0.229, 0.224, 0.225]).view(1, 3, 1, 1)
# How sure a mask given as a prompt is, as logits: as transformers' SAM 2 for videos maps masks.
PROMPT_LOGIT = 10.0


def sam_of_text(text: str, option: str, instead: str, precision: Precision = "auto") -> SamClicks:
    """Return the model that "sam:PATH" or "sam2:PATH" names; PATH is a directory or a hub id.

    Raises:
        InvalidInput: when it is neither, or cannot be loaded.
    """
    name, _, path = text.partition(":")
    kind: SamFamily | None = next((known for known in CLASSES if known == name), None)
    if kind is None or not path:
        raise InvalidInput(f"{option}: must be sam:PATH or sam2:PATH, not {text!r}")
    return SamClicks.load(kind, path, option, instead, precision)


class SamClicks:
    """SAM or SAM 2 behind the click protocol; not thread-safe: one worker a device calls it."""

    def __init__(
        self, kind: SamFamily, model: Any, name: str, precision: Precision = "auto"
    ) -> None:
        """Wrap a loaded model; `name` is where it came from, `precision` is the encoder's."""
        self.kind = kind
        self.device = best_device()
        self.precision = choose_precision(precision, self.device)
        self.model = model.eval().to(self.device)
        prompts = model.config.prompt_encoder_config
        self.side = int(prompts.image_size)
        self.mask_side = 4 * (self.side // int(prompts.patch_size))
        self._id = f"{kind}-{Path(name).name}-{fingerprint(model)}-{self.precision}"

    @classmethod
    def load(
        cls,
        kind: SamFamily,
        name: str,
        option: str = "",
        instead: str = INSTEAD,
        precision: Precision = "auto",
    ) -> SamClicks:
        """Load a checkpoint from a local directory or by its hub id.

        Args:
            option, instead: see `load_pretrained`; by default those of `--click`.

        Raises:
            InvalidInput: when there is none, it is of another kind, or weights are missing.
        """
        option = option or f"--click {kind}:{name}"
        types = MODEL_TYPES[kind]
        model = load_pretrained(CLASSES[kind], name, option, types=types, instead=instead)
        return cls(kind, model, name, precision)

    @property
    def model_id(self) -> str:
        """Kind, name, a hash of the weights, and the precision embeddings are made in."""
        return self._id

    @property
    def keeps_embeddings(self) -> bool:
        """Encoding takes seconds without a GPU."""
        return True

    def embed(
        self,
        image: Image,
        other: Image | None,
        confidence: Field | None = None,
        change: Field | None = None,
    ) -> Embedding:
        """Return the encoder's feature maps; nothing but the image is used."""
        del other, confidence, change
        with torch.inference_mode(), self._fast():
            found = self.model.get_image_embeddings(self._pixels(image).to(self.device))
        maps = found if self.kind == "sam2" else [found]
        embedding = {f"map{k}": m.float().contiguous().cpu().numpy() for k, m in enumerate(maps)}
        return {"size": np.asarray(image.shape[:2], np.float32), **embedding}

    def predict(self, embedding: Embedding, prompt: Prompt) -> list[Candidate]:
        """Return the masks of the decoder, best first by its predicted IoU."""
        height, width = (int(v) for v in embedding["size"])
        several = len(prompt.clicks) <= 1 and prompt.previous is None
        given = self._prompts(prompt, height, width)
        logits, scores = self._decode(embedding, given, several=several)
        masks = (logits[0] > 0).cpu().numpy()
        order = np.argsort(-scores[0], kind="stable")
        return [Candidate(np.ascontiguousarray(masks[k]), float(scores[0, k])) for k in order]

    def predict_boxes(self, embedding: Embedding, boxes_xyxy: Floats) -> tuple[Masks, Floats]:
        """Return one mask per box, bool (N, H, W), and its predicted IoU, float32 (N,)."""
        height, width = (int(v) for v in embedding["size"])
        corners = torch.from_numpy(boxes_xyxy.astype(np.float32)).view(-1, 2, 2)
        boxes = (corners * self._scale(height, width)).view(1, -1, 4).to(self.device)
        logits, scores = self._decode(embedding, {"input_boxes": boxes}, several=False)
        return (logits[:, 0] > 0).cpu().numpy(), scores[:, 0]

    def predict_points(self, embedding: Embedding, points: Floats) -> tuple[torch.Tensor, Floats]:
        """Return the candidates of single clicks (N, 2): logits float32 (N, K, H, W), predicted IoU
        float32 (N, K)."""
        height, width = (int(v) for v in embedding["size"])
        placed = torch.from_numpy(points.astype(np.float32)) * self._scale(height, width)
        given = {
            "input_points": placed[None, :, None].to(self.device),
            "input_labels": torch.ones((1, len(points), 1), dtype=torch.int64, device=self.device),
        }
        return self._decode(embedding, given, several=True)

    def _decode(
        self, embedding: Embedding, given: dict[str, torch.Tensor], *, several: bool
    ) -> tuple[torch.Tensor, Floats]:
        """Return logits (prompts, candidates, H, W) and predicted IoU (prompts, candidates)."""
        height, width = (int(v) for v in embedding["size"])
        count = len(embedding) - 1
        maps = [torch.from_numpy(embedding[f"map{k}"]).to(self.device) for k in range(count)]
        with torch.inference_mode():
            output = self.model(
                image_embeddings=maps if self.kind == "sam2" else maps[0],
                multimask_output=several,
                **given,
            )
            logits = self._full_size(output.pred_masks[0].float(), height, width)
            scores = output.iou_scores[0].float().clamp(0, 1).cpu().numpy()
        return logits, np.asarray(scores, np.float32)

    def _prompts(self, prompt: Prompt, height: int, width: int) -> dict[str, torch.Tensor]:
        """Return the prompts in the network's frame (SamProcessor: no half pixel is added)."""
        scale = self._scale(height, width)
        given: dict[str, torch.Tensor] = {}
        if prompt.clicks:
            points = torch.tensor([[c.x, c.y] for c in prompt.clicks], dtype=torch.float32)
            labels = torch.tensor([int(c.positive) for c in prompt.clicks], dtype=torch.int64)
            given["input_points"], given["input_labels"] = (
                (points * scale)[None, None],
                labels[None, None],
            )
        if prompt.box_xyxy is not None:
            corners = torch.tensor(prompt.box_xyxy, dtype=torch.float32).view(2, 2)
            given["input_boxes"] = (corners * scale).view(1, 1, 4)
        if prompt.previous is not None and prompt.previous.any():
            given["input_masks"] = self._mask_prompt(prompt.previous)
        return {name: tensor.to(self.device) for name, tensor in given.items()}

    def _scale(self, height: int, width: int) -> torch.Tensor:
        """Return the factors on x and y from the image to the network's frame."""
        rows, columns = self._inner(height, width, self.side)
        return torch.tensor([columns / width, rows / height])

    def _inner(self, height: int, width: int, side: int) -> tuple[int, int]:
        """Return the size of the picture inside the network's square frame."""
        if self.kind == "sam2":
            return side, side
        scale = side / max(height, width)
        return int(height * scale + 0.5), int(width * scale + 0.5)

    def _pixels(self, image: Image) -> torch.Tensor:
        rows, columns = self._inner(image.shape[0], image.shape[1], self.side)
        # A copy: images that were read from disk may not be writable, which torch does not like.
        pixels = torch.from_numpy(np.array(image)).permute(2, 0, 1)[None]
        pixels = F.interpolate(pixels, (rows, columns), mode="bilinear", antialias=True)
        # SAM pads what is normalised already, with zeros.
        return F.pad(
            (pixels.float() / 255 - MEAN) / STD, (0, self.side - columns, 0, self.side - rows)
        )

    def _mask_prompt(self, mask: Mask) -> torch.Tensor:
        rows, columns = self._inner(mask.shape[0], mask.shape[1], self.mask_side)
        small = cv2.resize(mask.astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA)
        logits = (2 * torch.from_numpy(np.asarray(small, np.float32)) - 1) * PROMPT_LOGIT
        return F.pad(logits[None, None], (0, self.mask_side - columns, 0, self.mask_side - rows))

    def _full_size(self, masks: torch.Tensor, height: int, width: int) -> torch.Tensor:
        if self.kind == "sam":
            rows, columns = self._inner(height, width, self.side)
            masks = F.interpolate(masks, (self.side, self.side), mode="bilinear")
            masks = masks[..., :rows, :columns]
        return F.interpolate(masks, (height, width), mode="bilinear")

    def _fast(self) -> Any:
        return torch.autocast(self.device, torch.bfloat16, enabled=self.precision == "bfloat16")
