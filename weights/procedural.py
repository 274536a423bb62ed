"""Things that have no name: cables, cards, discs, rods, blobs and cloths, with real surfaces on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
import numpy.typing as npt

Rng = np.random.Generator
Pixels = npt.NDArray[np.uint8]
Colours = npt.NDArray[np.float32]
SIDE = 192


def draw_things(surfaces: Sequence[Pixels], count: int, seed: int) -> Iterator[Pixels]:
    """Yield uint8 BGRA pictures, SIDE px long; 255 in alpha is the thing."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        solid = SHAPES[rng.integers(len(SHAPES))](rng)
        if solid.sum() < 150:
            continue
        colour = _colours(surfaces, rng)
        yield np.dstack([_lit(colour, solid, rng), solid.astype(np.uint8) * 255])


def _curve(rng: Rng) -> npt.NDArray[np.int32]:
    """A smooth line through random points."""
    knots = rng.uniform(0.1, 0.9, (rng.integers(3, 7), 2)) * SIDE
    ends = np.concatenate([knots[:1], knots, knots[-1:]])
    steps = np.linspace(0, 1, 24)[:, None]
    parts = []
    for p0, p1, p2, p3 in zip(ends, ends[1:], ends[2:], ends[3:], strict=False):
        a, b = 2 * p0 - 5 * p1 + 4 * p2 - p3, 3 * p1 - p0 - 3 * p2 + p3
        parts.append(0.5 * (2 * p1 + (p2 - p0) * steps + a * steps**2 + b * steps**3))
    return np.round(np.concatenate(parts)).astype(np.int32)


def _cable(rng: Rng) -> npt.NDArray[np.bool_]:
    solid = np.zeros((SIDE, SIDE), np.uint8)
    cv2.polylines(solid, [_curve(rng)], False, 1, int(rng.integers(4, 16)))
    return solid.astype(bool)


def _rod(rng: Rng) -> npt.NDArray[np.bool_]:
    solid = np.zeros((SIDE, SIDE), np.uint8)
    y, wide = SIDE // 2, int(rng.integers(6, 30))
    cv2.line(solid, (12, y), (SIDE - 12, y), 1, wide)
    if rng.random() < 0.5:
        cv2.circle(solid, (24, y), int(wide * rng.uniform(0.6, 1.4)), 1, -1)
    return solid.astype(bool)


def _card(rng: Rng) -> npt.NDArray[np.bool_]:
    tall = SIDE * rng.uniform(0.25, 0.9)
    top = (SIDE - tall) / 2
    corners = np.array([[10, top], [SIDE - 10, top], [SIDE - 10, top + tall], [10, top + tall]])
    corners += rng.uniform(-0.12, 0.12, (4, 2)) * SIDE
    solid = np.zeros((SIDE, SIDE), np.uint8)
    cv2.fillConvexPoly(solid, np.round(corners).astype(np.int32), 1)
    return solid.astype(bool)


def _disc(rng: Rng) -> npt.NDArray[np.bool_]:
    solid = np.zeros((SIDE, SIDE), np.uint8)
    axes = (SIDE // 2 - 10, int((SIDE // 2 - 10) * rng.uniform(0.2, 1)))
    cv2.ellipse(solid, (SIDE // 2, SIDE // 2), axes, 0, 0, 360, 1, -1)
    if rng.random() < 0.35:
        share = rng.uniform(0.3, 0.8)
        inner = tuple(int(v * share) for v in axes)
        cv2.ellipse(solid, (SIDE // 2, SIDE // 2), inner, 0, 0, 360, 0, -1)
    return solid.astype(bool)


def _blob(rng: Rng) -> npt.NDArray[np.bool_]:
    """A random outline: low harmonics of the radius."""
    angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    radius = np.ones_like(angle)
    for k in range(2, 7):
        radius += rng.normal(0, 0.35 / k) * np.cos(k * angle + rng.uniform(0, 2 * np.pi))
    radius = np.clip(radius, 0.15, None)
    radius *= 0.46 * SIDE / radius.max()
    points = SIDE / 2 + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    solid = np.zeros((SIDE, SIDE), np.uint8)
    cv2.fillPoly(solid, [np.round(points).astype(np.int32)], 1)
    return solid.astype(bool)


def _compound(rng: Rng) -> npt.NDArray[np.bool_]:
    """Two or three parts in one: tools, keys, toys."""
    parts = [_disc, _card, _rod, _blob]
    solid = np.zeros((SIDE, SIDE), np.uint8)
    for _ in range(int(rng.integers(2, 4))):
        part = parts[rng.integers(len(parts))](rng).view(np.uint8)
        scale = rng.uniform(0.3, 0.8)
        to = cv2.getRotationMatrix2D((SIDE / 2, SIDE / 2), rng.uniform(0, 360), scale)
        to[:, 2] += rng.uniform(-0.18, 0.18, 2) * SIDE
        solid |= cv2.warpAffine(part, to, (SIDE, SIDE), flags=cv2.INTER_NEAREST)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(solid)
    if len(stats) < 2:
        return solid.astype(bool)
    return np.asarray(labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA])))


SHAPES = (_cable, _rod, _card, _disc, _blob, _blob, _compound, _compound)


def _colours(surfaces: Sequence[Pixels], rng: Rng) -> Colours:
    """A piece of a picture, a plain colour, or the one tinted by the other."""
    surface = surfaces[int(rng.integers(len(surfaces)))]
    side = int(min(surface.shape[:2]) * rng.uniform(0.1, 0.9))
    top, left = (int(rng.integers(0, n - side + 1)) for n in surface.shape[:2])
    piece = surface[top : top + side, left : left + side]
    piece = cv2.resize(piece, (SIDE, SIDE), interpolation=cv2.INTER_AREA).astype(np.float32)
    hue, strength, value = rng.uniform(0, 180), 255 * rng.random() ** 1.5, rng.uniform(15, 245)
    swatch = np.array([[[hue, strength, value]]], np.uint8)
    plain = cv2.cvtColor(swatch, cv2.COLOR_HSV2BGR).astype(np.float32)
    share = rng.choice([0.0, 1.0, rng.random()], p=[0.35, 0.35, 0.3])
    return np.asarray(piece * share + plain * (1 - share), np.float32)


def _lit(colour: Colours, solid: npt.NDArray[np.bool_], rng: Rng) -> Pixels:
    """Give the thing a round or a bevelled body, light from one side, and sometimes a gleam."""
    depth = cv2.distanceTransform(solid.view(np.uint8), cv2.DIST_L2, 5)
    rim = max(1.0, rng.uniform(0.05, 1.0) * float(depth.max()))
    rise = np.sqrt(np.clip(1 - (1 - np.minimum(depth / rim, 1)) ** 2, 0, 1)) * rim
    rise = cv2.GaussianBlur(rise, (0, 0), 1.5)
    down, across = np.gradient(rise)
    toward = rng.uniform(-1, 1, 2)
    slope = across * toward[0] + down * toward[1]
    light = np.clip(1 - rng.uniform(0.1, 0.5) * slope, 0.25, 1.8)
    ramp = np.linspace(-1, 1, SIDE)
    light *= 1 + rng.uniform(-0.25, 0.25) * ramp[None] + rng.uniform(-0.25, 0.25) * ramp[:, None]
    gleam = rng.choice([0, 1]) * 140 * np.clip(-slope - rng.uniform(0.3, 0.9), 0, 1)
    bright = np.clip(colour * light[..., None] + gleam[..., None], 0, 255)
    return np.asarray(bright, np.uint8)
