"""Show a large picture to a net in overlapping windows of the size it was trained on.

Nets that enlarge their maps with aligned corners (CSCDNet) tie what they learn to one size: the
corners of the maps stay in place, so what lies between them shifts with the size of the picture,
and deep features of a larger picture land beside the place they speak of. Windows keep the size;
half of each overlaps the next, and its middle counts more than its rim.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn import functional


def through_windows(look: Callable[[Tensor], Tensor], pictures: Tensor, side: int) -> Tensor:
    """Return the output of `look` for pictures (N, C, H, W), averaged over windows: (N, H, W).

    Args:
        look: values (M, side, side) of windows (M, C, side, side).
    """
    height, width = pictures.shape[-2:]
    margins = (0, max(0, side - width), 0, max(0, side - height))
    padded = functional.pad(pictures.float(), margins, mode="replicate").to(pictures.dtype)
    rows, columns = (_starts(length, side) for length in padded.shape[-2:])
    ramp = torch.hann_window(side + 2, periodic=False, device=pictures.device)[1:-1]
    weight = ramp[:, None] * ramp[None, :] + 1e-3
    total = torch.zeros(len(padded), *padded.shape[-2:], device=pictures.device)
    weights = torch.zeros(padded.shape[-2:], device=pictures.device)
    for y in rows:
        for x in columns:
            here = (slice(y, y + side), slice(x, x + side))
            total[:, *here] += look(padded[:, :, *here]) * weight
            weights[here] += weight
    return (total / weights)[:, :height, :width]


def _starts(length: int, side: int) -> list[int]:
    """Return where windows begin: evenly, the first and the last at the ends."""
    count = 1 + -(-(length - side) // max(1, side // 2))
    return [round(k * (length - side) / max(1, count - 1)) for k in range(count)]
