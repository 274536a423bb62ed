"""Procedural textures: floors, woods, cloths, packaging, spines, posters, papers.

Each is a square sRGB picture, uint8 (SIDE, SIDE, 3), made from a name and a seed, so the world is
the same on every machine.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

Picture = npt.NDArray[np.uint8]
Rng = np.random.Generator

SIDE = 256


def _noise(rng: Rng, cells_x: int, cells_y: int | None = None) -> npt.NDArray[np.float32]:
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


def _fractal(rng: Rng, *cells: int) -> npt.NDArray[np.float32]:
    total = np.zeros((SIDE, SIDE), np.float32)
    for octave, number in enumerate(cells):
        total += _noise(rng, number) / 2**octave
    return total


def _tint(colour: npt.ArrayLike, shade: npt.NDArray[np.floating]) -> Picture:
    """Multiply an sRGB colour (0..255) by 1 + shade."""
    picture = np.asarray(colour, np.float32) * (1 + shade[..., None])
    return np.clip(picture, 0, 255).astype(np.uint8)


def _plain(rng: Rng) -> Picture:
    return _tint((235, 235, 235), 0.008 * _fractal(rng, 8, 32))


def _plaster(rng: Rng) -> Picture:
    return _tint((228, 225, 217), 0.012 * _fractal(rng, 4, 16, 64) + 0.01 * _noise(rng, 128))


def _wallpaper(rng: Rng) -> Picture:
    weave = 0.02 * _noise(rng, 128, 32) + 0.012 * _fractal(rng, 4, 16)
    return _tint((226, 219, 205), weave)


def _concrete(rng: Rng) -> Picture:
    return _tint((160, 158, 154), 0.07 * _fractal(rng, 4, 16, 64, 128))


def _grain(rng: Rng, colour: npt.ArrayLike, strength: float) -> Picture:
    bend = 0.05 * _noise(rng, 4)
    y = np.arange(SIDE, dtype=np.float32)[:, None] / SIDE + bend
    rings = np.sin(2 * np.pi * (9 * y + 0.6 * _noise(rng, 2, 16)))
    fibres = _noise(rng, 8, 128)
    return _tint(colour, strength * (0.5 * rings + 0.6 * fibres + 0.4 * _fractal(rng, 4, 8)))


def _wood(rng: Rng) -> Picture:
    return _grain(rng, (166, 122, 78), 0.09)


def _dark_wood(rng: Rng) -> Picture:
    return _grain(rng, (98, 66, 44), 0.13)


def _laminate(rng: Rng) -> Picture:
    return _grain(rng, (206, 184, 152), 0.045)


def _parquet(rng: Rng) -> Picture:
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


def _floor_tile(rng: Rng) -> Picture:
    picture = _tint((214, 211, 203), 0.02 * _fractal(rng, 4, 16, 64) + 0.02 * _noise(rng, 128))
    speckle = rng.random((SIDE, SIDE)) < 0.02
    picture[speckle] = picture[speckle] * 0.86
    picture[:2] = picture[:, :2] = (168, 164, 156)
    return picture


def _vinyl(rng: Rng) -> Picture:
    picture = _tint((173, 166, 150), 0.035 * _fractal(rng, 8, 32, 128))
    speckle = rng.random((SIDE, SIDE))
    picture[speckle < 0.03] = (146, 138, 122)
    picture[speckle > 0.975] = (198, 192, 178)
    return picture


def _carpet(rng: Rng) -> Picture:
    pile = rng.normal(0, 0.10, (SIDE, SIDE)).astype(np.float32)
    picture = _tint((92, 99, 112), pile + 0.05 * _fractal(rng, 8, 32))
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


def _rug(rng: Rng) -> Picture:
    pile = rng.normal(0, 0.06, (SIDE, SIDE)).astype(np.float32)
    picture = _tint((188, 176, 158), pile)
    for step, colour in ((14, (128, 62, 54)), (26, (62, 80, 98)), (32, (188, 176, 158))):
        inner = _tint(colour, pile)
        picture[step:-step, step:-step] = inner[step:-step, step:-step]
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    lattice = ((x + y) // 14 % 4 == 0) ^ ((x - y) // 14 % 4 == 0)
    lattice[:40] = lattice[-40:] = lattice[:, :40] = lattice[:, -40:] = False
    picture[lattice] = _tint((150, 118, 84), pile)[lattice]
    return picture


def _fabric(rng: Rng) -> Picture:
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    weave = 0.05 * np.sin(x * np.pi / 2) * np.sin(y * np.pi / 2)
    return _tint((205, 205, 205), weave + rng.normal(0, 0.04, (SIDE, SIDE)) + 0.04 * _noise(rng, 8))


def _metal(rng: Rng) -> Picture:
    return _tint((190, 192, 196), 0.05 * _noise(rng, 4, 128) + 0.02 * _fractal(rng, 4))


def _leather(rng: Rng) -> Picture:
    return _tint(
        (205, 205, 205), 0.09 * _noise(rng, 64) * _noise(rng, 32) + 0.05 * _fractal(rng, 8, 128)
    )


def _foliage(rng: Rng) -> Picture:
    vein = 0.12 * np.cos(np.linspace(-np.pi, np.pi, SIDE))[None, :]
    return _tint((74, 116, 62), vein + 0.12 * _fractal(rng, 8, 32))


def _curtain(rng: Rng) -> Picture:
    folds = 0.16 * np.sin(np.linspace(0, 12 * np.pi, SIDE))[None, :]
    return _tint((196, 184, 160), folds + 0.03 * _noise(rng, 128, 8))


def _ceiling(rng: Rng) -> Picture:
    picture = _tint((236, 235, 230), rng.normal(0, 0.012, (SIDE, SIDE)))
    picture[:3] = picture[:, :3] = (196, 196, 192)
    return picture


def _write(
    picture: Picture, text: str, box: tuple[int, int, int, int], colour: npt.ArrayLike
) -> None:
    """Write a word as large as fits into (x, y, width, height)."""
    x, y, width, height = box
    (w, h), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_DUPLEX, 1.0, 2)
    scale = min(width / max(w, 1), height / max(h, 1))
    cv2.putText(
        picture,
        text,
        (x, y + height),
        cv2.FONT_HERSHEY_DUPLEX,
        scale,
        _rgb(np.asarray(colour)),
        max(1, round(2.2 * scale)),
        cv2.LINE_AA,
    )


WORDS = (
    "SOLA",
    "MIRU",
    "Kiko",
    "NORI",
    "Asahi",
    "Tabi",
    "LUMO",
    "FRUT",
    "Osaka",
    "VITA",
    "Cafe",
    "HANA",
    "MILK",
    "SODA",
    "Crisp",
    "TEA",
    "Choco",
    "Ramen",
    "KUMA",
    "Pure",
)


def _packaging(rng: Rng) -> Picture:
    """A product front: ground colour, band or disc, a brand, small print."""
    hue = rng.uniform(0, 180)
    ground = _hsv(hue, rng.uniform(50, 185), rng.uniform(130, 240))
    second = _hsv((hue + rng.uniform(40, 130)) % 180, rng.uniform(40, 170), rng.uniform(150, 250))
    light = np.array((246, 242, 232)) if rng.random() < 0.75 else _hsv(hue, 60, 60)
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    picture[:] = ground
    kind = int(rng.integers(0, 5))
    centre = (int(rng.uniform(90, 166)), int(rng.uniform(120, 190)))
    if kind == 0:
        cv2.circle(picture, centre, int(rng.uniform(45, 75)), _rgb(second), -1, cv2.LINE_AA)
    elif kind == 1:
        top = int(rng.uniform(100, 160))
        picture[top : top + int(rng.uniform(40, 90))] = second
    elif kind == 2:
        corner = np.array([[0, 256], [256, int(rng.uniform(60, 200))], [256, 256]], np.int32)
        cv2.fillPoly(picture, [corner], _rgb(second), cv2.LINE_AA)
    elif kind == 3:
        for k in range(0, 256, 32):
            picture[:, k : k + 12] = second
    else:
        axes = (int(rng.uniform(60, 100)), int(rng.uniform(35, 60)))
        cv2.ellipse(
            picture, centre, axes, rng.uniform(0, 60), 0, 360, _rgb(second), -1, cv2.LINE_AA
        )
        cv2.circle(picture, centre, 26, _rgb(light), -1, cv2.LINE_AA)
    word = WORDS[int(rng.integers(0, len(WORDS)))]
    _write(picture, word, (24, int(rng.uniform(28, 50)), 208, int(rng.uniform(40, 62))), light)
    for k in range(int(rng.integers(1, 4))):
        y = 214 + 12 * k
        picture[y : y + 4, 40 : 40 + int(rng.uniform(60, 170))] = light
    shade = np.linspace(0.03, -0.06, SIDE, dtype=np.float32)[:, None] + 0.01 * _noise(rng, 64)
    return np.clip(picture * (1 + shade[..., None]), 0, 255).astype(np.uint8)


def _spine(rng: Rng) -> Picture:
    ground = _hsv(rng.uniform(0, 180), rng.uniform(40, 190), rng.uniform(70, 225))
    light = np.array((240, 234, 218)) if ground.mean() < 150 else np.array((40, 38, 36))
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    picture[:] = ground
    for y in (16, 24, 226):
        picture[y : y + 4] = light
    upright = np.ascontiguousarray(np.rot90(picture))
    _write(upright, WORDS[int(rng.integers(0, len(WORDS)))], (48, 92, 150, 74), light)
    return np.ascontiguousarray(np.rot90(upright, -1))


def _poster(rng: Rng) -> Picture:
    """A landscape under a title."""
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    sky, ground = _hsv(rng.uniform(85, 125), 120, 220), _hsv(rng.uniform(20, 80), 140, 150)
    ramp = np.linspace(0.75, 1.15, SIDE, dtype=np.float32)[:, None, None]
    picture[:] = np.clip(sky * ramp, 0, 255)
    for depth in range(3):
        ridge = 120 + 34 * depth + (26 - 6 * depth) * _noise(rng, 8 + 8 * depth)[depth * 40]
        below = np.arange(SIDE)[:, None] > ridge[None, :]
        picture[below] = np.clip(ground * (0.55 + 0.28 * depth), 0, 255)
    cv2.circle(picture, (int(rng.uniform(50, 200)), 66), 22, (250, 236, 190), -1, cv2.LINE_AA)
    picture[206:] = (244, 242, 236)
    _write(picture, WORDS[int(rng.integers(0, len(WORDS)))], (22, 216, 130, 26), (60, 60, 66))
    picture[:5] = picture[-5:] = picture[:, :5] = picture[:, -5:] = (250, 250, 248)
    return picture


def _paper(rng: Rng) -> Picture:
    """A printed sheet: heading, lines, sometimes a figure."""
    picture = np.full((SIDE, SIDE, 3), (244, 242, 236), np.uint8)
    _write(picture, WORDS[int(rng.integers(0, len(WORDS)))], (28, 22, 150, 22), (50, 52, 60))
    figure = rng.random() < 0.5
    for y in range(62, 236, 11):
        if figure and 100 < y < 180:
            continue
        picture[y : y + 3, 28 : 28 + int(rng.uniform(120, 200))] = (120, 122, 128)
    if figure:
        picture[106:176, 40:216] = _hsv(rng.uniform(0, 180), 90, 200)
        points = np.stack([np.arange(44, 214, 8), rng.integers(112, 172, 22)], axis=1)
        cv2.polylines(picture, [points.astype(np.int32)], False, (52, 60, 80), 2, cv2.LINE_AA)
    return picture


def _whiteboard(rng: Rng) -> Picture:
    picture = _tint((240, 242, 243), 0.008 * _fractal(rng, 4, 8))
    inks = ((40, 60, 150), (170, 48, 48), (44, 48, 54))
    for k in range(7):
        x, y = int(rng.uniform(10, 150)), int(rng.uniform(20, 220))
        ink = inks[k % 3]
        steps = np.cumsum(rng.uniform(2, 7, 14))
        points = np.stack([x + steps, y + 7 * np.sin(steps / 5 + k)], axis=1).astype(np.int32)
        cv2.polylines(picture, [points], False, ink, 1, cv2.LINE_AA)
    cv2.rectangle(picture, (150, 60), (196, 96), inks[0], 1, cv2.LINE_AA)
    cv2.rectangle(picture, (206, 120), (244, 150), inks[2], 1, cv2.LINE_AA)
    cv2.arrowedLine(picture, (180, 96), (216, 120), inks[1], 1, cv2.LINE_AA)
    return picture


def _screen(rng: Rng) -> Picture:
    """A phone's home screen, dimmed."""
    picture = _tint((36, 48, 74), 0.5 * _noise(rng, 4))
    for row in range(5):
        for column in range(4):
            x, y = 24 + 56 * column, 36 + 40 * row
            colour = _hsv(rng.uniform(0, 180), 150, 190)
            cv2.rectangle(picture, (x, y), (x + 34, y + 22), _rgb(colour), -1, cv2.LINE_AA)
    return picture


