"""The four workspaces of the paper: convenience store, conference room, living room, hallway.

A room is static geometry, its lamps, the wall-following path of the robot, and the footprints that
make the occupancy map. The robot drives at z = 0; x and y are the map's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from reviewer.demo import furniture as f
from reviewer.demo.renderer import Light
from reviewer.demo.shapes import Material, Mesh, box, join, quad, rounded_box

Rng = np.random.Generator
HEIGHT = 2.6


@dataclass(frozen=True, slots=True)
class Room:
    """A workspace.

    Attributes:
        mesh: everything that never moves.
        lights: lamps and windows.
        ambient: linear RGB light from everywhere.
        size: extent (x, y) in metres, from (0, 0).
        path: (N, 2) way points of the robot, metres.
        gaze: how far left of its way the camera looks, radians.
    """

    mesh: Mesh
    lights: tuple[Light, ...]
    ambient: tuple[float, float, float]
    size: tuple[float, float]
    path: tuple[tuple[float, float], ...]
    gaze: float


def convenience_store(rng: Rng) -> Room:
    """Two rows of gondolas, a chilled wall, bright panels, a shiny tiled floor."""
    size = (7.2, 6.0)
    floor = Material("floor_tile", tile_m=0.6, mirror=0.14, blur=0.02)
    parts = [_shell(size, floor, Material("plaster", tile_m=2.0))]
    for y in (1.75, 3.75):
        for k in range(4):
            x = 1.5 + 1.02 * k + 0.51
            parts.append(f.shelf_of_goods(rng, 1.0).moved(x, y - 0.21))
            parts.append(f.shelf_of_goods(rng, 1.0).moved(x, y + 0.21, yaw=np.pi))
    for k in range(3):
        parts.append(f.refrigerator(rng, 1.7).moved(1.6 + 1.78 * k, size[1] - 0.42))
    for k in range(5):
        parts.append(f.shelf_of_goods(rng, 1.0).moved(1.2 + 1.02 * k, 0.24, yaw=np.pi))
    parts.append(f.cabinet(1.4, 0.6, 0.95, 3, f.WHITE).moved(6.8, 2.4, yaw=-np.pi / 2))
    parts.append(f.bin_with_bag().moved(6.9, 4.2))
    for box_x, box_y in ((0.35, 4.9), (0.4, 4.45)):
        parts.append(f.cardboard_box(0.45, 0.35, 0.3).moved(box_x, box_y, yaw=0.2))
    parts.append(f.cabinet(1.5, 0.3, 0.62, 3, f.LAMINATE).moved(0.17, 3.5, yaw=np.pi / 2))
    for k in range(3):
        notice = box((0.45, 0.015, 0.62), f.GREY, faces={"front": Material(f"poster:{30 + k}")})
        parts.append(notice.moved(0.02, 2.95 + 0.56 * k, 0.78, yaw=np.pi / 2))
    lights = _ceiling_panels(size, rows=1, columns=3, half=(2.7, 0.1), power=(1.7, 1.72, 1.7))
    path = ((0.75, 0.95), (6.1, 0.95), (6.1, 2.75), (0.8, 2.75), (0.8, 4.75), (6.2, 4.75))
    return Room(join([*parts, _panels(lights)]), lights, (0.3, 0.31, 0.32), size, path, 0.42)


def conference_room(rng: Rng) -> Room:
    """A long table with chairs, whiteboard, blinds, a carpet."""
    size = (7.6, 5.6)
    floor = Material("carpet", tile_m=1.0)
    parts = [_shell(size, floor, Material("plaster", (0.95, 0.95, 0.93), tile_m=2.0))]
    parts.append(f.table(3.6, 1.25, 0.72, f.LAMINATE).moved(3.8, 2.75))
    for k in range(4):
        turn = float(rng.uniform(-0.5, 0.5))
        parts.append(f.office_chair(rng).moved(2.5 + 0.88 * k, 1.78, yaw=np.pi + turn))
        turn = float(rng.uniform(-0.5, 0.5))
        parts.append(f.office_chair(rng).moved(2.5 + 0.88 * k, 3.74, yaw=turn))
    parts.append(f.laptop().moved(3.2, 2.6, 0.72, yaw=2.9))
    parts.append(f.laptop().moved(4.6, 2.95, 0.72, yaw=0.2))
    parts.append(f.mug((0.55, 0.1, 0.08)).moved(3.7, 2.45, 0.72))
    board = Material("whiteboard", mirror=0.03, blur=0.05)
    parts.append(box((2.4, 0.03, 1.2), f.METAL, faces={"front": board}).moved(3.6, 5.56, 0.85))
    parts.append(f.cabinet(1.6, 0.45, 0.85, 4, f.WHITE).moved(0.26, 3.9, yaw=np.pi / 2))
    parts.append(f.cabinet(1.2, 0.42, 0.75, 3, f.LAMINATE).moved(7.36, 1.3, yaw=-np.pi / 2))
    screen = Material("screen:9", (0.12, 0.12, 0.14), mirror=0.06)
    parts.append(
        box((1.3, 0.05, 0.75), f.BLACK, faces={"front": screen}).moved(
            7.53, 2.8, 1.1, yaw=-np.pi / 2
        )
    )
    parts += _blinds(1.2, 6.4, 0.02)
    parts.append(f.door().moved(0.9, 5.56))
    parts.append(f.bin_with_bag().moved(6.9, 5.2))
    parts.append(f.plant(rng, 1.4).moved(0.4, 0.45))
    parts.append(f.cardboard_box(0.4, 0.3, 0.26).moved(7.2, 4.3, yaw=0.5))
    lights = (
        *_ceiling_panels(size, rows=1, columns=2, half=(1.2, 0.3), power=(2.1, 2.07, 1.96)),
        Light((3.8, 0.12, 1.5), (2.6, 0, 0), (0, 0, 0.6), (0.4, 0.45, 0.54)),
    )
    path = ((1.0, 0.9), (6.7, 0.9), (6.7, 4.75), (1.1, 4.75), (1.1, 1.6))
    return Room(join([*parts, _panels(lights[:2])]), lights, (0.25, 0.26, 0.275), size, path, 0.45)


def living_room(rng: Rng) -> Room:
    """Sofa, rug, low table, bookcase, warm lamp, parquet."""
    size = (6.4, 5.4)
    floor = Material("parquet", tile_m=1.1, mirror=0.05, blur=0.05)
    parts = [_shell(size, floor, Material("wallpaper", tile_m=1.5))]
    rug = Material("rug")
    parts.append(
        quad([[1.9, 1.5, 0.006], [4.5, 1.5, 0.006], [4.5, 3.5, 0.006], [1.9, 3.5, 0.006]], rug)
    )
    parts.append(f.sofa(2.1).moved(3.2, 4.1))
    parts.append(f.table(1.15, 0.6, 0.4, f.DARK_WOOD, f.DARK_WOOD).moved(3.2, 2.55))
    parts.append(f.mug((0.1, 0.25, 0.4)).moved(2.85, 2.6, 0.4))
    for k in range(3):
        book = box((0.17, 0.23, 0.022), f.WHITE, faces={"top": Material(f"poster:{20 + k}")})
        parts.append(book.moved(3.45, 2.52, 0.4 + 0.022 * k, yaw=0.2 * k))
    for k in range(3):
        parts.append(f.bookcase(rng, 0.9).moved(6.2, 1.2 + 0.93 * k, yaw=-np.pi / 2))
    parts.append(f.cabinet(1.8, 0.42, 0.45, 3, f.WOOD).moved(3.2, 0.26, yaw=np.pi))
    screen = Material("poster:3", (0.16, 0.16, 0.18), mirror=0.07)
    parts.append(
        box((1.25, 0.05, 0.72), f.BLACK, faces={"front": screen}).moved(3.2, 0.24, 0.52, yaw=np.pi)
    )
    parts.append(f.floor_lamp().moved(1.55, 4.7))
    parts.append(f.plant(rng, 1.5).moved(0.5, 4.8))
    parts.append(f.plant(rng, 0.9).moved(5.9, 4.9))
    for k, x in enumerate((2.6, 3.4)):
        frame = Material(f"poster:{k}")
        parts.append(
            box((0.6, 0.03, 0.6), f.BLACK, faces={"front": frame}).moved(x + 0.1, 5.37, 1.3)
        )
    cloth = Material("curtain", tile_m=1.0)
    for y in (1.0, 2.9):
        parts.append(box((0.08, 0.7, 2.2), cloth).moved(0.07, y, 0.15))
    parts.append(f.cardboard_box(0.36, 0.28, 0.22).moved(0.5, 0.5, yaw=0.7))
    lights = (
        Light((0.1, 1.95, 1.4), (0, 0.75, 0), (0, 0, 0.75), (1.9, 2.0, 2.15)),
        Light((3.2, 2.6, 2.55), (0.35, 0, 0), (0, 0.35, 0), (4.6, 4.2, 3.5)),
        Light((1.55, 4.7, 1.62), (0.16, 0, 0), (0, 0.16, 0), (3.4, 2.5, 1.4)),
    )
    path = ((1.0, 0.95), (5.2, 0.95), (5.2, 3.3), (4.9, 3.3), (1.2, 3.2), (1.0, 1.4))
    return Room(join([*parts, _window(size)]), lights, (0.19, 0.18, 0.165), size, path, 0.4)


def hallway(rng: Rng) -> Room:
    """A long corridor: doors, notices, lockers, a bench, a shiny vinyl floor."""
    size = (14.0, 2.3)
    floor = Material("vinyl", tile_m=1.2, mirror=0.12, blur=0.025)
    wall = Material("plaster", (0.92, 0.94, 0.92), tile_m=2.0)
    parts = [_shell(size, floor, wall)]
    for x in (1.6, 5.2, 9.0, 12.4):
        parts.append(f.door().moved(x, 2.27))
    for x in (3.4, 10.6):
        parts.append(f.door().moved(x, 0.03, yaw=np.pi))
    for k in range(6):
        sheet = box((0.21, 0.004, 0.297), f.WHITE, faces={"front": Material(f"paper:{k}")})
        parts.append(sheet.moved(2.75 + 0.28 * k, 2.285, 1.1 + 0.05 * (k % 3)))
    for k in range(4):
        frame = box((0.5, 0.02, 0.7), f.GREY, faces={"front": Material(f"poster:{k + 10}")})
        parts.append(frame.moved(6.4 + 0.62 * k, 2.28, 0.95))
    for k in range(5):
        parts.append(f.cabinet(0.42, 0.4, 1.75, 1, f.GREY).moved(6.1 + 0.43 * k, 0.24, yaw=np.pi))
    bench = Material("fabric", (0.1, 0.22, 0.2), tile_m=0.12)
    seat = rounded_box((1.3, 0.4, 0.1), 0.04, bench).moved(z=0.36)
    legs = [box((0.05, 0.34, 0.36), f.METAL).moved(x) for x in (-0.55, 0.55)]
    parts.append(join([seat, *legs]).moved(7.1, 2.02))
    parts.append(f.fire_extinguisher().moved(4.4, 2.15))
    parts.append(f.fire_extinguisher().moved(11.6, 0.18, yaw=np.pi))
    parts.append(f.plant(rng, 1.3).moved(8.7, 0.32))
    parts.append(f.bin_with_bag().moved(10.2, 2.08))
    parts.append(f.cardboard_box(0.5, 0.35, 0.32).moved(4.9, 0.25, yaw=0.1))
    parts.append(f.cardboard_box(0.4, 0.3, 0.25).moved(4.86, 0.24, 0.32, yaw=-0.15))
    skirting = box((14.0, 0.012, 0.09), f.GREY)
    parts += [skirting.moved(7.0, 0.008), skirting.moved(7.0, 2.292)]
    lights = _ceiling_panels(size, rows=3, columns=1, half=(1.3, 0.1), power=(2.6, 2.6, 2.45))
    return Room(
        join([*parts, _panels(lights)]),
        lights,
        (0.23, 0.235, 0.23),
        size,
        ((0.7, 1.0), (13.2, 1.0), (13.2, 1.35), (0.8, 1.35)),
        0.3,
    )


WORKSPACES: dict[str, Callable[[Rng], Room]] = {
    "cs": convenience_store,
    "cr": conference_room,
    "lr": living_room,
    "hw": hallway,
}


def _shell(size: tuple[float, float], floor: Material, wall: Material) -> Mesh:
    x, y = size
    z = HEIGHT
    ceiling = Material("ceiling", tile_m=0.6)
    flat = (x / floor.tile_m, y / floor.tile_m)
    along, across = (x / wall.tile_m, z / wall.tile_m), (y / wall.tile_m, z / wall.tile_m)
    return join(
        [
            quad([[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]], floor, tiles=flat),
            quad([[0, y, z], [x, y, z], [x, 0, z], [0, 0, z]], ceiling, tiles=(x / 0.6, y / 0.6)),
            quad([[x, 0, 0], [0, 0, 0], [0, 0, z], [x, 0, z]], wall, tiles=along),
            quad([[0, y, 0], [x, y, 0], [x, y, z], [0, y, z]], wall, tiles=along),
            quad([[0, 0, 0], [0, y, 0], [0, y, z], [0, 0, z]], wall, tiles=across),
            quad([[x, y, 0], [x, 0, 0], [x, 0, z], [x, y, z]], wall, tiles=across),
        ]
    )


def _ceiling_panels(
    size: tuple[float, float],
    *,
    rows: int,
    columns: int,
    half: tuple[float, float],
    power: tuple[float, float, float],
) -> tuple[Light, ...]:
    return tuple(
        Light(
            (size[0] * (r + 0.5) / rows, size[1] * (c + 0.5) / columns, HEIGHT - 0.02),
            (half[0], 0, 0),
            (0, half[1], 0),
            power,
        )
        for r in range(rows)
        for c in range(columns)
    )


def _panels(lights: tuple[Light, ...]) -> Mesh:
    """The visible panes of ceiling lamps, just above the light they give."""
    glow = Material("plain", emission=4.0)
    panes = []
    for light in lights:
        (x, y, z), a, b = light.centre, light.side_a[0], light.side_b[1]
        z += 0.012
        corners = [[x - a, y + b, z], [x + a, y + b, z], [x + a, y - b, z], [x - a, y - b, z]]
        panes.append(quad(corners, glow))
    return join(panes)


def _window(size: tuple[float, float]) -> Mesh:
    sky = Material("plain", (0.8, 0.9, 1.0), emission=2.2)
    frame = Material("plain", (0.8, 0.8, 0.78))
    x = 0.03
    pane = quad([[x, 1.2, 0.65], [x, 2.7, 0.65], [x, 2.7, 2.15], [x, 1.2, 2.15]], sky)
    bars = [box((0.06, 0.05, 1.6), frame).moved(0.05, y, 0.6) for y in (1.2, 1.95, 2.7)]
    sill = box((0.2, 1.7, 0.04), frame).moved(0.1, 1.95, 0.6)
    return join([pane, *bars, sill])


def _blinds(start: float, end: float, y: float) -> list[Mesh]:
    sky = Material("plain", (0.85, 0.92, 1.0), emission=1.4)
    slat = Material("plain", (0.82, 0.82, 0.8))
    pane = quad([[end, y, 0.9], [start, y, 0.9], [start, y, 2.1], [end, y, 2.1]], sky)
    width = end - start
    slats = [
        box((width, 0.012, 0.03), slat).moved((start + end) / 2, y + 0.03, 0.9 + 0.055 * k)
        for k in range(22)
    ]
    return [pane, *slats]
