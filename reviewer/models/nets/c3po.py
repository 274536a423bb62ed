"""C-3PO: change detection as semantic segmentation (Wang, Gao, Wang, Pattern Recognition 2023).

One ResNet-18 sees both pictures. At each of its stages their features are merged by what they share
and by what appeared, disappeared or was exchanged (MTF); the merged ones are fused from coarse to
fine (MSF), and DeepLabV3's head reads the sum. Nets trained for "id" know nothing that appears: for
them the order of the two pictures matters.

Parameter names and arithmetic are those of the public code (DoctorKey/C-3PO, with torchvision's
DeepLabHead).
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from reviewer.models.nets.channels import scaled
from reviewer.models.nets.resnet import ResNetLayers
from reviewer.words import Merging

RATES = (12, 24, 36)
"""Dilations of the head's pyramid."""


class C3po(nn.Module):
    """Two pictures to two logits per pixel; the second logit stands for change."""

    multiple = 32

    def __init__(self, width: float = 1.0, *, merging: Merging = "iade") -> None:
        """Build the net with random weights.

        Args:
            width: factor on all channels; 1 is the paper's net on ResNet-18.
            merging: "iade" merges all there is; "id" only what is shared and what disappeared.
        """
        super().__init__()
        channels = scaled(width, 64, 128, 256, 512)
        fused, inner = scaled(width, 512, 256)
        self.backbone = _Backbone(channels, fused, merging)
        self.classifier = nn.Sequential(
            _Pyramid(fused, inner),
            nn.Conv2d(inner, inner, 3, padding=1, bias=False),
            nn.BatchNorm2d(inner),
            nn.ReLU(),
            nn.Conv2d(inner, 2, 1),
        )

    def forward(self, pictures: Tensor) -> Tensor:
        """Return logits (N, 2, H, W) of pictures (N, 6, H, W), reference then live."""
        logits = self.classifier(self.backbone(pictures))
        return functional.interpolate(logits, pictures.shape[-2:], mode="bilinear")


class _Backbone(nn.Module):
    def __init__(self, channels: Sequence[int], fused: int, merging: Merging) -> None:
        super().__init__()
        self.encoder = ResNetLayers(channels)
        self.combinefeature = _Fusion(channels, fused, merging)

    def forward(self, pictures: Tensor) -> Tensor:
        past, present = (self.encoder(picture) for picture in torch.split(pictures, 3, dim=1))
        fused: Tensor = self.combinefeature(past, present)
        return fused


class _Merge(nn.Module):
    """Merges the features of two times (MTF)."""

    def __init__(self, channels: int, merging: Merging) -> None:
        super().__init__()
        self.merging = merging
        self.conv = nn.Conv2d(channels, channels, 3, padding=1, bias=False)
        self.res = nn.Conv2d(channels, channels, 3, padding=1, bias=False)
        # The public files of "id" hold it too, though nothing reads it.
        self.exchange = nn.Conv2d(channels, channels, 3, padding=1, bias=False)

    def forward(self, past: Tensor, present: Tensor) -> Tensor:
        shared = self.conv(past + present)
        gone = self.res(torch.relu(past - present))
        if self.merging == "id":
            return torch.relu(shared + 2 * gone)
        new = self.res(torch.relu(present - past))
        exchanged = self.exchange(torch.maximum(past, present) - torch.minimum(past, present))
        return torch.relu(shared + gone + new + exchanged)


class _Fusion(nn.Module):
    """Merges each stage, and sums the stages from coarse to fine (MSF)."""

    def __init__(self, channels: Sequence[int], fused: int, merging: Merging) -> None:
        super().__init__()
        self.cfs = nn.ModuleList([_Merge(number, merging) for number in channels])
        self.cf_inners = nn.ModuleList(
            [nn.Sequential(nn.Conv2d(number, fused, 1), nn.ReLU()) for number in channels]
        )
        self.cf_layers = nn.ModuleList(
            [nn.Sequential(nn.Conv2d(fused, fused, 3, padding=1), nn.ReLU()) for _ in channels]
        )
        self.reduce = nn.Conv2d(len(channels) * fused, fused, 3, padding=1, bias=False)
        self.bn = nn.BatchNorm2d(fused)

    def forward(self, past: Sequence[Tensor], present: Sequence[Tensor]) -> Tensor:
        merged = [merge(a, b) for merge, a, b in zip(self.cfs, past, present, strict=True)]
        size = merged[0].shape[-2:]
        levels: list[Tensor] = []
        above: Tensor | None = None
        for stage in reversed(range(len(merged))):
            inner = self.cf_inners[stage](merged[stage])
            if above is not None:
                inner = inner + functional.interpolate(above, inner.shape[-2:], mode="nearest")
            above = inner
            levels.append(self.cf_layers[stage](inner))
        same = [functional.interpolate(level, size, mode="bilinear") for level in levels]
        return torch.relu(self.bn(self.reduce(torch.cat(same, 1))))


class _Pyramid(nn.Module):
    """Atrous spatial pyramid pooling."""

    def __init__(self, before: int, after: int) -> None:
        super().__init__()
        self.convs = nn.ModuleList(
            [
                _norm_relu(nn.Conv2d(before, after, 1, bias=False)),
                *(
                    _norm_relu(nn.Conv2d(before, after, 3, padding=r, dilation=r, bias=False))
                    for r in RATES
                ),
                _Pooled(
                    nn.AdaptiveAvgPool2d(1), *_norm_relu(nn.Conv2d(before, after, 1, bias=False))
                ),
            ]
        )
        joined = nn.Conv2d((2 + len(RATES)) * after, after, 1, bias=False)
        self.project = nn.Sequential(*_norm_relu(joined), nn.Dropout(0.5))

    def forward(self, x: Tensor) -> Tensor:
        projected: Tensor = self.project(torch.cat([conv(x) for conv in self.convs], 1))
        return projected


class _Pooled(nn.Sequential):
    """One place that stands for the whole map, spread out over it."""

    def forward(self, x: Tensor) -> Tensor:
        one = x
        for part in self:
            one = part(one)
        return functional.interpolate(one, x.shape[-2:], mode="bilinear")


def _norm_relu(conv: nn.Conv2d) -> nn.Sequential:
    return nn.Sequential(conv, nn.BatchNorm2d(conv.out_channels), nn.ReLU())
