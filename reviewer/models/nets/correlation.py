"""Correlation of two feature maps over a window of displacements (FlowNet's layer), in plain torch.

    out[(j + r) * (2r + 1) + (i + r)][y, x] = mean_c a[c, y, x] * b[c, y + s*j, x + s*i]

with r = max_displacement / s, j and i from -r to r, zero outside b. Displacements are multiples of
the stride s, so pixels meet only pixels of their own residue mod s: the maps are cut into s x s
phases, in each of which the window is dense. There, a block of neighbours in a row meets a strip of
candidates in one matrix product, of which the band is kept. That does about twice the arithmetic of
the definition at many times its speed, and never holds more than one row of the window besides the
result.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn import functional

BLOCK = 20
"""Neighbours in a matrix product: wider wastes arithmetic, narrower wastes the product."""


def correlate(
    first: Tensor, second: Tensor, *, max_displacement: int = 20, stride: int = 2
) -> Tensor:
    """Return the correlation volume (N, (2r + 1)^2, H, W) of two maps (N, C, H, W).

    The vertical displacement is the slow index of the channels. Works in float32 or float64;
    narrower types are widened and the result narrowed again.

    Raises:
        ValueError: when shapes differ or the stride does not divide the displacement.
    """
    if first.shape != second.shape:
        raise ValueError(f"correlate: maps differ, {tuple(first.shape)} and {tuple(second.shape)}")
    if max_displacement % stride:
        raise ValueError(f"correlate: stride {stride} does not divide {max_displacement}")
    wide = torch.promote_types(first.dtype, torch.float32)
    with torch.autocast(first.device.type, enabled=False):
        volume: Tensor = _Correlation.apply(  # type: ignore[no-untyped-call]
            first.to(wide), second.to(wide), max_displacement // stride, stride
        )
    return volume.to(first.dtype)


class _Correlation(torch.autograd.Function):
    """Keeps only the two maps for the way back; autograd would keep every product."""

    @staticmethod
    def forward(ctx: Any, first: Tensor, second: Tensor, radius: int, stride: int) -> Tensor:
        ctx.save_for_backward(first, second)
        ctx.window = radius, stride
        count, channels, height, width = first.shape
        side = 2 * radius + 1
        volume = first.new_empty(count, side, side, height, width)
        for rows, columns in _phases(height, width, stride):
            queries = _blocks(first[:, :, rows, columns]).mul_(1 / channels)
            strips = _strips(second[:, :, rows, columns], radius)
            part = volume[:, :, :, rows, columns]
            height_here, width_here = part.shape[-2:]
            for shift in range(side):
                products = queries @ strips[:, shift : shift + height_here]
                band = _band(products, side).flatten(2, 3)[:, :, :width_here]
                part[:, shift] = band.permute(0, 3, 1, 2)
        return volume.view(count, side * side, height, width)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor, None, None]:
        first, second = ctx.saved_tensors
        radius, stride = ctx.window
        count, channels, height, width = first.shape
        side = 2 * radius + 1
        gradient = gradient.view(count, side, side, height, width)
        to_first, to_second = torch.zeros_like(first), torch.zeros_like(second)
        for rows, columns in _phases(height, width, stride):
            queries = _blocks(first[:, :, rows, columns])
            strips = _strips(second[:, :, rows, columns], radius)
            query_sum, strip_sum = torch.zeros_like(queries), torch.zeros_like(strips)
            part = gradient[:, :, :, rows, columns]
            height_here, width_here = part.shape[-2:]
            spread = queries.new_zeros(*queries.shape[:3], BLOCK, BLOCK + side - 1)
            for shift in range(side):
                row = part[:, shift].permute(0, 2, 3, 1)
                padded = functional.pad(row, (0, 0, 0, -width_here % BLOCK))
                _band(spread, side).copy_(padded.reshape(*queries.shape[:4], side))
                below = slice(shift, shift + height_here)
                query_sum += spread @ strips[:, below].transpose(-1, -2)
                strip_sum[:, below] += queries.transpose(-1, -2) @ spread
            to_first[:, :, rows, columns] = _from_blocks(query_sum, width_here)
            to_second[:, :, rows, columns] = _from_strips(strip_sum, radius, width_here)
        return to_first.div_(channels), to_second.div_(channels), None, None


def _phases(height: int, width: int, stride: int) -> list[tuple[slice, slice]]:
    return [
        (slice(y, None, stride), slice(x, None, stride))
        for y in range(min(stride, height))
        for x in range(min(stride, width))
    ]


def _blocks(image: Tensor) -> Tensor:
    """(N, C, H, W) -> (N, H, ceil(W / BLOCK), BLOCK, C), rows padded with zeros."""
    padded = functional.pad(image, (0, -image.shape[-1] % BLOCK))
    blocks = padded.view(*padded.shape[:3], -1, BLOCK)
    return blocks.permute(0, 2, 3, 4, 1).contiguous()


def _from_blocks(blocks: Tensor, width: int) -> Tensor:
    return blocks.flatten(2, 3)[:, :, :width].permute(0, 3, 1, 2)


def _strips(image: Tensor, radius: int) -> Tensor:
    """(N, C, H, W) -> (N, H + 2r, blocks, C, BLOCK + 2r): what each block of a row can meet."""
    right = radius - image.shape[-1] % -BLOCK
    padded = functional.pad(image, (radius, right, radius, radius))
    return padded.unfold(3, BLOCK + 2 * radius, BLOCK).permute(0, 2, 3, 1, 4).contiguous()


def _from_strips(strips: Tensor, radius: int, width: int) -> Tensor:
    """Add strips up where they overlap, and cut the padding off."""
    count, height, blocks, channels, _ = strips.shape
    row = strips.new_zeros(count, channels, height, blocks * BLOCK + 2 * radius)
    for block in range(blocks):
        start = block * BLOCK
        row[..., start : start + BLOCK + 2 * radius] += strips[:, :, block].transpose(1, 2)
    return row[:, :, radius : height - radius, radius : radius + width]


def _band(products: Tensor, side: int) -> Tensor:
    """View (.., BLOCK, BLOCK + side - 1) as (.., BLOCK, side): entry (k, i) is column k + i."""
    outer, (row, column) = products.stride()[:-2], products.stride()[-2:]
    shape = (*products.shape[:-1], side)
    return products.as_strided(shape, (*outer, row + column, column), products.storage_offset())
