"""CSCDNet: a correlated siamese change detection net (Sakurada et al., ICRA 2020), and CDNet.

Two encoders with weights of their own, each a ResNet-18 and two more convolutions; a decoder that
sees both encoders' features at every level and, in CSCDNet, how they correlate at half and at an
eighth of the size. CDNet is the same without correlation. With `attention`, a mask damps the
features of one level of both encoders (see `attention_mask`).

Parameter names are those of the public checkpoints (kensakurada/sscdnet).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from reviewer.models.nets.attention_mask import AttentionMask
from reviewer.models.nets.channels import scaled
from reviewer.models.nets.correlation import correlate

WINDOW = 21 * 21
"""Channels of a correlation volume: displacements of -20 .. 20 pixels in steps of 2."""


class CscdNet(nn.Module):
    """Two pictures to two logits per pixel; the second logit stands for change."""

    multiple = 64
    keeps_to_its_size = True
    """Aligned corners tie what it learns to the size of the pictures it learns from."""

    def __init__(
        self,
        width: float = 1.0,
        *,
        correlation: bool = True,
        attention: AttentionMask | None = None,
    ) -> None:
        """Build the net with random weights.

        Args:
            width: factor on all channels but those of the correlation; 1 is the paper's net.
        """
        super().__init__()
        self.correlation, self.attention = correlation, attention
        c1, c3, c4, c5, c6 = scaled(width, 64, 128, 256, 512, 1024)
        for encoder in ("enc1", "enc2"):
            self._add_encoder(encoder, (c1, c3, c4, c5, c6))
        seen = WINDOW if correlation else 0
        self.dec_conv6 = nn.Conv2d(2 * c6, c6, 3, padding=1)
        self.dec_bn6 = nn.BatchNorm2d(c6)
        self.dec_conv5 = nn.Conv2d(c6, c5, 3, padding=1)
        self.dec_bn5 = nn.BatchNorm2d(c5)
        self.dec_res4_2 = _Block(c5, c5, c5, skip2=2 * c5)
        self.dec_res4_1 = _Block(c5, c5, c4, up=True)
        self.dec_res3_2 = _Block(c4, c4, c4, skip2=2 * c4)
        self.dec_res3_1 = _Block(c4, c4, c3, up=True)
        self.dec_res2_2 = _Block(c3, c3, c3, skip1=2 * c3 + seen)
        self.dec_res2_1 = _Block(c3, c3, c1, up=True)
        self.dec_res1_2 = _Block(c1, c1, c1, skip2=2 * c1)
        self.dec_res1_1 = _Block(c1, c1, c1)
        self.dec_conv1 = nn.Conv2d(3 * c1 + seen, c1, 7, padding=3, bias=False)
        self.dec_bn1 = nn.BatchNorm2d(c1)
        self.classifier = nn.Conv2d(c1, 2, 1)
        _xavier(self)
        _start_alike(self)

    def forward(self, pictures: Tensor) -> Tensor:
        """Return logits (N, 2, H, W) of pictures (N, 6, H, W), reference then live."""
        past, present = torch.split(pictures, 3, dim=1)
        a = self._encode("enc1", past)
        b = self._encode("enc2", present)
        x = torch.relu(self.dec_bn6(self.dec_conv6(torch.cat([a[5], b[5]], 1))))
        x = torch.relu(self.dec_bn5(_up(self.dec_conv5(x))))
        x = self.dec_res4_1(self.dec_res4_2(x, skip2=torch.cat([a[4], b[4]], 1)))
        x = self.dec_res3_1(self.dec_res3_2(x, skip2=torch.cat([a[3], b[3]], 1)))
        x = self.dec_res2_1(self.dec_res2_2(x, skip1=self._compared(a[2], b[2])))
        x = self.dec_res1_1(self.dec_res1_2(x, skip2=torch.cat([a[1], b[1]], 1)))
        x = self.dec_conv1(torch.cat([_up(x), self._compared(a[0], b[0])], 1))
        logits: Tensor = self.classifier(torch.relu(self.dec_bn1(_up(x))))
        return logits

    def _compared(self, past: Tensor, present: Tensor) -> Tensor:
        if not self.correlation:
            return torch.cat([past, present], 1)
        alike = functional.leaky_relu(correlate(past, present), 0.1)
        return torch.cat([past, present, alike], 1)

    def _encode(self, name: str, image: Tensor) -> list[Tensor]:
        """Return features f1 .. f6 at 1/2, 1/4, .. 1/64 of the size."""
        part = self._modules

        def go(x: Tensor, *names: str) -> Tensor:
            for each in names:
                layer = part[f"{name}_{each}"]
                assert layer is not None
                x = layer(x)
            return x

        x = torch.relu(go(image, "conv1", "bn1"))
        levels = [x]
        x = functional.max_pool2d(x, 3, stride=2, padding=1)
        for stage in range(1, 5):
            x = go(x, f"res{stage}_1", f"res{stage}_2")
            if self.attention is not None and self.attention.level == stage + 1:
                x = self.attention(x, image)
            levels.append(x)
        x = torch.relu(go(x, "conv5", "bn5"))
        levels.append(torch.relu(go(x, "conv6", "bn6")))
        return levels

    def _add_encoder(self, name: str, channels: tuple[int, ...]) -> None:
        c1, c3, c4, c5, c6 = channels
        layers = {
            "conv1": nn.Conv2d(3, c1, 7, stride=2, padding=3, bias=False),
            "bn1": nn.BatchNorm2d(c1),
            "conv5": nn.Conv2d(c5, c6, 3, stride=2, padding=1),
            "bn5": nn.BatchNorm2d(c6),
            "conv6": nn.Conv2d(c6, c6, 3, padding=1),
            "bn6": nn.BatchNorm2d(c6),
        }
        before = c1
        for stage, after in enumerate((c1, c3, c4, c5), start=1):
            layers[f"res{stage}_1"] = _Block(before, after, after, stride=1 if stage == 1 else 2)
            layers[f"res{stage}_2"] = _Block(after, after, after)
            before = after
        for key, layer in layers.items():
            self.add_module(f"{name}_{key}", layer)


class _Block(nn.Module):
    """Residual block whose convolutions may see more than the shortcut: skip1 and skip2."""

    def __init__(
        self,
        before: int,
        inside: int,
        after: int,
        *,
        stride: int = 1,
        up: bool = False,
        skip1: int = 0,
        skip2: int = 0,
    ) -> None:
        super().__init__()
        self.up = up
        self.conv1 = nn.Conv2d(before + skip1, inside, 3, stride=stride, padding=1, bias=False)
        self.bn1 = nn.BatchNorm2d(inside)
        self.conv2 = nn.Conv2d(inside + skip2, after, 3, padding=1, bias=False)
        self.bn2 = nn.BatchNorm2d(after)
        self.downsample: nn.Sequential | None = None
        if before != after or stride > 1 or up:
            straight = nn.Conv2d(before, after, 1, stride=stride, bias=False)
            # The public net enlarges between the two, which moves the norm to place 2.
            between = [nn.Upsample(scale_factor=2, mode="bilinear", align_corners=True)]
            self.downsample = nn.Sequential(
                straight, *(between if up else []), nn.BatchNorm2d(after)
            )

    def forward(
        self, x: Tensor, skip1: Tensor | None = None, skip2: Tensor | None = None
    ) -> Tensor:
        y = x if skip1 is None else torch.cat([x, skip1], 1)
        y = torch.relu(self.bn1(self.conv1(y)))
        y = self.conv2(y if skip2 is None else torch.cat([y, skip2], 1))
        y = self.bn2(_up(y) if self.up else y)
        return torch.relu(y + (x if self.downsample is None else self.downsample(x)))


def _up(x: Tensor) -> Tensor:
    return functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)


def _start_alike(net: nn.Module) -> None:
    """Give both encoders the same weights, as a backbone file does: they need one language."""
    own = net.state_dict()
    with torch.no_grad():
        for name, value in own.items():
            if name.startswith("enc1_"):
                own[name.replace("enc1_", "enc2_")].copy_(value)


def _xavier(net: nn.Module) -> None:
    for module in net.modules():
        if isinstance(module, nn.Conv2d):
            nn.init.xavier_uniform_(module.weight, nn.init.calculate_gain("relu"))
            if module.bias is not None:
                nn.init.zeros_(module.bias)
