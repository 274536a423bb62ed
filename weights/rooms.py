"""Rooms that nobody has built: true parallax and true occlusion to learn from.

    python weights/rooms.py DATA [--pairs 630] [--seed 0]

Each room has random surfaces (pieces of DATA/backgrounds), furniture (DATA/models) and small things
on it: models, shapes, and the demo's kinds of objects. Two drives see it from viewpoints that lie
nothing to some decimetres apart, under other lights; things have come, gone and moved in between.
DATA/rooms/NNNNN.npz holds what `synthesis.rendered` reads. Rooms are independent: what is there is
not rendered again.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from models import load_model, random_material

from reviewer.demo.furniture import bookcase, office_chair, shelf_of_goods, table
from reviewer.demo.objects import GROUPS
from reviewer.demo.renderer import Camera, Light, Rendering, Scene
from reviewer.demo.sensor import Exposure, develop
from reviewer.demo.shapes import Material, Mesh, box, cylinder, join, quad, rounded_box
from reviewer.demo.texture_library import MAKERS
from reviewer.demo.textures import SIDE
from reviewer.models.warping import targets
from reviewer.synthesis.rendered import RenderedViews, save_rendered
from reviewer.synthesis.shelf import Shelf

Rng = np.random.Generator
Floats = npt.NDArray[np.float32]

WIDTH, HEIGHT = 640, 480
TARGET_LIGHT = 0.16
"""Mean linear light that a camera's exposure aims at."""
CAME, WENT, MOVED, STAYED = "came", "went", "moved", "stayed"
LEAST_PX = 12


@dataclass
class Place:
    """A room under construction: its shell, and things with how they fare between the drives."""

    size: tuple[float, float, float]
    shell: Mesh
    lights: tuple[Light, ...]
    ambient: tuple[float, float, float]
    furniture: list[Mesh] = field(default_factory=list)
    things: list[tuple[str, Mesh | None, Mesh | None]] = field(default_factory=list)
    """What became of it, and where it stands in the first and in the second drive."""

    def scene(self, second: bool, lights: Sequence[Light]) -> tuple[Scene, list[str]]:
        """Return a drive's scene and what became of each of its parts."""
        parts, fates = [self.shell, *self.furniture], [STAYED] * (1 + len(self.furniture))
        for fate, before, after in self.things:
            mesh = after if second else before
            if mesh is not None:
                parts.append(mesh)
                fates.append(fate)
        return Scene(parts, lights, self.ambient), fates


def photo_textures(backgrounds: Sequence[npt.NDArray[np.uint8]]) -> None:
    """Let materials ask for pieces of photographs, as `photo:17`."""

    def piece(rng: Rng) -> npt.NDArray[np.uint8]:
        picture = backgrounds[int(rng.integers(len(backgrounds)))]
        shortest = min(picture.shape[:2])
        cut = int(rng.uniform(0.25, 1.0) * shortest)
        top, left = (int(rng.integers(0, n - cut + 1)) for n in picture.shape[:2])
        part = picture[top : top + cut, left : left + cut]
        return np.asarray(cv2.resize(part, (SIDE, SIDE), interpolation=cv2.INTER_AREA), np.uint8)

    MAKERS["photo"] = piece


