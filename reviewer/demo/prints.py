"""Procedural textures of made things: packaging, book spines, posters, papers, cards, keys.

Each maker draws a square sRGB picture, uint8 (SIDE, SIDE, 3), from a random generator.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from reviewer.demo.textures import SIDE, Picture, Rng, fractal, noise, tint, tint_picture


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


def packaging(rng: Rng) -> Picture:
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
    shade = np.linspace(0.03, -0.06, SIDE, dtype=np.float32)[:, None] + 0.01 * noise(rng, 64)
    return tint_picture(picture, shade)


def spine(rng: Rng) -> Picture:
    ground = _hsv(rng.uniform(0, 180), rng.uniform(40, 190), rng.uniform(70, 225))
    light = np.array((240, 234, 218)) if ground.mean() < 150 else np.array((40, 38, 36))
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    picture[:] = ground
    for y in (16, 24, 226):
        picture[y : y + 4] = light
    upright = np.ascontiguousarray(np.rot90(picture))
    _write(upright, WORDS[int(rng.integers(0, len(WORDS)))], (48, 92, 150, 74), light)
    return np.ascontiguousarray(np.rot90(upright, -1))


def poster(rng: Rng) -> Picture:
    """A landscape under a title."""
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    sky, ground = _hsv(rng.uniform(85, 125), 120, 220), _hsv(rng.uniform(20, 80), 140, 150)
    ramp = np.linspace(0.75, 1.15, SIDE, dtype=np.float32)[:, None, None]
    picture[:] = np.clip(sky * ramp, 0, 255)
    for depth in range(3):
        ridge = 120 + 34 * depth + (26 - 6 * depth) * noise(rng, 8 + 8 * depth)[depth * 40]
        below = np.arange(SIDE)[:, None] > ridge[None, :]
        picture[below] = np.clip(ground * (0.55 + 0.28 * depth), 0, 255)
    cv2.circle(picture, (int(rng.uniform(50, 200)), 66), 22, (250, 236, 190), -1, cv2.LINE_AA)
    picture[206:] = (244, 242, 236)
    _write(picture, WORDS[int(rng.integers(0, len(WORDS)))], (22, 216, 130, 26), (60, 60, 66))
    picture[:5] = picture[-5:] = picture[:, :5] = picture[:, -5:] = (250, 250, 248)
    return picture


def paper(rng: Rng) -> Picture:
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


def whiteboard(rng: Rng) -> Picture:
    picture = tint((240, 242, 243), 0.008 * fractal(rng, 4, 8))
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


def screen(rng: Rng) -> Picture:
    """A phone's home screen, dimmed."""
    picture = tint((36, 48, 74), 0.5 * noise(rng, 4))
    for row in range(5):
        for column in range(4):
            x, y = 24 + 56 * column, 36 + 40 * row
            colour = _hsv(rng.uniform(0, 180), 150, 190)
            cv2.rectangle(picture, (x, y), (x + 34, y + 22), _rgb(colour), -1, cv2.LINE_AA)
    return picture


def card(rng: Rng) -> Picture:
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


def handkerchief(rng: Rng) -> Picture:
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


def battery(rng: Rng) -> Picture:
    """A cell's wrapper: copper band over black, upright when wrapped round a cylinder."""
    picture = np.empty((SIDE, SIDE, 3), np.uint8)
    body = ((34, 34, 38), (28, 72, 58), (40, 52, 110))[int(rng.integers(0, 3))]
    picture[:] = body
    picture[176:] = (190, 122, 66)
    lines = np.ascontiguousarray(np.rot90(picture))
    _write(lines, "ALKA", (30, 60, 120, 60), (232, 220, 190))
    return np.ascontiguousarray(np.rot90(lines, -1))


def keyboard(rng: Rng) -> Picture:
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
