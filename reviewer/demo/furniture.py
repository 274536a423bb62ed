"""Furniture and fittings: what fills the four workspaces. Sizes in metres, standing on z = 0.

Pieces face -y and are centred in x; rooms turn and place them.
"""

from __future__ import annotations

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

WOOD = Material("wood", tile_m=0.9, gloss=0.05, mirror=0.02, blur=0.08)
DARK_WOOD = Material("dark_wood", tile_m=0.9, gloss=0.06, mirror=0.02, blur=0.08)
LAMINATE = Material("laminate", tile_m=1.1, gloss=0.05, mirror=0.025, blur=0.06)
WHITE = Material("plain", (0.86, 0.86, 0.84), gloss=0.05)
GREY = Material("plain", (0.36, 0.37, 0.39), gloss=0.08)
BLACK = Material("plain", (0.025, 0.025, 0.028), gloss=0.1)
METAL = Material("metal", (0.6, 0.61, 0.63), tile_m=0.4, gloss=0.25, mirror=0.06, blur=0.12)


def shelf_of_goods(rng: Rng, width: float, *, levels: int = 4) -> Mesh:
    """One face of a shop shelf, 1.35 m high and 0.42 m deep, stocked."""
    depth, pitch = 0.42, 0.31
    parts = [
        box((width, 0.03, 1.38), WHITE).moved(0, depth / 2 - 0.015),
        box((width, depth, 0.09), GREY),
    ]
    for level in range(levels):
        z = 0.09 + pitch * level
        parts.append(box((width, depth, 0.025), WHITE).moved(0, 0, z))
        rail = Material("plain", (0.75, 0.73, 0.66))
        parts.append(box((width, 0.012, 0.038), rail).moved(0, -depth / 2, z - 0.012))
        parts += _price_tags(rng, width, -depth / 2 - 0.007, z - 0.008)
        parts += _row_of_goods(rng, width, depth, z + 0.025, pitch - 0.045)
    return join(parts)


def _price_tags(rng: Rng, width: float, y: float, z: float) -> list[Mesh]:
    tags = []
    for x in np.arange(-width / 2 + 0.1, width / 2 - 0.06, 0.19):
        tag = Material("paper:5", (1.0, 0.95, 0.7) if rng.random() < 0.3 else (1, 1, 1))
        corners = [[x, y, z], [x + 0.055, y, z], [x + 0.055, y, z + 0.032], [x, y, z + 0.032]]
        tags.append(quad(corners, tag))
    return tags


def _row_of_goods(rng: Rng, width: float, depth: float, z: float, room: float) -> list[Mesh]:
    """Fill one board with blocks of equal products."""
    parts, x = [], -width / 2 + 0.02
    while x < width / 2 - 0.07:
        kind = rng.choice(["carton", "can", "bottle", "bag"], p=[0.45, 0.2, 0.2, 0.15])
        design = Material(f"packaging:{rng.integers(0, 48)}")
        size = float(rng.uniform(0.06, 0.13))
        height = float(rng.uniform(0.55, 0.98)) * room
        for _ in range(int(rng.integers(1, 4))):
            if x + size > width / 2 - 0.01:
                break
            if rng.random() < 0.93:
                back = float(rng.uniform(0.0, 0.035))
                good = _product(rng, str(kind), size * 0.94, height, design)
                parts.append(good.moved(x + size / 2, -depth / 2 + 0.08 + back, z))
            x += size
        x += float(rng.uniform(0.002, 0.02))
    return parts


def _product(rng: Rng, kind: str, size: float, height: float, design: Material) -> Mesh:
    if kind == "can":
        lid = Material("metal", (0.7, 0.7, 0.72), gloss=0.3)
        can = cylinder(size / 2, min(height, 1.7 * size), design, top=lid, sides=18, wrap=True)
        return can.moved(yaw=float(rng.uniform(2.6, 3.6)))
    if kind == "bottle":
        r = size * 0.42
        outline = [(r, 0), (r, height * 0.62), (r * 0.4, height * 0.82), (r * 0.4, height)]
        cap = Material("plain", (0.8, 0.8, 0.8))
        return lathe(outline, design, top=cap, sides=16, wrap=True).moved(yaw=3.1)
    if kind == "bag":
        return _bag(size, height * 0.9, design)
    return box((size, 0.12, height), design, faces={"front": design, "top": WHITE})