def build(models: Sequence[Path], rng: Rng) -> Place:
    """Put up a room with furniture; small things come later, where the camera looks."""
    size = (float(rng.uniform(2.5, 7)), float(rng.uniform(2.5, 7)), float(rng.uniform(2.3, 3.2)))
    x, y, z = size
    floor, walls, ceiling = (random_material(rng) for _ in range(3))

    def face(corners: list[list[float]], material: Material, tiles: tuple[float, float]) -> Mesh:
        chosen = random_material(rng) if rng.random() < 0.3 else material
        return quad(corners, chosen, tiles=tiles)

    along, across = (x / walls.tile_m, z / walls.tile_m), (y / walls.tile_m, z / walls.tile_m)
    flat = (x / floor.tile_m, y / floor.tile_m)
    shell = join(
        [
            quad([[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]], floor, tiles=flat),
            quad([[0, y, z], [x, y, z], [x, 0, z], [0, 0, z]], ceiling, tiles=flat),
            face([[x, 0, 0], [0, 0, 0], [0, 0, z], [x, 0, z]], walls, along),
            face([[0, y, 0], [x, y, 0], [x, y, z], [0, y, z]], walls, along),
            face([[0, 0, 0], [0, y, 0], [0, y, z], [0, 0, z]], walls, across),
            face([[x, y, 0], [x, 0, 0], [x, 0, z], [x, y, z]], walls, across),
        ]
    )
    grey = float(rng.uniform(0.12, 0.5))
    place = Place(size, shell, _lamps(size, rng), (grey, grey * float(rng.uniform(0.9, 1.1)), grey))
    for _ in range(int(rng.integers(3, 11))):
        mesh = _furniture(models, rng)
        if mesh is not None:
            at = rng.uniform(0.1, 0.9, 2) * (x, y)
            place.furniture.append(mesh.moved(*(float(v) for v in at), yaw=_turn(rng)))
    return place


def _turn(rng: Rng) -> float:
    return float(rng.uniform(0, 2 * math.pi))


def _lamps(size: tuple[float, float, float], rng: Rng) -> tuple[Light, ...]:
    warm = float(rng.normal(0, 0.12))
    lamps = []
    for _ in range(int(rng.integers(1, 4))):
        power = float(rng.uniform(0.6, 3.0))
        colour = (power * (1 + warm), power, power * (1 - warm))
        a, b = (float(v) for v in rng.uniform(0.05, 0.9, 2))
        x, y = (float(v) for v in rng.uniform(0.15, 0.85, 2) * size[:2])
        lamps.append(Light((x, y, size[2] - 0.02), (a, 0, 0), (0, b, 0), colour))
    return tuple(lamps)


def _furniture(models: Sequence[Path], rng: Rng) -> Mesh | None:
    kind = rng.random()
    if kind < 0.3:
        width, depth, height = (float(v) for v in rng.uniform((0.7, 0.5, 0.4), (1.8, 1.0, 0.95)))
        return table(width, depth, height, random_material(rng), random_material(rng))
    if kind < 0.42:
        makers: list[Callable[[], Mesh]] = [
            lambda: shelf_of_goods(rng, float(rng.uniform(0.6, 1.2))),
            lambda: bookcase(rng, float(rng.uniform(0.5, 1.2))),
            lambda: office_chair(rng),
        ]
        return makers[int(rng.integers(len(makers)))]()
    if kind < 0.5:
        sides_m = [float(v) for v in rng.uniform(0.25, 1.2, 3)]
        return box(sides_m, random_material(rng))
    return load_model(models[int(rng.integers(len(models)))], float(rng.uniform(0.4, 2.0)), rng)


def _thing(models: Sequence[Path], rng: Rng) -> Mesh | None:
    """Return something small, 2 to 50 cm long."""
    longest = float(np.exp(rng.uniform(np.log(0.02), np.log(0.5))))
    kind = rng.random()
    if kind < 0.25:
        group = GROUPS[int(rng.integers(1, 4))]
        return list(group.values())[int(rng.integers(len(group)))](rng)
    if kind < 0.5:
        material, sides = random_material(rng), rng.uniform(0.08, 1.0, 3) * longest
        if rng.random() < 0.35:
            return cylinder(sides[0] / 2, float(sides[2]), material)
        if rng.random() < 0.5:
            return rounded_box([float(v) for v in sides], float(0.2 * sides.min()), material)
        front = {"top": random_material(rng), "front": random_material(rng)}
        return box([float(v) for v in sides], material, faces=front)
    return load_model(models[int(rng.integers(len(models)))], longest, rng)


