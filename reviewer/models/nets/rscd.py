"""RSCD: robust scene change detection by attention (Lin, Garg, Chin, Dayoub, ICRA 2025).

A frozen DINOv2, or a ResNet-18, sees both pictures; an attention block of each answers, and two
convolutions read the answers side by side. Parameter names and arithmetic are those of the public
code (ChadLin9596/Robust-Scene-Change-Detection). There keys and values cross twice on their way
into the blocks, so that each picture attends to itself, whatever the paper's figure shows; the
published weights were fitted to that. The logits end in a ReLU.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from reviewer.models.nets.channels import scaled
from reviewer.models.nets.resnet import ResNetLayers
from reviewer.models.nets.vision_transformer import PATCH, QueryEncoder


class RscdDino(nn.Module):
    """Two pictures to two logits per pixel, seen by DINOv2; the second stands for change."""

    multiple = PATCH

    def __init__(
        self,
        width: float = 1.0,
        *,
        depth: int = 12,
        side: int = 37,
        attention_blocks: int = 1,
        attention_heads: int = 1,
    ) -> None:
        """Build the net with random weights.

        Args:
            width: factor on the channels of ViT-S/14, in steps of one head of 64.
            depth: blocks of the transformer, the one whose queries are taken included.
            side: patches along a side of the pictures that DINOv2 was trained on.
            attention_blocks: how many follow each other.
            attention_heads: of each of these.
        """
        super().__init__()
        heads = max(1, round(6 * width))
        channels = 64 * heads
        self.backbone = QueryEncoder(channels, heads, depth, side)
        self.ca0s = nn.ModuleList(
            [_Pair(channels, attention_heads) for _ in range(attention_blocks)]
        )
        self.conv1 = nn.Conv2d(2 * channels, channels, 3, padding=1)
        self.conv2 = nn.Conv2d(channels, 2, 1)

    def forward(self, pictures: Tensor) -> Tensor:
        """Return logits (N, 2, H, W) of pictures (N, 6, H, W), reference then live."""
        past, present = (self.backbone(picture) for picture in torch.split(pictures, 3, dim=1))
        for pair in self.ca0s:
            past, present = pair(past, present)
        return _decode(self.conv1, self.conv2, past, present, pictures)


class RscdResNet(nn.Module):
    """The same, seen by a ResNet-18 that was trained along."""

    multiple = 32

    def __init__(self, width: float = 1.0, *, stage: int = 2, attention_heads: int = 1) -> None:
        """Build the net with random weights.

        Args:
            width: factor on all channels.
            stage: of the ResNet, 1 to 4, whose features are compared.
            attention_heads: of the attention blocks.
        """
        super().__init__()
        numbers = scaled(width, 64, 128, 256, 512)
        channels = numbers[stage - 1]
        self.stage = stage
        self.backbone = ResNetLayers(numbers)
        self.ca = _Pair(channels, attention_heads)
        self.conv1 = nn.Conv2d(2 * channels, channels, 3, padding=1)
        self.conv2 = nn.Conv2d(channels, 2, 1)

    def forward(self, pictures: Tensor) -> Tensor:
        """Return logits (N, 2, H, W) of pictures (N, 6, H, W), reference then live."""
        past, present = (
            self.backbone(picture, self.stage)[-1] for picture in torch.split(pictures, 3, dim=1)
        )
        past, present = self.ca(past, present)
        return _decode(self.conv1, self.conv2, past, present, pictures)


class _Pair(nn.Module):
    """An attention block for each picture."""

    def __init__(self, channels: int, heads: int) -> None:
        super().__init__()
        self.cross_att_1 = _Attention(channels, heads)
        self.cross_att_2 = _Attention(channels, heads)

    def forward(self, past: Tensor, present: Tensor) -> tuple[Tensor, Tensor]:
        return self.cross_att_1(past), self.cross_att_2(present)


class _Attention(nn.Module):
    """A post-norm transformer block over all places of a map (N, C, h, w)."""

    def __init__(self, channels: int, heads: int) -> None:
        super().__init__()
        self.multi_head_self_attention = nn.MultiheadAttention(channels, heads, batch_first=True)
        self.layer_norm1 = nn.LayerNorm(channels)
        self.layer_norm2 = nn.LayerNorm(channels)
        # The dropouts keep the public numbering; they do nothing to a net that is not trained.
        self.feed_forward = nn.Sequential(
            nn.Linear(channels, 4 * channels),
            nn.ReLU(),
            nn.Dropout(0.1),
            nn.Linear(4 * channels, channels),
            nn.Dropout(0.1),
        )

    def forward(self, x: Tensor) -> Tensor:
        places = x.flatten(2).transpose(1, 2)
        answer, _ = self.multi_head_self_attention(places, places, places, need_weights=False)
        places = self.layer_norm1(answer + places)
        places = self.layer_norm2(places + self.feed_forward(places))
        answered: Tensor = places.transpose(1, 2).reshape(x.shape)
        return answered


def _decode(
    conv1: nn.Conv2d, conv2: nn.Conv2d, past: Tensor, present: Tensor, pictures: Tensor
) -> Tensor:
    x = torch.relu(conv1(torch.cat([past, present], 1)))
    return functional.interpolate(torch.relu(conv2(x)), pictures.shape[-2:], mode="bilinear")
