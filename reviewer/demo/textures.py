"""Procedural textures of rooms: floors, walls, woods, cloths, metals.

Each is a square sRGB picture, uint8 (SIDE, SIDE, 3), made from a name and a seed, so the world is
the same on every machine.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

Picture = npt.NDArray[np.uint8]
Rng = np.random.Generator

SIDE = 256


def noise(rng: Rng, cells_x: int, cells_y: int | None = None) -> npt.NDArray[np.float32]:
    """Smooth noise in [-1, 1] that tiles, with the given number of cells along each side."""
    rows = cells_y or cells_x
    cells = rng.uniform(-1, 1, (rows, cells_x)).astype(np.float32)
    wrapped = np.pad(cells, 2, mode="wrap")
    scale_y, scale_x = SIDE // rows, SIDE // cells_x
    big = cv2.resize(
        wrapped,
        (wrapped.shape[1] * scale_x, wrapped.shape[0] * scale_y),
        interpolation=cv2.INTER_CUBIC,
    )
    part: npt.NDArray[np.float32] = big[
        2 * scale_y : 2 * scale_y + SIDE, 2 * scale_x : 2 * scale_x + SIDE
    ]
    return part


def fractal(rng: Rng, *cells: int) -> npt.NDArray[np.float32]:
    """Sum octaves of smooth noise, each half as strong as the one before."""
    total = np.zeros((SIDE, SIDE), np.float32)
    for octave, number in enumerate(cells):
        total += noise(rng, number) / 2**octave
    return total


def tint(colour: npt.ArrayLike, shade: npt.NDArray[np.floating]) -> Picture:
    """Multiply an sRGB colour (0..255) by 1 + shade."""
    return np.clip(np.asarray(colour, np.float32) * (1 + shade[..., None]), 0, 255).astype(np.uint8)


def tint_picture(picture: Picture, shade: npt.NDArray[np.floating]) -> Picture:
    """Multiply a picture by 1 + shade."""
    return np.clip(picture * (1 + shade[..., None]), 0, 255).astype(np.uint8)


def plain(rng: Rng) -> Picture:
    return tint((235, 235, 235), 0.008 * fractal(rng, 8, 32))


def plaster(rng: Rng) -> Picture:
    return tint((228, 225, 217), 0.012 * fractal(rng, 4, 16, 64) + 0.01 * noise(rng, 128))


def wallpaper(rng: Rng) -> Picture:
    weave = 0.02 * noise(rng, 128, 32) + 0.012 * fractal(rng, 4, 16)
    return tint((226, 219, 205), weave)


def concrete(rng: Rng) -> Picture:
    return tint((160, 158, 154), 0.07 * fractal(rng, 4, 16, 64, 128))


def _grain(rng: Rng, colour: npt.ArrayLike, strength: float) -> Picture:
    bend = 0.05 * noise(rng, 4)
    y = np.arange(SIDE, dtype=np.float32)[:, None] / SIDE + bend
    rings = np.sin(2 * np.pi * (9 * y + 0.6 * noise(rng, 2, 16)))
    fibres = noise(rng, 8, 128)
    return tint(colour, strength * (0.5 * rings + 0.6 * fibres + 0.4 * fractal(rng, 4, 8)))


def wood(rng: Rng) -> Picture:
    return _grain(rng, (166, 122, 78), 0.09)


def dark_wood(rng: Rng) -> Picture:
    return _grain(rng, (98, 66, 44), 0.13)


def laminate(rng: Rng) -> Picture:
    return _grain(rng, (206, 184, 152), 0.045)


def parquet(rng: Rng) -> Picture:
    picture = np.zeros((SIDE, SIDE, 3), np.uint8)
    rows, gap = 8, SIDE // 8
    for row in range(rows):
        board = _grain(rng, np.array((181, 136, 88)) * rng.uniform(0.86, 1.1), 0.08)
        start = int(rng.integers(0, SIDE))
        band = np.roll(board, start, axis=1)[:gap]
        band[:, start : start + 1] = band[:, start : start + 1] // 2
        band[0] = band[0] * 0.55
        picture[row * gap : (row + 1) * gap] = band
    return picture


def floor_tile(rng: Rng) -> Picture:
    picture = tint((214, 211, 203), 0.02 * fractal(rng, 4, 16, 64) + 0.02 * noise(rng, 128))
    speckle = rng.random((SIDE, SIDE)) < 0.02
    picture[speckle] = picture[speckle] * 0.86
    picture[:2] = picture[:, :2] = (168, 164, 156)
    return picture


def vinyl(rng: Rng) -> Picture:
    picture = tint((173, 166, 150), 0.035 * fractal(rng, 8, 32, 128))
    speckle = rng.random((SIDE, SIDE))
    picture[speckle < 0.03] = (146, 138, 122)
    picture[speckle > 0.975] = (198, 192, 178)
    return picture


def carpet(rng: Rng) -> Picture:
    pile = rng.normal(0, 0.10, (SIDE, SIDE)).astype(np.float32)
    picture = tint((92, 99, 112), pile + 0.05 * fractal(rng, 8, 32))
    half = SIDE // 2
    stripe = ((np.arange(SIDE) // 6) % 2 * 0.1)[None, :]
    picture[:half, :half] = np.clip(
        picture[:half, :half] * (0.95 + stripe[..., None][:, :half]), 0, 255
    )
    picture[half:, half:] = np.clip(
        picture[half:, half:] * (0.95 + stripe.T[..., None][:half]), 0, 255
    )
    picture[0] = picture[:, 0] = picture[half] = picture[:, half] = (70, 75, 86)
    return picture


def rug(rng: Rng) -> Picture:
    pile = rng.normal(0, 0.06, (SIDE, SIDE)).astype(np.float32)
    picture = tint((188, 176, 158), pile)
    for step, colour in ((14, (128, 62, 54)), (26, (62, 80, 98)), (32, (188, 176, 158))):
        inner = tint(colour, pile)
        picture[step:-step, step:-step] = inner[step:-step, step:-step]
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    lattice = ((x + y) // 14 % 4 == 0) ^ ((x - y) // 14 % 4 == 0)
    lattice[:40] = lattice[-40:] = lattice[:, :40] = lattice[:, -40:] = False
    picture[lattice] = tint((150, 118, 84), pile)[lattice]
    return picture


def fabric(rng: Rng) -> Picture:
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    weave = 0.05 * np.sin(x * np.pi / 2) * np.sin(y * np.pi / 2)
    return tint((205, 205, 205), weave + rng.normal(0, 0.04, (SIDE, SIDE)) + 0.04 * noise(rng, 8))


def metal(rng: Rng) -> Picture:
    return tint((190, 192, 196), 0.05 * noise(rng, 4, 128) + 0.02 * fractal(rng, 4))


def leather(rng: Rng) -> Picture:
    return tint(
        (205, 205, 205), 0.09 * noise(rng, 64) * noise(rng, 32) + 0.05 * fractal(rng, 8, 128)
    )


def foliage(rng: Rng) -> Picture:
    vein = 0.12 * np.cos(np.linspace(-np.pi, np.pi, SIDE))[None, :]
    return tint((74, 116, 62), vein + 0.12 * fractal(rng, 8, 32))


def curtain(rng: Rng) -> Picture:
    folds = 0.16 * np.sin(np.linspace(0, 12 * np.pi, SIDE))[None, :]
    return tint((196, 184, 160), folds + 0.03 * noise(rng, 128, 8))


def ceiling(rng: Rng) -> Picture:
    picture = tint((236, 235, 230), rng.normal(0, 0.012, (SIDE, SIDE)))
    picture[:3] = picture[:, :3] = (196, 196, 192)
    return picture