def _bag(width: float, height: float, design: Material) -> Mesh:
    v, u = np.meshgrid(np.linspace(0, 1, 7), np.linspace(0, 1, 7), indexing="ij")
    belly = np.sin(np.pi * u) ** 0.7 * np.sin(np.pi * np.clip(v, 0.02, 1)) ** 0.7
    front = np.stack([(u - 0.5) * width, -0.055 * belly, v * height], axis=2)
    return surface(front, design)


def refrigerator(rng: Rng, width: float) -> Mesh:
    """An open chilled wall: lit shelves of drinks under a header, 2 m high."""
    lit = Material("plain", (0.95, 0.98, 1.0), emission=0.55)
    parts = [
        box((width, 0.08, 2.0), lit).moved(0, 0.36),
        box((0.05, 0.8, 2.0), WHITE).moved(-width / 2),
        box((0.05, 0.8, 2.0), WHITE).moved(width / 2),
        box((width - 0.11, 0.79, 0.22), GREY),
        box((width - 0.11, 0.7, 0.14), WHITE).moved(0, 0, 1.85),
    ]
    for level in range(5):
        z = 0.24 + 0.32 * level
        parts.append(box((width - 0.06, 0.5, 0.02), METAL).moved(0, 0.1, z))
        row = _row_of_goods(rng, width - 0.1, 0.5, z + 0.02, 0.27)
        parts += [good.moved(0, 0.1) for good in row]
    return join(parts)