def _card(rng: Rng) -> Picture:
    """A transit card: two-tone ground, chip, number."""
    hue = float(rng.choice([70, 100, 110, 150]))
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    picture[:] = _hsv(hue, 150, 205)
    wave = 150 + 26 * np.sin(np.linspace(0, 4, SIDE))
    picture[np.arange(SIDE)[:, None] > wave[None, :]] = (232, 234, 236)
    cv2.rectangle(picture, (28, 66), (74, 116), (214, 188, 110), -1)
    _write(picture, "SUIKA", (120, 34, 110, 40), (250, 250, 250))
    _write(picture, "4821 0937", (28, 206, 130, 22), (90, 94, 104))
    return picture


def _handkerchief(rng: Rng) -> Picture:
    """Checked cloth with a border."""
    hue = rng.uniform(0, 180)
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    picture[:] = _hsv(hue, 60, 232)
    strong = _hsv(hue, 165, 150)
    stripes = (np.arange(SIDE) // 16) % 3 == 0
    picture[stripes] = picture[stripes] * 0.45 + strong * 0.55
    picture[:, stripes] = picture[:, stripes] * 0.45 + strong * 0.55
    picture[:10] = picture[-10:] = picture[:, :10] = picture[:, -10:] = strong
    return np.clip(picture * (1 + rng.normal(0, 0.03, (SIDE, SIDE, 1))), 0, 255).astype(np.uint8)


def _battery(rng: Rng) -> Picture:
    """A cell's wrapper: copper band over black, upright when wrapped round a cylinder."""
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    body = ((34, 34, 38), (28, 72, 58), (40, 52, 110))[int(rng.integers(0, 3))]
    picture[:] = body
    picture[176:] = (190, 122, 66)
    lines = np.ascontiguousarray(np.rot90(picture))
    _write(lines, "ALKA", (30, 60, 120, 60), (232, 220, 190))
    return np.ascontiguousarray(np.rot90(lines, -1))


def _keyboard(rng: Rng) -> Picture:
    picture = np.full((SIDE, SIDE, 3), (58, 60, 64), np.uint8)
    for row in range(6):
        for column in range(13):
            x, y = 8 + 19 * column, 14 + 22 * row
            cv2.rectangle(picture, (x, y), (x + 15, y + 17), (30, 31, 34), -1)
    cv2.rectangle(picture, (84, 160), (172, 240), (72, 74, 80), -1)
    return picture


def _hsv(hue: float, saturation: float, value: float) -> npt.NDArray[np.uint8]:
    pixel = np.array([[[hue, saturation, value]]], np.uint8)
    return np.asarray(cv2.cvtColor(pixel, cv2.COLOR_HSV2RGB)[0, 0], np.uint8)


def _rgb(colour: npt.NDArray[Any]) -> tuple[int, int, int]:
    return int(colour[0]), int(colour[1]), int(colour[2])


MAKERS: dict[str, Callable[[Rng], Picture]] = {
    "plain": _plain, "plaster": _plaster, "wallpaper": _wallpaper, "concrete": _concrete,
    "wood": _wood, "dark_wood": _dark_wood, "laminate": _laminate, "parquet": _parquet,
    "floor_tile": _floor_tile, "vinyl": _vinyl, "carpet": _carpet, "rug": _rug,
    "fabric": _fabric, "metal": _metal, "leather": _leather, "foliage": _foliage,
    "curtain": _curtain, "ceiling": _ceiling, "packaging": _packaging, "spine": _spine,
    "poster": _poster, "paper": _paper, "whiteboard": _whiteboard, "screen": _screen,
    "card": _card, "handkerchief": _handkerchief, "battery": _battery, "keyboard": _keyboard,
}  # fmt: skip


def make_texture(name: str) -> Picture:
    """Return the texture of a name such as "wood" or "packaging:7" (the number varies it)."""
    kind, _, variant = name.partition(":")
    seed = [sum(ord(c) * 31**i for i, c in enumerate(kind)) % 2**31, int(variant or 0)]
    return MAKERS[kind](np.random.default_rng(seed))
