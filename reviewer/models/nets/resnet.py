"""ResNet-18 as the public change detection codes cut it up, under torchvision's names."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from reviewer.words import Relu


class BasicBlock(nn.Module):
    """Basic residual block; with `relu` "stage" it has no last ReLU of its own (see `TaNet`)."""

    def __init__(self, before: int, after: int, stride: int, relu: Relu = "block") -> None:
        """Build the block with random weights; `stride` halves the size, or does not."""
        super().__init__()
        self.relu = relu
        self.conv1 = nn.Conv2d(before, after, 3, stride=stride, padding=1, bias=False)
        self.bn1 = nn.BatchNorm2d(after)
        self.conv2 = nn.Conv2d(after, after, 3, padding=1, bias=False)
        self.bn2 = nn.BatchNorm2d(after)
        self.downsample: nn.Sequential | None = None
        if stride != 1 or before != after:
            self.downsample = nn.Sequential(
                nn.Conv2d(before, after, 1, stride=stride, bias=False), nn.BatchNorm2d(after)
            )

    def forward(self, x: Tensor) -> Tensor:
        """Return features of `after` channels."""
        y = torch.relu(self.bn1(self.conv1(x)))
        y = self.bn2(self.conv2(y))
        summed: Tensor = y + (x if self.downsample is None else self.downsample(x))
        return torch.relu(summed) if self.relu == "block" else summed


class ResNetLayers(nn.Module):
    """ResNet-18 without its head as a list of five layers: the stem, then the four stages."""

    def __init__(self, channels: Sequence[int]) -> None:
        """Build it with random weights; `channels` are those of the four stages."""
        super().__init__()
        first = channels[0]
        stem = nn.Sequential(
            nn.Conv2d(3, first, 7, stride=2, padding=3, bias=False),
            nn.BatchNorm2d(first),
            nn.ReLU(),
            nn.MaxPool2d(3, stride=2, padding=1),
        )
        stages = [
            nn.Sequential(BasicBlock(before, after, stride), BasicBlock(after, after, 1))
            for before, after, stride in zip(
                (first, *channels), channels, (1, 2, 2, 2), strict=False
            )
        ]
        self.layers = nn.ModuleList([stem, *stages])
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")

    def forward(self, image: Tensor, stages: int = 4) -> list[Tensor]:
        """Return the features of the first stages, from a quarter to 1/32 of the size."""
        features = [image]
        for layer in self.layers[: 1 + stages]:
            features.append(layer(features[-1]))
        return features[2:]
