"""The small things that change: the paper's ten kinds at their true sizes, in metres.

Each maker returns a mesh resting on z = 0 around the origin, varied by a random generator.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from reviewer.demo.shapes import (
    Material,
    Mesh,
    box,
    cylinder,
    join,
    lathe,
    quad,
    rotation,
    rounded_box,
    surface,
    tube,
)

Rng = np.random.Generator
Tint = tuple[float, float, float]

DARK: Tint = (0.03, 0.03, 0.035)
STEEL = Material("metal", (0.62, 0.63, 0.66), tile_m=0.05, gloss=0.5, mirror=0.12, blur=0.15)
BRASS = Material("metal", (0.75, 0.55, 0.22), tile_m=0.05, gloss=0.5, mirror=0.1, blur=0.15)


def smartphone(rng: Rng) -> Mesh:
    """147 x 72 x 8 mm, screen up or back up."""
    body = Material("plain", _pick(rng, DARK, (0.5, 0.52, 0.55), (0.16, 0.2, 0.34)), gloss=0.3)
    parts = [rounded_box((0.072, 0.147, 0.008), 0.0038, body)]
    if rng.random() < 0.6:
        glass = Material(f"screen:{rng.integers(0, 4)}", (0.5, 0.5, 0.5), mirror=0.05, gloss=0.5)
        parts.append(_sheet(0.066, 0.140, 0.0083, glass))
    else:
        lens = Material("plain", (0.01, 0.01, 0.012), mirror=0.06, gloss=0.6)
        for y in (0.052, 0.034):
            parts.append(cylinder(0.007, 0.0022, lens, sides=16).moved(-0.021, y, 0.008))
    return join(parts)


def cable(rng: Rng) -> Mesh:
    """A coiled 4 mm cable with two plugs, about 22 cm across."""
    sheath = Material("plain", _pick(rng, (0.82, 0.82, 0.8), DARK, (0.6, 0.08, 0.06)), gloss=0.15)
    t = np.linspace(0, 1, 130)
    turns = rng.uniform(1.6, 2.4)
    angle = 2 * np.pi * turns * t + rng.uniform(0, 6)
    radius = 0.055 + 0.012 * np.sin(2.3 * angle + rng.uniform(0, 6)) + 0.07 * np.clip(t - 0.8, 0, 1)
    lift = 0.0022 + 0.0034 * (np.sin(angle * 1.7) > 0.2) * np.sin(np.pi * t)
    path = np.stack([radius * np.cos(angle), radius * np.sin(angle) * 0.8, lift], axis=1)
    parts = [tube(path, 0.0021, sheath)]
    for end, before in ((path[0], path[3]), (path[-1], path[-4])):
        way = np.arctan2(*(end - before)[1::-1])
        plug = rounded_box((0.024, 0.011, 0.007), 0.002, sheath)
        tip = box((0.010, 0.008, 0.003), STEEL).moved(0.016, 0, 0.002)
        parts.append(join([plug, tip]).moved(0.010, 0, 0).moved(end[0], end[1], 0, yaw=way))
    return join(parts)


def notebook(rng: Rng) -> Mesh:
    """An A5 ring notebook, 210 x 148 x 12 mm."""
    hue = _pick(rng, (0.42, 0.07, 0.07), (0.07, 0.16, 0.36), (0.06, 0.25, 0.16), (0.62, 0.5, 0.32))
    cover = Material("leather", hue, tile_m=0.2, gloss=0.05)
    pages = Material("paper", (0.9, 0.88, 0.8), tile_m=3.0)
    block = box((0.142, 0.204, 0.010), pages).moved(z=0.001)
    lid = box((0.148, 0.210, 0.0015), cover)
    label = Material("paper:3", (0.95, 0.93, 0.88))
    parts = [lid, block, lid.moved(z=0.011), _sheet(0.07, 0.035, 0.0127, label).moved(0.01, 0.045)]
    ring = Material("metal", (0.5, 0.5, 0.52), gloss=0.4)
    for y in np.linspace(-0.092, 0.092, 16):
        parts.append(box((0.006, 0.003, 0.0145), ring).moved(-0.0745, float(y)))
    return join(parts)


def pen(rng: Rng) -> Mesh:
    """A 142 mm ball pen, 10 mm thick."""
    hue = _pick(
        rng, (0.04, 0.09, 0.45), DARK, (0.5, 0.05, 0.05), (0.85, 0.85, 0.82), (0.05, 0.35, 0.2)
    )
    barrel = Material("plain", hue, gloss=0.35)
    outline = [(0.0008, 0), (0.0018, 0.004), (0.0046, 0.017), (0.005, 0.03), (0.005, 0.132)]
    stick = lathe([*outline, (0.003, 0.135), (0.003, 0.142)], barrel, sides=14)
    clip = box((0.0024, 0.0016, 0.038), STEEL).moved(0, -0.0062, 0.096)
    lying = rotation((0, 1, 0), np.pi / 2)
    return join([stick, clip]).turned(lying).moved(-0.071, 0, 0.005)


def handkerchief(rng: Rng) -> Mesh:
    """A cotton square, dropped: about 24 cm across, softly folded, 3 cm high."""
    cloth = Material(f"handkerchief:{rng.integers(0, 6)}")
    side = np.linspace(-0.5, 0.5, 44)
    x, y = np.meshgrid(side, side)
    height = np.zeros_like(x)
    for _ in range(6):
        way, phase = rng.uniform(0, np.pi), rng.uniform(0, 6)
        wave = rng.uniform(7, 15)
        height += np.abs(np.sin(wave * (x * np.cos(way) + y * np.sin(way)) + phase)) ** 2
    height *= 0.0052 * np.exp(-5 * (x**2 + y**2)) + 0.0012
    squeeze = 0.25 * (1 - 0.22 * np.abs(np.sin(5 * x + rng.uniform(0, 6))))
    bend = 0.02 * np.sin(6 * y + rng.uniform(0, 6))
    grid = np.stack([x * squeeze + bend, y * squeeze, height + 0.0008], axis=2)
    return surface(grid, cloth)


def wallet(rng: Rng) -> Mesh:
    """A folded leather wallet, 112 x 92 x 20 mm."""
    hide = Material(
        "leather",
        _pick(rng, (0.2, 0.09, 0.045), (0.035, 0.033, 0.035), (0.36, 0.2, 0.09)),
        tile_m=0.06,
        gloss=0.12,
    )
    lower = rounded_box((0.112, 0.092, 0.010), 0.004, hide)
    upper = rounded_box((0.110, 0.091, 0.009), 0.004, hide).turned(rotation((1, 0, 0), 0.05))
    seam = Material("plain", (0.55, 0.42, 0.25))
    parts = [lower, upper.moved(0, 0.001, 0.010)]
    for x in (-0.047, 0.047):
        parts.append(_sheet(0.0012, 0.080, 0.0196, seam).moved(x, 0.001))
    return join(parts)


def ic_card(rng: Rng) -> Mesh:
    """An ID-1 card, 85.6 x 54 x 0.8 mm."""
    front = Material(f"card:{rng.integers(0, 8)}", gloss=0.2, mirror=0.03, blur=0.08)
    return box((0.0856, 0.054, 0.0009), Material("plain"), faces={"top": front})


def screw(rng: Rng) -> Mesh:
    """An M6 x 40 hexagon screw."""
    material = STEEL if rng.random() < 0.7 else BRASS
    thread = [(0.003 - 0.0005 * (k % 2), 0.001 * k) for k in range(41)]
    shaft = lathe(thread, material, sides=10)
    head = cylinder(0.0058, 0.0042, material, sides=6).moved(z=0.040)
    lying = rotation((0, 1, 0), np.pi / 2 + 0.06)
    whole = join([shaft, head]).turned(lying)
    return whole.moved(-0.022, 0, -float(whole.corners[..., 2].min()))


def battery(rng: Rng) -> Mesh:
    """An AA cell, 14.5 x 50.5 mm, lying."""
    wrapper = Material(f"battery:{rng.integers(0, 4)}", gloss=0.35)
    body = cylinder(0.00725, 0.049, wrapper, top=STEEL, sides=24, wrap=True)
    nipple = cylinder(0.0027, 0.0015, STEEL, sides=12).moved(z=0.049)
    lying = rotation((0, 1, 0), np.pi / 2)
    return join([body, nipple]).turned(lying).moved(-0.025, 0, 0.00725)


def clip(rng: Rng) -> Mesh:
    """A 41 mm binder clip."""
    hue = _pick(rng, DARK, DARK, (0.5, 0.06, 0.05), (0.05, 0.16, 0.42))
    steel = Material("plain", hue, gloss=0.3)
    width, depth, height = 0.041, 0.024, 0.019
    w, d = width / 2, depth / 2
    wings = [
        quad([[-w, -d, 0], [w, -d, 0], [w, 0.001, height], [-w, 0.001, height]], steel),
        quad([[w, d, 0], [-w, d, 0], [-w, -0.001, height], [w, -0.001, height]], steel),
        quad([[-w, -d, 0.0005], [w, -d, 0.0005], [w, d, 0.0005], [-w, d, 0.0005]], steel),
    ]
    t = np.linspace(0, np.pi, 20)
    handles = []
    for side in (-1, 1):
        loop = np.stack(
            [0.010 * np.cos(t), side * (0.001 + 0.026 * np.sin(t)), height - 0.012 * np.sin(t)],
            axis=1,
        )
        handles.append(tube(loop, 0.0011, STEEL, sides=6))
    return join([*wings, *handles])


def _sheet(width: float, depth: float, z: float, material: Material) -> Mesh:
    w, d = width / 2, depth / 2
    return quad([[-w, -d, z], [w, -d, z], [w, d, z], [-w, d, z]], material)


def _pick(rng: Rng, *options: Tint) -> Tint:
    return options[int(rng.integers(0, len(options)))]


GROUPS: dict[int, dict[str, Callable[[Rng], Mesh]]] = {
    1: {"smartphone": smartphone, "cable": cable, "notebook": notebook, "pen": pen},
    2: {"handkerchief": handkerchief, "wallet": wallet, "ic card": ic_card},
    3: {"screw": screw, "battery": battery, "clip": clip},
}
"""The paper's object groups: 1 stationery and electronics, 2 personal items, 3 hardware."""

VIEWING_RANGE: dict[int, tuple[float, float]] = {1: (0.75, 2.2), 2: (0.75, 2.2), 3: (0.7, 1.35)}
"""Distances (metres) at which objects of a group are placed before a viewpoint."""