def table(width: float, depth: float, height: float, top: Material, leg: Material = METAL) -> Mesh:
    """A table on four legs."""
    board = rounded_box((width, depth, 0.035), 0.006, top).moved(z=height - 0.035)
    x, y = width / 2 - 0.07, depth / 2 - 0.07
    legs = [
        box((0.05, 0.05, height - 0.035), leg).moved(sx * x, sy * y)
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    apron = box((width - 0.16, 0.02, 0.07), leg).moved(0, -y, height - 0.105)
    return join([board, *legs, apron, apron.moved(0, 2 * y)])


def office_chair(rng: Rng) -> Mesh:
    """A swivel chair on a five-star base."""
    cloth = Material("fabric", (0.07, 0.1, 0.17), tile_m=0.12)
    parts = [
        rounded_box((0.48, 0.46, 0.08), 0.035, cloth).moved(z=0.44),
        rounded_box((0.44, 0.06, 0.5), 0.03, cloth)
        .turned(rotation((1, 0, 0), -0.12))
        .moved(0, 0.24, 0.56),
        box((0.05, 0.03, 0.2), BLACK).moved(0, 0.25, 0.42),
        cylinder(0.028, 0.3, METAL).moved(z=0.14),
    ]
    for k in range(5):
        spoke = box((0.29, 0.045, 0.035), BLACK).moved(0.155, 0, 0.075)
        wheel = cylinder(0.03, 0.04, BLACK, sides=14).turned(rotation((1, 0, 0), np.pi / 2))
        parts.append(join([spoke, wheel.moved(0.29, 0.02, 0.03)]).moved(yaw=2 * np.pi * k / 5))
    return join(parts)


def sofa(width: float) -> Mesh:
    """A sofa with two seat cushions and two throw pillows."""
    cloth = Material("fabric", (0.2, 0.23, 0.25), tile_m=0.12)
    pillow = Material("fabric", (0.62, 0.33, 0.12), tile_m=0.1)
    half = width / 2
    parts = [
        rounded_box((width, 0.86, 0.3), 0.05, cloth).moved(z=0.08),
        rounded_box((width, 0.22, 0.72), 0.08, cloth).moved(0, 0.33, 0.1),
        rounded_box((0.2, 0.86, 0.5), 0.07, cloth).moved(-half + 0.1, 0, 0.1),
        rounded_box((0.2, 0.86, 0.5), 0.07, cloth).moved(half - 0.1, 0, 0.1),
    ]
    for side in (-1, 1):
        seat = rounded_box((half - 0.22, 0.62, 0.16), 0.06, cloth)
        parts.append(seat.moved(side * (half - 0.2) / 2, -0.1, 0.34))
        leg = cylinder(0.025, 0.09, DARK_WOOD).moved(side * (half - 0.1), -0.36)
        parts.append(leg)
    throw = rounded_box((0.42, 0.14, 0.4), 0.07, pillow).turned(rotation((1, 0, 0), -0.3))
    parts += [throw.moved(-half + 0.46, 0.14, 0.48), throw.moved(half - 0.5, 0.12, 0.48, yaw=0.3)]
    return join(parts)


def bookcase(rng: Rng, width: float, levels: int = 5) -> Mesh:
    """A bookcase with books, some lying, and a few boxes."""
    depth, pitch = 0.3, 0.36
    height = levels * pitch + 0.06
    parts = [box((width, 0.015, height), WOOD).moved(0, depth / 2)]
    for side in (-1, 1):
        parts.append(box((0.022, depth, height), WOOD).moved(side * width / 2))
    for level in range(levels + 1):
        parts.append(box((width, depth, 0.022), WOOD).moved(0, 0, 0.04 + level * pitch))
    for level in range(levels):
        parts += _row_of_books(rng, width, depth, 0.062 + level * pitch, pitch - 0.05)
    return join(parts)


def _row_of_books(rng: Rng, width: float, depth: float, z: float, room: float) -> list[Mesh]:
    parts, x, end = [], -width / 2 + 0.02, width / 2 - 0.03
    while x < end:
        if rng.random() < 0.06:
            x += float(rng.uniform(0.04, 0.16))
            continue
        thick = min(float(rng.uniform(0.016, 0.05)), end - x)
        if thick < 0.012:
            break
        height = room * float(rng.uniform(0.62, 0.96))
        spine = Material(f"spine:{rng.integers(0, 40)}", gloss=0.04)
        body = Material("plain", (0.8, 0.78, 0.7))
        book = box((thick, 0.19, height), body, faces={"front": spine})
        parts.append(book.moved(x + thick / 2, -0.03 + float(rng.uniform(-0.02, 0.01)), z))
        x += thick + 0.001
    return parts


def cabinet(width: float, depth: float, height: float, doors: int, material: Material) -> Mesh:
    """A cabinet with doors and handles."""
    parts = [box((width, depth, height - 0.06), material).moved(z=0.06)]
    parts.append(box((width - 0.06, depth - 0.05, 0.06), BLACK))
    each = width / doors
    for k in range(doors):
        x = -width / 2 + each * (k + 0.5)
        door = box((each - 0.012, 0.016, height - 0.1), material)
        parts.append(door.moved(x, -depth / 2 - 0.008, 0.08))
        handle = box((0.012, 0.025, 0.14), METAL)
        side = 1 if k % 2 == 0 else -1
        parts.append(handle.moved(x + side * (each / 2 - 0.05), -depth / 2 - 0.025, height * 0.55))
    return join(parts)


def door(width: float = 0.9, height: float = 2.05) -> Mesh:
    """A closed door with frame and handle, for a wall behind it."""
    leaf = Material("laminate", (0.72, 0.62, 0.5), tile_m=1.4, gloss=0.04)
    frame = Material("plain", (0.42, 0.42, 0.42))
    parts = [
        box((width, 0.04, height), leaf),
        box((0.07, 0.07, height + 0.07), frame).moved(-width / 2 - 0.03),
        box((0.07, 0.07, height + 0.07), frame).moved(width / 2 + 0.03),
        box((width + 0.13, 0.07, 0.07), frame).moved(z=height),
        box((0.13, 0.05, 0.022), METAL).moved(width / 2 - 0.13, -0.04, 1.0),
        box((0.02, 0.012, 0.3), METAL).moved(width / 2 - 0.08, -0.022, 0.88),
    ]
    return join(parts)


def plant(rng: Rng, height: float = 1.2) -> Mesh:
    """A potted plant with long leaves."""
    pot = Material("concrete", (0.8, 0.74, 0.68), tile_m=0.4)
    soil = Material("concrete", (0.14, 0.1, 0.07), tile_m=0.1)
    leaf = Material("foliage")
    parts = [cylinder(0.13, 0.28, pot, top=soil, top_radius=0.17)]
    for _ in range(26):
        angle, lean = float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(0.15, 0.5))
        long = height * float(rng.uniform(0.45, 1.0)) - 0.2
        t = np.linspace(0, 1, 9)
        out, up = lean * t**1.6, 0.26 + long * (t - 0.35 * t**3 * lean * 2)
        half = 0.035 * np.sin(np.pi * np.clip(t, 0.03, 0.99)) ** 0.7
        line = np.stack([out, np.zeros_like(t), up], axis=1)
        across = np.array([0, 1, 0])
        blade = np.stack([line - half[:, None] * across, line + half[:, None] * across], axis=1)
        parts.append(surface(blade, leaf).moved(yaw=angle))
    return join(parts)