def viewpoints(place: Place, rng: Rng) -> tuple[Camera, Camera]:
    """Return the cameras of the two drives, some at the very same place."""
    x, y, z = place.size
    at = np.array([*(rng.uniform(0.12, 0.88, 2) * (x, y)), rng.uniform(0.35, min(1.7, z - 0.3))])
    towards = np.array([*(rng.uniform(0.25, 0.75, 2) * (x, y)), rng.uniform(0.1, 1.0)])
    way = towards - at
    yaw = math.atan2(way[1], way[0])
    pitch = float(np.clip(math.atan2(way[2], np.hypot(way[0], way[1])), -1.2, 0.1))
    focal = float(rng.uniform(360, 760))
    first = Camera(_point(at), yaw, pitch, WIDTH, HEIGHT, focal)
    step = float(rng.choice([0.0, 0.01, 0.04, 0.1, 0.2]))
    turn = rng.normal(0, 1, 2) * step * 0.35
    moved = at + rng.normal(0, 1, 3) * (step, step, 0.3 * step)
    moved[:2] = np.clip(moved[:2], 0.05, np.array([x, y]) - 0.05)
    second = replace(
        first, position=_point(moved),
        yaw=yaw + float(turn[0]), pitch=pitch + float(turn[1]),
    )  # fmt: skip
    return first, second


def _point(place: npt.NDArray[np.floating]) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in place)
    return x, y, z


def furnish(place: Place, camera: Camera, models: Sequence[Path], rng: Rng) -> None:
    """Put small things where a camera looks, and decide what becomes of each."""
    scene, _ = place.scene(False, place.lights)

    def spot() -> npt.NDArray[np.float32] | None:
        x = rng.uniform(30, WIDTH - 30, 60).astype(np.float32)
        y = rng.uniform(30, HEIGHT - 30, 60).astype(np.float32)
        points, normals, numbers = scene.pick(camera, x, y)
        away = np.linalg.norm(points - np.asarray(camera.position, np.float32), axis=1)
        level = (numbers >= 0) & (normals[:, 2] > 0.95) & (away > 0.3) & (away < 3.5)
        return points[np.argmax(level)] if level.any() else None

    for _ in range(int(rng.integers(3, 16))):
        mesh, here = _thing(models, rng), spot()
        if mesh is None or here is None:
            continue
        stands = mesh.moved(*(float(v) for v in here), yaw=_turn(rng))
        fate = str(rng.choice([CAME, WENT, MOVED, STAYED], p=[0.3, 0.18, 0.1, 0.42]))
        before = None if fate == CAME else stands
        after = None if fate == WENT else stands
        if fate == MOVED:
            there = spot()
            if there is None:
                continue
            after = mesh.moved(*(float(v) for v in there), yaw=_turn(rng))
        place.things.append((fate, before, after))
    if place.furniture and rng.random() < 0.2:
        large = place.furniture.pop(int(rng.integers(len(place.furniture))))
        came = bool(rng.random() < 0.5)
        place.things.append((CAME, None, large) if came else (WENT, large, None))


def render(place: Place, cameras: tuple[Camera, Camera], rng: Rng) -> RenderedViews | None:
    """Render both drives; None where one of them sees next to nothing."""
    scenes = [place.scene(second, _at_another_hour(place.lights, rng)) for second in (False, True)]
    past, present = (
        scene.render(camera, rng) for (scene, _), camera in zip(scenes, cameras, strict=True)
    )
    if min(float(np.median(view.distance)) for view in (past, present)) < 0.25:
        return None
    flow, distance = _flow(present, *cameras)
    x, y = (np.round(v).astype(np.int32) for v in targets(flow))
    inside = (x >= 0) & (x < WIDTH) & (y >= 0) & (y < HEIGHT)
    columns, rows = np.clip(x, 0, WIDTH - 1), np.clip(y, 0, HEIGHT - 1)
    hidden = past.object_number[rows, columns]
    same_depth = np.abs(past.distance[rows, columns] - distance) < 0.02 * distance + 0.004
    changed = [np.array([fate != STAYED for fate in fates]) for _, fates in scenes]
    came = np.where(changed[1][present.object_number], present.object_number, 0)
    went = np.where(changed[0][past.object_number], past.object_number, 0)
    left = np.where(inside & (came == 0) & changed[0][hidden], hidden, 0)
    seen = inside & (same_depth | (came > 0) | (left > 0))
    stands = np.where(changed[1][present.object_number], 0, present.object_number)
    reference, live = (develop(view.light, _exposure(view, rng), rng) for view in (past, present))
    numbers = [labels.astype(np.uint8) for labels in (came, went, left, stands)]
    return RenderedViews(reference, live, flow.astype(np.float16), seen, *numbers)


