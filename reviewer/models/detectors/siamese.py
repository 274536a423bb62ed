"""`siamese-lite`: the small change net that comes with the package."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from reviewer.masks import Mask
from reviewer.models.device import check_weights
from reviewer.models.interfaces import Field, Image, ModelFailed
from reviewer.models.nets.pictures import pad_to_multiple
from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import load_small, small_weights

NAME = "siamese-lite"
LEAST_SIDE = 64


@dataclass
class SiameseLiteDetector:
    """Change by the small Siamese net; on a processor, a second for 640x480.

    Attributes:
        checkpoint: weights, a safetensors file; "" = those of the package.
        weights: fingerprint; where given, the file must still hold those.
    """

    checkpoint: str = ""
    weights: str = ""

    def __post_init__(self) -> None:
        """Load the weights; raises as `load_small`."""
        self._net = SiameseLite()
        path = small_weights(NAME, self.checkpoint)
        load_small(path, self._net, NAME)
        self.weights = check_weights(str(path), self._net, self.weights)

    def detect(self, warped: Image, live: Image, valid: Mask) -> Field:
        """Return the probability of change, float32 (H, W); 0 outside `valid`."""
        return self.detect_confident(warped, live, valid, valid.astype(np.float32))

    def detect_confident(self, warped: Image, live: Image, valid: Mask, confidence: Field) -> Field:
        """Return the probability of change, with the confidence of the alignment.

        Raises:
            ModelFailed: when a side is shorter than 64 pixels.
        """
        height, width = live.shape[:2]
        if min(height, width) < LEAST_SIDE:
            raise ModelFailed(f"{NAME}: needs {LEAST_SIDE} pixels a side, not {width}x{height}")
        sure = torch.from_numpy(np.where(valid, confidence, 0).astype(np.float32))[None, None]
        inputs = [_tensor(live), _tensor(warped), sure]
        padded = [pad_to_multiple(each, self._net.multiple) for each in inputs]
        with torch.inference_mode():
            logits = self._net(*padded)[0, :height, :width]
        probability = torch.sigmoid(logits).numpy()
        return np.where(valid, probability, 0).astype(np.float32)


def _tensor(picture: Image) -> torch.Tensor:
    planes = torch.from_numpy(picture.astype(np.float32)).permute(2, 0, 1)[None]
    return planes.contiguous(memory_format=torch.channels_last)
