"""TANet and DR-TANet: change detection by temporal attention (Chen, Yang, Stiefelhagen, IV 2021).

Two ResNet-18 encoders; at each of four stages the live picture asks and a window of the reference
answers (`temporal_attention`); the answers go down through strided convolutions and up through a
light decoder. TANet has one window size at every stage; DR-TANet has 7, 5, 3, 1 and looks along the
row and the column as well. The order of the two pictures matters.

Parameter names and arithmetic are those of the public code (Herrccc/DR-TANet). There a block
returns its sum before and after a ReLU that works in place, so both are one tensor: what the
attention sees lies behind the ReLU.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from reviewer.models.nets.channels import scaled
from reviewer.models.nets.resnet import BasicBlock
from reviewer.models.nets.temporal_attention import TemporalAttention
from reviewer.words import Relu

DYNAMIC = (7, 5, 3, 1)


class TaNet(nn.Module):
    """Two pictures to two logits per pixel; the second logit stands for change."""

    multiple = 32
    keeps_to_its_size = False

    def __init__(
        self,
        width: float = 1.0,
        *,
        windows: Sequence[int] = (3, 3, 3, 3),
        refinement: bool = False,
        relu: Relu = "block",
        groups: int = 4,
    ) -> None:
        """Build the net with random weights.

        Args:
            width: factor on all channels; 1 is the paper's net.
            windows: side of the attention window at each stage, odd.
            refinement: attend to a column and a row as well.
            relu: "block" is the public net, with a ReLU after every block. "stage" is what early
                versions of this program computed: one ReLU between two stages, and the attention
                sees what lies before it. Weights fitted to one make no sense to the other.
        """
        super().__init__()
        channels = scaled(width, 64, 128, 256, 512)
        self.encoder1 = _Encoder(channels, relu)
        self.encoder2 = _Encoder(channels, relu)
        # Both start alike, as they do from a backbone file: comparing needs one language.
        self.encoder2.load_state_dict(self.encoder1.state_dict())
        self.attention_module = _Attention(channels, windows, refinement, groups)
        self.decoder = _Decoder(channels)
        self.classifier = nn.Conv2d(channels[0], 2, 1)
        self.bn = nn.BatchNorm2d(channels[0])

    def forward(self, pictures: Tensor) -> Tensor:
        """Return logits (N, 2, H, W) of pictures (N, 6, H, W), reference then live."""
        past, present = torch.split(pictures, 3, dim=1)
        answers = self.attention_module(self.encoder1(past), self.encoder2(present))
        x = self.bn(_resize(self.decoder(answers), 2))
        logits: Tensor = self.classifier(torch.relu(_resize(x, 2)))
        return logits


class _Encoder(nn.Module):
    """ResNet-18 without its head; returns the features of its four stages."""

    def __init__(self, channels: Sequence[int], relu: Relu) -> None:
        super().__init__()
        self.relu = relu
        self.conv1 = nn.Conv2d(3, channels[0], 7, stride=2, padding=3, bias=False)
        self.bn1 = nn.BatchNorm2d(channels[0])
        before = channels[0]
        for stage, after in enumerate(channels, start=1):
            blocks = [
                BasicBlock(before, after, 1 if stage == 1 else 2, relu),
                BasicBlock(after, after, 1, relu),
            ]
            self.add_module(f"layer{stage}", nn.Sequential(*blocks))
            before = after
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")

    def forward(self, image: Tensor) -> list[Tensor]:
        x = torch.relu(self.bn1(self.conv1(image)))
        x = functional.max_pool2d(x, 3, stride=2, padding=1)
        features = []
        for stage in range(1, 5):
            x = self.get_submodule(f"layer{stage}")(x)
            features.append(x)
            if self.relu == "stage":
                x = torch.relu(x)
        return features


class _Attention(nn.Module):
    def __init__(
        self, channels: Sequence[int], windows: Sequence[int], refinement: bool, groups: int
    ) -> None:
        super().__init__()
        for stage, (number, side) in enumerate(zip(channels, windows, strict=True), start=1):
            layer = TemporalAttention(number, side, groups=groups, refinement=refinement)
            self.add_module(f"attention_layer{stage}", layer)
        c1, c2, c3, c4 = channels
        self.downsample1 = nn.Conv2d(c1, c2, 3, stride=2, padding=1, bias=False)
        self.downsample2 = nn.Conv2d(2 * c2, c3, 3, stride=2, padding=1, bias=False)
        self.downsample3 = nn.Conv2d(2 * c3, c4, 3, stride=2, padding=1, bias=False)

    def forward(self, past: Sequence[Tensor], present: Sequence[Tensor]) -> list[Tensor]:
        """Return what the decoder needs, coarse to fine."""
        answers = [
            self.get_submodule(f"attention_layer{k + 1}")(past[k], present[k]) for k in range(4)
        ]
        x = torch.cat([self.downsample1(answers[0]), answers[1]], 1)
        x = torch.cat([self.downsample2(x), answers[2]], 1)
        x = torch.cat([self.downsample3(x), answers[3]], 1)
        return [x, *reversed(answers)]


class _Decoder(nn.Module):
    def __init__(self, channels: Sequence[int]) -> None:
        super().__init__()
        for step, number in enumerate(reversed(channels), start=1):
            self.add_module(f"upsample{step}", _UpStep(2 * number, number))

    def forward(self, features: Sequence[Tensor]) -> Tensor:
        x = features[0]
        for step in range(1, 5):
            x = self.get_submodule(f"upsample{step}")(x, features[step])
        return x


class _UpStep(nn.Module):
    def __init__(self, before: int, after: int) -> None:
        super().__init__()
        self.bottleneck = _NormReluConv(after, before, 1)
        self.blend_conv = _NormReluConv(before, after, 3)

    def forward(self, x: Tensor, skip: Tensor) -> Tensor:
        skip = self.bottleneck(skip)
        larger = functional.interpolate(x, skip.shape[-2:], mode="bilinear", align_corners=False)
        blended: Tensor = self.blend_conv(larger + skip)
        return blended


class _NormReluConv(nn.Module):
    def __init__(self, before: int, after: int, side: int) -> None:
        super().__init__()
        self.norm = nn.BatchNorm2d(before)
        self.conv = nn.Conv2d(before, after, side, padding=side // 2, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        y: Tensor = self.conv(torch.relu(self.norm(x)))
        return y


def _resize(x: Tensor, factor: int) -> Tensor:
    return functional.interpolate(x, scale_factor=factor, mode="bilinear", align_corners=False)
