"""From pictures to what a net takes, and back to probabilities: presets, padding, polarity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn import functional

from reviewer.words import Preprocessing

_MEAN = (0.485, 0.456, 0.406)
_DEVIATION = (0.229, 0.224, 0.225)


def stack_pair(
    reference: npt.NDArray[np.uint8], live: npt.NDArray[np.uint8]
) -> npt.NDArray[np.uint8]:
    """Return two RGB pictures (H, W, 3) as uint8 (6, H, W), reference first."""
    return np.ascontiguousarray(np.concatenate([reference, live], axis=2).transpose(2, 0, 1))


def prepare(pictures: Tensor, preprocessing: Preprocessing) -> Tensor:
    """Return float32 net input of uint8 RGB pictures (N, 6, H, W).

    `bgr_128`: BGR, x / 128 - 1, as sscdnet and DR-TANet do; `imagenet`: RGB by ImageNet's mean and
    deviation; `unit`: RGB, x / 255.
    """
    if preprocessing == "bgr_128":
        order = [2, 1, 0, 5, 4, 3]
        return pictures[:, order].float().div_(128).sub_(1)
    if preprocessing == "unit":
        return pictures.float().div_(255)
    mean = torch.tensor(_MEAN * 2, device=pictures.device)[:, None, None]
    deviation = torch.tensor(_DEVIATION * 2, device=pictures.device)[:, None, None]
    return pictures.float().div_(255).sub_(mean).div_(deviation)


def pad_to_multiple(pictures: Tensor, multiple: int) -> Tensor:
    """Repeat the last rows and columns until both sides are multiples; crop the output back."""
    height, width = pictures.shape[-2:]
    margins = (0, -width % multiple, 0, -height % multiple)
    return functional.pad(pictures, margins, mode="replicate") if any(margins) else pictures


def squeezed(look: Callable[[Tensor], Tensor], pictures: Tensor, side: int) -> Tensor:
    """Return the output of `look` for uint8 pictures (N, C, H, W) squeezed to a square, as wide and
    high as these: (N, H, W)."""
    small = functional.interpolate(pictures.float(), (side, side), mode="bilinear", antialias=True)
    seen = look(small.round().clamp(0, 255).to(pictures.dtype))
    size = pictures.shape[-2:]
    return functional.interpolate(seen[:, None], size, mode="bilinear")[:, 0]


def change_probability(logits: Tensor, changed_class: int) -> Tensor:
    """Return the probability of change, float32 (N, H, W), of logits (N, 2, H, W)."""
    return torch.softmax(logits.float(), dim=1)[:, changed_class]
