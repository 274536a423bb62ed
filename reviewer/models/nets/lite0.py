"""EfficientNet-Lite0 as a pyramid of features: the blocks down to a sixteenth of the size.

Tan and Le, "EfficientNet", ICML 2019; the Lite form has no squeeze-and-excitation and ReLU6 in
place of swish. Keys are those of the public PyTorch port, so that its ImageNet weights load.
Padding is TensorFlow's "same": on an even map a stride of two pads more below and right.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

EPSILON = 1e-3
# kernel, stride, expansion, inputs, outputs of each block that is used
BLOCKS = (
    (3, 1, 1, 32, 16),
    (3, 2, 6, 16, 24), (3, 1, 6, 24, 24),
    (5, 2, 6, 24, 40), (5, 1, 6, 40, 40),
    (3, 2, 6, 40, 80), (3, 1, 6, 80, 80), (3, 1, 6, 80, 80),
    (5, 1, 6, 80, 112), (5, 1, 6, 112, 112), (5, 1, 6, 112, 112),
)  # fmt: skip
LEVELS = (0, 2, 4, 10)
"""The blocks after which a level is taken: 1/2, 1/4, 1/8 and 1/16 of the size."""
LEVEL_CHANNELS = tuple(BLOCKS[k][4] for k in LEVELS)


class SameConv(nn.Conv2d):
    """A convolution without bias, padded as TensorFlow does."""

    def __init__(
        self, inputs: int, outputs: int, kernel: int, stride: int = 1, groups: int = 1
    ) -> None:
        super().__init__(inputs, outputs, kernel, stride=stride, groups=groups, bias=False)

    def forward(self, x: Tensor) -> Tensor:
        """Return a map of ceil(size / stride)."""
        kernel, stride = self.kernel_size[0], self.stride[0]
        margins = []
        for size in (x.shape[-1], x.shape[-2]):
            wanted = max((-(-size // stride) - 1) * stride + kernel - size, 0)
            margins += [wanted // 2, wanted - wanted // 2]
        if margins[0] == margins[1] == margins[2] == margins[3]:
            return functional.conv2d(
                x, self.weight, None, self.stride, margins[0], groups=self.groups
            )
        return functional.conv2d(
            functional.pad(x, margins), self.weight, None, self.stride, groups=self.groups
        )


class Block(nn.Module):
    """Inverted bottleneck: widen, look around channel by channel, narrow."""

    def __init__(self, kernel: int, stride: int, expansion: int, inputs: int, outputs: int) -> None:
        super().__init__()
        wide = inputs * expansion
        if expansion != 1:
            self._expand_conv = SameConv(inputs, wide, 1)
            self._bn0 = nn.BatchNorm2d(wide, eps=EPSILON)
        self._depthwise_conv = SameConv(wide, wide, kernel, stride, groups=wide)
        self._bn1 = nn.BatchNorm2d(wide, eps=EPSILON)
        self._project_conv = SameConv(wide, outputs, 1)
        self._bn2 = nn.BatchNorm2d(outputs, eps=EPSILON)
        self.widens = expansion != 1
        self.adds = stride == 1 and inputs == outputs

    def forward(self, x: Tensor) -> Tensor:
        """Return the block's map."""
        y = functional.relu6(self._bn0(self._expand_conv(x))) if self.widens else x
        y = functional.relu6(self._bn1(self._depthwise_conv(y)))
        y = self._bn2(self._project_conv(y))
        result: Tensor = y + x if self.adds else y
        return result


class Lite0Features(nn.Module):
    """Features of RGB pictures; input float32 (N, 3, H, W) in [0, 255]."""

    def __init__(self) -> None:
        super().__init__()
        self._conv_stem = SameConv(3, 32, 3, 2)
        self._bn0 = nn.BatchNorm2d(32, eps=EPSILON)
        self._blocks = nn.ModuleList(Block(*shape) for shape in BLOCKS)

    def forward(self, pictures: Tensor) -> list[Tensor]:
        """Return maps of 16, 24, 40 and 112 channels at 1/2, 1/4, 1/8 and 1/16 of the size."""
        x = (pictures - 127) / 128
        x = functional.relu6(self._bn0(self._conv_stem(x)))
        levels = []
        for number, block in enumerate(self._blocks):
            x = block(x)
            if number in LEVELS:
                levels.append(x)
        return levels

    def load_public(self, state: dict[str, Tensor]) -> None:
        """Take the weights of the public port; its deeper blocks and its head are left out."""
        own = self.state_dict()
        self.load_state_dict({key: torch.as_tensor(state[key]) for key in own})