def _flow(present: Rendering, first: Camera, second: Camera) -> tuple[Floats, Floats]:
    """Return the flow (H, W, 2) from the second view to the first, and the distance there."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    rays = second.rays(x.ravel().astype(np.float32), y.ravel().astype(np.float32))
    points = np.asarray(second.position) + rays * present.distance.reshape(-1, 1)
    forward, right, up = first.axes()
    away = points - np.asarray(first.position)
    depth = np.maximum(away @ forward, 1e-3)
    across = first.focal * (away @ right) / depth + WIDTH / 2 - x.ravel()
    down = -first.focal * (away @ up) / depth + HEIGHT / 2 - y.ravel()
    flow = np.stack([across, down], axis=1).reshape(HEIGHT, WIDTH, 2)
    return np.clip(flow, -2000, 2000), np.linalg.norm(away, axis=1).reshape(HEIGHT, WIDTH)


def _at_another_hour(lights: Sequence[Light], rng: Rng) -> list[Light]:
    reach = float(rng.uniform(0, 0.35))
    changed = []
    for light in lights:
        x, y, z = light.centre
        dx, dy = rng.normal(0, reach, 2)
        red, green, blue = (float(v) for v in np.array(light.power) * rng.uniform(0.6, 1.5))
        changed.append(
            replace(light, centre=(x + float(dx), y + float(dy), z), power=(red, green, blue))
        )
    return changed


def _exposure(view: Rendering, rng: Rng) -> Exposure:
    gain = TARGET_LIGHT / max(float(view.light.mean()), 1e-3) * float(rng.uniform(0.7, 1.5))
    return Exposure(gain * 1.6, (1.0, 1.0, 1.0), noise=0.0)


def make_room(models: Sequence[Path], seed: Sequence[int]) -> RenderedViews:
    """Return two views of a room; a room whose camera stands before a wall is built again."""
    rng = np.random.default_rng(seed)
    while True:
        place = build(models, rng)
        cameras = viewpoints(place, rng)
        furnish(place, cameras[1], models, rng)
        views = render(place, cameras, rng)
        if views is not None and np.count_nonzero(views.came | views.left) >= LEAST_PX:
            return views


def render_file(data: Path, path: Path, models: Sequence[Path], seed: Sequence[int]) -> None:
    """Render a room into a file; what is there stays."""
    if path.exists():
        return
    cv2.setNumThreads(1)
    photo_textures(Shelf(sorted((data / "backgrounds").glob("*.jpg"))))
    save_rendered(path, make_room(models, seed))


def main() -> None:
    """Render rooms, as many at a time as there are processors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--pairs", type=int, default=630)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    models = sorted((given.data / "models").rglob("*.obj"))
    folder = given.data / "rooms"
    folder.mkdir(exist_ok=True)
    with ProcessPoolExecutor() as pool:
        jobs = [
            pool.submit(render_file, given.data, folder / f"{k:05}.npz", models, [given.seed, k])
            for k in range(given.pairs)
        ]
        for job in jobs:
            job.result()


if __name__ == "__main__":
    main()