def floor_lamp() -> Mesh:
    """A floor lamp with a lit shade."""
    shade = Material("fabric", (1.0, 0.86, 0.62), tile_m=0.1, emission=0.9)
    parts = [
        cylinder(0.14, 0.025, BLACK),
        cylinder(0.012, 1.35, METAL, sides=12),
        cylinder(0.2, 0.26, shade, top_radius=0.15).moved(z=1.3),
    ]
    return join(parts)


def bin_with_bag() -> Mesh:
    """A waste bin."""
    body = Material("plain", (0.16, 0.18, 0.2), gloss=0.08)
    inside = Material("plain", (0.02, 0.02, 0.02))
    return join([cylinder(0.12, 0.32, body, top=inside, top_radius=0.155, sides=28)])


def fire_extinguisher() -> Mesh:
    """A red extinguisher with hose."""
    red = Material("plain", (0.6, 0.02, 0.02), gloss=0.3, mirror=0.03, blur=0.08)
    label = Material("paper:7", (0.95, 0.95, 0.9))
    body = lathe([(0.07, 0), (0.075, 0.02), (0.075, 0.4), (0.03, 0.47), (0.03, 0.5)], red)
    t = np.linspace(0, 1, 24)
    path = np.stack([0.03 + 0.09 * np.sin(np.pi * t), -0.05 * t, 0.5 - 0.34 * t], axis=1)
    sheet = quad(
        [[-0.04, -0.077, 0.16], [0.04, -0.077, 0.16], [0.04, -0.077, 0.3], [-0.04, -0.077, 0.3]],
        label,
    )
    valve = box((0.05, 0.03, 0.05), BLACK).moved(z=0.5)
    return join([body, tube(path, 0.009, BLACK), sheet, valve])


def laptop() -> Mesh:
    """An open laptop with a lit screen."""
    case = Material("metal", (0.5, 0.5, 0.52), tile_m=0.4, gloss=0.15)
    keys = Material("keyboard")
    lit = Material("paper:11", (0.8, 0.85, 0.95), emission=0.5)
    base = box((0.32, 0.22, 0.016), case, faces={"top": keys})
    lid = box((0.32, 0.008, 0.21), case, faces={"front": lit}).turned(rotation((1, 0, 0), -0.3))
    return join([base, lid.moved(0, 0.11, 0.014)])


def cardboard_box(width: float, depth: float, height: float) -> Mesh:
    """A closed carton with tape."""
    board = Material("laminate", (0.62, 0.45, 0.28), tile_m=0.5)
    tape = Material("plain", (0.66, 0.56, 0.36), gloss=0.15)
    strip = box((0.05, depth + 0.002, 0.001), tape).moved(z=height)
    front = box((0.05, 0.001, 0.09), tape).moved(0, -depth / 2 - 0.001, height - 0.09)
    return join([box((width, depth, height), board), strip, front])


def mug(tint: tuple[float, float, float]) -> Mesh:
    """A mug, 9 cm high."""
    glaze = Material("plain", tint, gloss=0.3)
    coffee = Material("plain", (0.05, 0.025, 0.012), mirror=0.05)
    t = np.linspace(-1.4, 1.4, 14)
    ring = np.stack(
        [0.036 + 0.022 * np.cos(t), np.zeros_like(t), 0.045 + 0.026 * np.sin(t)], axis=1
    )
    ring[:, 1] = 1e-4 * np.arange(len(t))
    return join([cylinder(0.038, 0.09, glaze, top=coffee), tube(ring, 0.005, glaze)])
