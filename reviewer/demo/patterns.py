"""What the renderer prepares or averages: sample patterns, surface numbers, texel density."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]

DITHER = 4
"""Side of the block of pixels that share one set of shadow samples."""


def ones(count: int) -> Floats:
    """Return the ray lengths that stop just before the light."""
    return np.full(count, 0.999, np.float32)


def stratified(seed: int) -> npt.NDArray[np.float64]:
    """Return 16 points in [-1, 1]^2, one in each cell of a 4x4 grid, in an order that dithers."""
    rng = np.random.default_rng(seed)
    cell = rng.permutation(DITHER * DITHER)
    jitter = rng.uniform(0, 1, (DITHER * DITHER, 2))
    grid = np.stack([cell % DITHER, cell // DITHER], axis=1)
    return (grid + jitter) / DITHER * 2 - 1


def hemisphere() -> Floats:
    """Return 16 cosine-weighted directions about +z."""
    points = (stratified(99) + 1) / 2
    radius, angle = np.sqrt(points[:, 0]), 2 * np.pi * points[:, 1]
    z = np.sqrt(np.maximum(1 - points[:, 0], 0))
    table = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    return table.astype(np.float32)


def texel_density(corners: Floats, uv: Floats) -> Floats:
    """Return texels of level 0 per metre on each triangle."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    world = np.linalg.norm(np.cross(a, b), axis=1)
    p, q = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    texture = np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
    density: Floats = 256 * np.sqrt(texture / np.maximum(world, 1e-12))
    return density.astype(np.float32)


def surface_numbers(corners: Floats, object_number: Ints, material: Ints) -> Ints:
    """Number the smooth faces: triangles of one object, material and rough direction share one."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    offset = np.einsum("ij,ij->i", normal, corners.mean(axis=1))
    bins = np.round(normal * 2).astype(np.int64)
    key = (object_number * 4096 + material) * 125 + (bins @ [25, 5, 1] + 62)
    flat = np.abs(normal).max(axis=1) > 0.999
    key = key * 4001 + np.where(flat, np.round(offset * 100).astype(np.int64) % 4001, 0)
    _, numbers = np.unique(key, return_inverse=True)
    return numbers.astype(np.int32).ravel()


def average_inside(planes: Floats, surface: Ints) -> Floats:
    """Average (C, H, W) over 4x4 pixels, only over those that show the same surface."""
    height, width = surface.shape
    total = np.zeros_like(planes)
    weight = np.zeros((height, width), np.float32)
    padded = np.pad(planes, ((0, 0), (2, 1), (2, 1)), mode="edge")
    numbers = np.pad(surface, ((2, 1), (2, 1)), constant_values=-2)
    for dy in range(DITHER):
        for dx in range(DITHER):
            same = (numbers[dy : dy + height, dx : dx + width] == surface).astype(np.float32)
            total += padded[:, dy : dy + height, dx : dx + width] * same
            weight += same
    averaged: Floats = total / weight
    return averaged
