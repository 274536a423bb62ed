"""A small Siamese change net on ImageNet features, which asks whether a near match exists.

At four scales the features of the live picture are compared with those of the warped reference in
a window around the same place, in both directions: a change is what has no near match, as in
CSCDNet's correlation layer (Sakurada et al., 2020); a place that the alignment missed by some
pixels has one. At full size colours are compared the same way, each less its local mean, so that
light that changes slowly is no change.
"""

from __future__ import annotations

from functools import reduce

import torch
from torch import Tensor, nn
from torch.nn import functional

from reviewer.models.nets.lite0 import LEVEL_CHANNELS, Lite0Features

EMBEDDED = (8, 16, 24, 32)
REACH = (2, 3, 2, 2)
"""How far a match is searched at 1/2, 1/4, 1/8 and 1/16 of the size, in pixels of that size."""
STATISTICS = 4
DECODED = (16, 24, 32, 48)
FINE = 12
LIGHT_PX = 33
TOLERANCE_PX = 2


class Comparison(nn.Module):
    """Compares two feature maps: how well each place matches here, and anywhere near."""

    def __init__(self, inputs: int, embedded: int, reach: int, *, learns: bool) -> None:
        super().__init__()
        self.embed = nn.Conv2d(inputs, embedded, 1)
        self.reach, self.learns = reach, learns

    def forward(self, live: Tensor, past: Tensor) -> Tensor:
        """Return (N, 4 + 2 * embedded, H, W): similarities, the difference, the live features."""
        mine, theirs = self.embed(live), self.embed(past)
        a = functional.normalize(mine, dim=1)
        b = functional.normalize(theirs, dim=1)
        here = (a * b).sum(dim=1, keepdim=True)
        # Searching wide at a fine scale is too much to learn through: what matches here teaches it.
        with torch.set_grad_enabled(torch.is_grad_enabled() and self.learns):
            forth, back = self._best(a, b), self._best(b, a)
        strength = torch.log1p(mine.norm(dim=1, keepdim=True))
        return torch.cat([here, forth, back, strength, (mine - theirs).abs(), mine], dim=1)

    def _best(self, a: Tensor, b: Tensor) -> Tensor:
        """Return the greatest cosine of each place of `a` with the places of `b` around it."""
        reach = self.reach
        height, width = a.shape[-2:]
        wide = functional.pad(b, (reach,) * 4, mode="replicate")
        best = None
        for dy in range(2 * reach + 1):
            for dx in range(2 * reach + 1):
                cosine = (a * wide[..., dy : dy + height, dx : dx + width]).sum(1, keepdim=True)
                best = cosine if best is None else torch.maximum(best, cosine)
        assert best is not None
        return best


class Mixing(nn.Module):
    """Two 3x3 convolutions with batch norm."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Conv2d(inputs, outputs, 3, padding=1, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(inplace=True),
            nn.Conv2d(outputs, outputs, 3, padding=1, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(inplace=True),
        )

    def forward(self, x: Tensor) -> Tensor:
        """Return a map of the same size."""
        mixed: Tensor = self.layers(x)
        return mixed


class SiameseLite(nn.Module):
    """Change logits of a pair whose reference is warped to the live view.

    `forward` takes live and warped, float32 (N, 3, H, W) RGB in [0, 255], and the confidence of the
    alignment, float32 (N, 1, H, W) in [0, 1], 0 = not to be compared; H and W are multiples of 16.
    It returns logits (N, H, W) of change.
    """

    multiple = 16

    def __init__(self) -> None:
        super().__init__()
        self.features = Lite0Features()
        shapes = list(zip(LEVEL_CHANNELS, EMBEDDED, REACH, strict=True))
        self.compare = nn.ModuleList(
            Comparison(*shape, learns=level >= 2) for level, shape in enumerate(shapes)
        )
        sizes = [STATISTICS + 2 * embedded + 1 for embedded in EMBEDDED]
        above = [*DECODED[1:], 0]
        self.decode = nn.ModuleList(
            Mixing(size + more, width)
            for size, more, width in zip(sizes, above, DECODED, strict=True)
        )
        self.fine = Mixing(3 + 3 + 3 + 1 + DECODED[0], FINE)
        self.change = nn.Conv2d(FINE, 1, 1)

    def train(self, mode: bool = True) -> SiameseLite:
        """Train the comparison; the features' batch statistics stay ImageNet's."""
        super().train(mode)
        self.features.eval()
        return self

    def forward(self, live: Tensor, warped: Tensor, confidence: Tensor) -> Tensor:
        """Return the logits of change."""
        both = self.features(torch.cat([live, warped]))
        x: Tensor | None = None
        for level in reversed(range(len(both))):
            mine, theirs = both[level].chunk(2)
            sure = functional.interpolate(confidence, size=mine.shape[-2:], mode="area")
            parts = [self.compare[level](mine, theirs), sure]
            if x is not None:
                parts.append(functional.interpolate(x, scale_factor=2, mode="bilinear"))
            x = self.decode[level](torch.cat(parts, dim=1))
        assert x is not None
        wide = functional.interpolate(x, scale_factor=2, mode="bilinear")
        parts = [*_colours(live, warped), confidence, wide]
        logits: Tensor = self.change(self.fine(torch.cat(parts, dim=1)))
        return logits[:, 0]


@torch.no_grad()
def _colours(live: Tensor, warped: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return the live colours, and what of each picture's the other's near ones do not explain."""
    mine, theirs = _without_light(live / 255), _without_light(warped / 255)
    return live / 255 - 0.5, 3 * _beyond(mine, theirs), 3 * _beyond(theirs, mine)


def _without_light(picture: Tensor) -> Tensor:
    margin = LIGHT_PX // 2
    small = functional.avg_pool2d(picture, 4)
    size = margin // 4
    padded = functional.pad(small, (size,) * 4, mode="replicate")
    mean = functional.avg_pool2d(padded, 2 * size + 1, stride=1)
    return picture - functional.interpolate(mean, size=picture.shape[-2:], mode="bilinear")


def _beyond(first: Tensor, second: Tensor) -> Tensor:
    """Return how far each value lies outside the range of the other's values around it."""
    return functional.relu(first - _highest(second)) + functional.relu(-_highest(-second) - first)


def _highest(values: Tensor) -> Tensor:
    """Return the greatest value within the tolerance; shifted maxima cost a tenth of pooling."""
    height, width = values.shape[-2:]
    wide = functional.pad(values, (TOLERANCE_PX,) * 4, mode="replicate")
    steps = range(2 * TOLERANCE_PX + 1)
    across = reduce(torch.maximum, (wide[..., k : k + width] for k in steps))
    return reduce(torch.maximum, (across[..., k : k + height, :] for k in steps))
