"""A small change-aware click net: residual U-Net on a window, with a guess of its own IoU.

It sees the window of the clicked picture, the same window of the other time, their difference, how
sure the alignment is there, the clicks as discs, the mask so far and what a change detector says.
Discs are drawn after zooming, so that a click is as large beside a screw as beside a chair. Mask
and clicks as input follow RITM (Sofiiuk et al., 2022).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

SIDE = 96
"""Pixels a side of the window that the net sees."""
CHANNELS = 14
WIDTHS = (16, 32, 64, 96, 96)
SHAPE_FEATURES = 4


class Residual(nn.Module):
    """Two 3x3 convolutions beside a straight way."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(inputs, outputs, 3, padding=1, bias=False)
        self.first_norm = nn.BatchNorm2d(outputs)
        self.second = nn.Conv2d(outputs, outputs, 3, padding=1, bias=False)
        self.second_norm = nn.BatchNorm2d(outputs)
        self.straight = nn.Conv2d(inputs, outputs, 1) if inputs != outputs else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        """Return a map of the same size."""
        y = functional.relu(self.first_norm(self.first(x)))
        return functional.relu(self.second_norm(self.second(y)) + self.straight(x))


class ClickNet(nn.Module):
    """Mask logits and the guessed IoU of a window.

    `forward` takes float32 (N, 14, 96, 96): picture RGB, other RGB, three times the absolute
    difference RGB (all of pictures in [0, 1]), confidence, discs of positive and of negative
    clicks, mask so far, probability of change; see `clicks.windows.look`. It returns logits
    (N, 96, 96) and the guessed IoU's logits (N,).
    """

    def __init__(self, widths: tuple[int, ...] = WIDTHS) -> None:
        super().__init__()
        ins = (CHANNELS, *widths[:-1])
        self.down = nn.ModuleList(Residual(a, b) for a, b in zip(ins, widths, strict=True))
        pairs = list(zip(widths[:0:-1], widths[-2::-1], strict=True))
        self.up = nn.ModuleList(Residual(a + b, b) for a, b in pairs)
        self.mask = nn.Conv2d(widths[0], 1, 1)
        features = widths[-1] + 2 * widths[0] + SHAPE_FEATURES
        self.rating = nn.Sequential(nn.Linear(features, 64), nn.ReLU(), nn.Linear(64, 1))

    def forward(self, windows: Tensor) -> tuple[Tensor, Tensor]:
        """Return mask logits and IoU logits."""
        x, kept = windows, []
        for level, block in enumerate(self.down):
            if level:
                x = functional.max_pool2d(x, 2)
            x = block(x)
            kept.append(x)
        deepest = x
        for block, beside in zip(self.up, kept[-2::-1], strict=True):
            wide = functional.interpolate(x, scale_factor=2, mode="bilinear")
            x = block(torch.cat([wide, beside], dim=1))
        logits = self.mask(x)[:, 0]
        return logits, self._rate(deepest, x, logits)

    def _rate(self, deepest: Tensor, finest: Tensor, logits: Tensor) -> Tensor:
        """Guess the IoU from what is inside the mask and what is around it."""
        inside = torch.sigmoid(logits.detach()).unsqueeze(1)
        parts = [deepest.mean(dim=(2, 3)), _shape(inside[:, 0])]
        for share in (inside, inside * (1 - inside)):
            total = share.sum(dim=(2, 3)) + 1e-3
            parts.append((finest * share).sum(dim=(2, 3)) / total)
        rated: Tensor = self.rating(torch.cat(parts, dim=1))
        return rated[:, 0]


def _shape(inside: Tensor) -> Tensor:
    """Return what the mask (N, 96, 96) itself tells: its size, how sure it is, whether it is cut.

    A mask that fills its window or hangs over its border was looked at too closely; one of a few
    pixels from too far away.
    """
    area = inside.mean(dim=(1, 2))
    doubt = (inside * (1 - inside)).sum(dim=(1, 2)) / (inside.sum(dim=(1, 2)) + 1)
    rim = torch.cat([inside[:, 0], inside[:, -1], inside[:, :, 0], inside[:, :, -1]], dim=1)
    return torch.stack([area.sqrt(), torch.log(area + 1e-4) / 9, 4 * doubt, rim.mean(dim=1)], 1)
