"""Temporal attention: every live place asks a window of the reference around it (DR-TANet).

q is made of the live features, k and v of the reference's, zero-padded. The first half of the
channels of k carries a learnt offset by row of the window, the second half one by column. The
weights are a softmax over the window of q.k, summed inside each group of channels and not scaled.
Refinement adds a column and a row of 2 * side + 1 places, with the same k and v and no offsets.

Nothing of size (window x channels x H x W) is kept: the window is walked place by place.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional


class TemporalAttention(nn.Module):
    """Features of both times (N, C, H, W) to what the live places learn from the reference."""

    def __init__(self, channels: int, side: int, *, groups: int, refinement: bool) -> None:
        super().__init__()
        self.side, self.groups, self.refinement = side, groups, refinement
        self.w_q = nn.Conv2d(channels, channels, 1, bias=False)
        self.w_k = nn.Conv2d(channels, channels, 1, bias=False)
        self.w_v = nn.Conv2d(channels, channels, 1, bias=False)
        self.rel_h = nn.Parameter(torch.randn(channels // 2, 1, 1, side, 1))
        self.rel_w = nn.Parameter(torch.randn(channels // 2, 1, 1, 1, side))
        for layer in (self.w_q, self.w_k, self.w_v):
            nn.init.kaiming_normal_(layer.weight, mode="fan_out", nonlinearity="relu")

    def forward(self, past: Tensor, present: Tensor) -> Tensor:
        """Return (N, C, H, W)."""
        query = self.w_q(present)
        # A 1x1 convolution without bias keeps the zeros of a padding: pad after it, and once.
        key, value = self.w_k(past), self.w_v(past)
        reach = self.side // 2
        window = range(-reach, reach + 1)
        places = [(dy, dx) for dy in window for dx in window]
        offsets = self._offsets(query.dtype)
        answer = self._attend(query, key, value, places, offsets)
        if self.refinement:
            line = range(-self.side, self.side + 1)
            answer = answer + self._attend(query, key, value, [(0, d) for d in line], None)
            answer = answer + self._attend(query, key, value, [(d, 0) for d in line], None)
        return answer

    def _offsets(self, dtype: torch.dtype) -> Tensor:
        """Return what position adds to k: (places, C, 1, 1)."""
        rows = self.rel_h.flatten(1).repeat_interleave(self.side, dim=1)
        columns = self.rel_w.flatten(1).repeat(1, self.side)
        return torch.cat([rows, columns]).T[:, :, None, None].to(dtype)

    def _attend(
        self,
        query: Tensor,
        key: Tensor,
        value: Tensor,
        places: list[tuple[int, int]],
        offsets: Tensor | None,
    ) -> Tensor:
        if len(places) == 1 and offsets is not None:
            return value  # a softmax over one place is 1 whatever q and k say
        reach_y = max(abs(dy) for dy, _ in places)
        reach_x = max(abs(dx) for _, dx in places)
        margins = (reach_x, reach_x, reach_y, reach_y)
        key, value = functional.pad(key, margins), functional.pad(value, margins)
        height, width = query.shape[-2:]

        def shifted(image: Tensor, place: tuple[int, int]) -> Tensor:
            y, x = reach_y + place[0], reach_x + place[1]
            return image[..., y : y + height, x : x + width]

        def grouped(image: Tensor) -> Tensor:
            return image.reshape(len(image), self.groups, -1, height, width)

        likeness = []
        for number, place in enumerate(places):
            at = shifted(key, place)
            at = at if offsets is None else at + offsets[number]
            likeness.append(grouped(query * at).sum(2))
        weights = torch.softmax(torch.stack(likeness), dim=0)
        answer = torch.zeros_like(grouped(query))
        for number, place in enumerate(places):
            answer = answer + weights[number][:, :, None] * grouped(shifted(value, place))
        return answer.flatten(1, 2)
