"""Correlation of two feature maps over a window of displacements (FlowNet's layer), in plain torch.

    out[(j + r) * (2r + 1) + (i + r)][y, x] = mean_c a[c, y, x] * b[c, y + s*j, x + s*i]

with r = max_displacement / s, j and i from -r to r, zero outside b. Displacements are multiples of
the stride s, so pixels meet only pixels of their own residue mod s: the maps are cut into s x s
phases, in each of which the window is dense. There, in each row, a block of neighbours meets in one
matrix product the patch of all that any of them can meet, and a band of the product is the result.
That does about twice the arithmetic of the definition at many times its speed, and holds besides
the result little more than the maps.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn import functional

BLOCK = 16
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
            for sample, block, across in _places(part):
                patches = _patches(strips[sample, block], side)
                products = torch.bmm(queries[sample, block], patches)
                band = _band(products, side)
                part[sample, ..., across] = band[..., : across.stop - across.start]
        return volume.view(count, side * side, height, width)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor, None, None]:
        first, second = ctx.saved_tensors
        radius, stride = ctx.window
        count, channels, height, width = first.shape
        side = 2 * radius + 1
        gradient = gradient.view(count, side, side, height, width)
        to_first, to_second = torch.empty_like(first), torch.empty_like(second)
        for rows, columns in _phases(height, width, stride):
            queries = _blocks(first[:, :, rows, columns])
            strips = _strips(second[:, :, rows, columns], radius)
            to_queries, to_strips = torch.empty_like(queries), torch.zeros_like(strips)
            part = gradient[:, :, :, rows, columns]
            height_here, width_here = part.shape[-2:]
            products = first.new_zeros(height_here, BLOCK, side * (BLOCK + side - 1))
            for sample, block, across in _places(part):
                band = _band(products, side)
                band[..., : across.stop - across.start] = part[sample, ..., across]
                band[..., across.stop - across.start :] = 0
                patches = _patches(strips[sample, block], side)
                torch.bmm(products, patches.transpose(1, 2), out=to_queries[sample, block])
                to_patches = torch.bmm(queries[sample, block].transpose(1, 2), products)
                to_rows = to_patches.view(height_here, channels, side, -1).transpose(0, 1)
                for shift in range(side):
                    below = slice(shift, shift + height_here)
                    to_strips[sample, block, :, below] += to_rows[:, :, shift]
            to_first[:, :, rows, columns] = _from_blocks(to_queries, width_here)
            to_second[:, :, rows, columns] = _from_strips(to_strips, radius, width_here)
        return to_first.div_(channels), to_second.div_(channels), None, None


def _phases(height: int, width: int, stride: int) -> list[tuple[slice, slice]]:
    return [
        (slice(y, None, stride), slice(x, None, stride))
        for y in range(min(stride, height))
        for x in range(min(stride, width))
    ]


def _places(part: Tensor) -> Iterator[tuple[int, int, slice]]:
    """Yield (sample, block, columns of the block) of a phase of the volume."""
    width = part.shape[-1]
    for sample in range(len(part)):
        for block, start in enumerate(range(0, width, BLOCK)):
            yield sample, block, slice(start, min(start + BLOCK, width))


def _blocks(image: Tensor) -> Tensor:
    """(N, C, H, W) -> (N, ceil(W / BLOCK), H, BLOCK, C), rows padded with zeros."""
    padded = functional.pad(image, (0, -image.shape[-1] % BLOCK))
    blocks = padded.view(*padded.shape[:3], -1, BLOCK)
    return blocks.permute(0, 3, 2, 4, 1).contiguous()


def _from_blocks(blocks: Tensor, width: int) -> Tensor:
    return blocks.permute(0, 4, 2, 1, 3).flatten(3)[..., :width]


def _strips(image: Tensor, radius: int) -> Tensor:
    """(N, C, H, W) -> (N, blocks, C, H + 2r, BLOCK + 2r): what a block of columns can meet."""
    right = radius + -image.shape[-1] % BLOCK
    padded = functional.pad(image, (radius, right, radius, radius))
    return padded.unfold(3, BLOCK + 2 * radius, BLOCK).permute(0, 3, 1, 2, 4).contiguous()


def _from_strips(strips: Tensor, radius: int, width: int) -> Tensor:
    """Add strips up where they overlap, and cut the padding off."""
    count, blocks, channels, height, _ = strips.shape
    rows = strips.new_zeros(count, channels, height, blocks * BLOCK + 2 * radius)
    for block in range(blocks):
        start = block * BLOCK
        rows[..., start : start + BLOCK + 2 * radius] += strips[:, block]
    return rows[:, :, radius : height - radius, radius : radius + width]


def _patches(strip: Tensor, side: int) -> Tensor:
    """View a strip (C, H + 2r, K) as (H, C, side * K): the rows that each row can meet, no copy."""
    channels, height, width = strip.shape
    shape = (height - side + 1, channels, side * width)
    return strip.as_strided(shape, (width, height * width, 1), strip.storage_offset())


def _band(products: Tensor, side: int) -> Tensor:
    """View (H, BLOCK, side * K) as (side, side, H, BLOCK): neighbour k meets columns k + i."""
    row, neighbour, column = products.stride()
    reach = BLOCK + side - 1
    shape = (side, side, len(products), BLOCK)
    return products.as_strided(shape, (reach * column, column, row, neighbour + column))
