"""Drive the demo world: place objects, drive twice, write images, masks, poses and the map.

The result is twelve folders in the `sequence` layout that `reviewer import` reads:
`reference/*.png`, `live/*.png`, `mask/*.png` (255 = changed), `poses.csv`, `map.yaml`, `map.pgm`.
Two drives differ as they do in life: pose, exposure, light, shadows, sensor noise, and the objects
that were left behind. Everything follows from the seed.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import yaml

from reviewer.dataset.files import write_png
from reviewer.demo.objects import GROUPS, VIEWING_RANGE
from reviewer.demo.renderer import Camera, Light, Scene
from reviewer.demo.rooms import WORKSPACES, Room
from reviewer.demo.sensor import Exposure, develop
from reviewer.demo.shapes import Mesh
from reviewer.geometry import Pose2, wrap_angle
from reviewer.masks import encode_png

Rng = np.random.Generator
Place = npt.NDArray[np.float32]

CAMERA_HEIGHT = 0.72
CAMERA_PITCH = -0.42
MAP_RESOLUTION = 0.05
SMALLEST_CHANGE_PX = 12
TARGET_SPACING = 1.8  # metres of the way between two viewpoints before which objects are left
LEAST_DISTANCE = 0.35  # metres between two objects

PAPER_PAIRS = {
    "cs1": 207, "cs2": 169, "cs3": 122, "cr1": 314, "cr2": 214, "cr3": 131,
    "lr1": 158, "lr2": 117, "lr3": 82, "hw1": 142, "hw2": 117, "hw3": 102,
}  # fmt: skip
"""Pairs a split at full size: 1875 in all, 82 to 314 a split as in the paper; which split has how
many is not published, these numbers are ours."""


@dataclass(frozen=True, slots=True)
class SplitPlan:
    """What to render for one split."""

    name: str
    pairs: int
    seed: int


def plan_splits(pairs_per_split: int | None, seed: int) -> list[SplitPlan]:
    """Return the twelve plans; None stands for the paper's sizes."""
    return [SplitPlan(name, pairs_per_split or pairs, seed) for name, pairs in PAPER_PAIRS.items()]


def render_world(
    folder: Path, plans: list[SplitPlan], *, workers: int
) -> Iterator[tuple[str, int]]:
    """Render splits into `folder`/<split>, yielding (split, pairs) as each is finished.

    A split whose folder is complete is not rendered again.
    """
    todo = []
    for plan in plans:
        if (folder / plan.name / "complete").exists():
            yield plan.name, plan.pairs
        else:
            todo.append(plan)
    if workers == 1:
        for plan in todo:
            yield render_split(folder / plan.name, plan), plan.pairs
        return
    with ProcessPoolExecutor(workers) as pool:
        jobs = [pool.submit(render_split, folder / plan.name, plan) for plan in todo]
        for job, plan in zip(jobs, todo, strict=True):
            yield job.result(), plan.pairs


@dataclass(frozen=True, slots=True)
class Stage:
    """A split's room, its viewpoints, and the objects: those that stay, and those left behind."""

    room: Room
    reference_poses: list[Pose2]
    live_poses: list[Pose2]
    stay: list[Mesh]
    left: list[Mesh]

    def live_scene(self) -> Scene:
        """The room as the live drive finds it; lights as they are built."""
        return Scene([self.room.mesh, *self.stay, *self.left], self.room.lights, self.room.ambient)


def stage_split(plan: SplitPlan) -> tuple[Stage, Rng]:
    """Place the objects of a split; return them with the random numbers that follow."""
    workspace, group = plan.name[:2], int(plan.name[2])
    # The room is the workspace's own; only what is left behind differs between its splits.
    room = WORKSPACES[workspace](np.random.default_rng([plan.seed, _code(workspace)]))
    rng = np.random.default_rng([plan.seed, _code(plan.name)])
    empty_room = Scene([room.mesh], room.lights, room.ambient)
    stations = [_best_side(empty_room, choices) for choices in _stations(room, plan.pairs)]
    live_poses = [_driven(pose, rng) for pose in stations]
    reference_poses = [_driven(pose, rng) for pose in stations]
    # An odd station in five stays as it was: a reviewer must be able to confirm "no change".
    targets = [k for k in range(len(stations)) if (k + _code(plan.name)) % 5 != 4]
    spacing = _length(room) / len(stations)
    targets = targets[:: max(1, round(TARGET_SPACING / spacing))]
    taken: list[Place] = []
    left = [
        thing
        for k in targets
        for thing in _leave_objects(empty_room, live_poses[k], group, rng, taken)
    ]
    stay = [
        thing
        for k in targets[::3]
        for thing in _leave_objects(empty_room, stations[k], group, rng, taken, count=1)
    ]
    return Stage(room, reference_poses, live_poses, stay, left), rng


def render_split(folder: Path, plan: SplitPlan) -> str:
    """Render one split; return its name."""
    cv2.setNumThreads(1)
    stage, rng = stage_split(plan)
    room, stay, left = stage.room, stage.stay, stage.left
    first = Scene([room.mesh, *stay], _moved_lights(room.lights, rng), room.ambient)
    second = Scene([room.mesh, *stay, *left], _moved_lights(room.lights, rng), room.ambient)
    for name in ("reference", "live", "mask"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    past, present = _exposure(rng), _exposure(rng)
    rows = []
    drives = zip(stage.reference_poses, stage.live_poses, strict=True)
    for k, (before, after) in enumerate(drives):
        name = f"{k:04d}"
        write_png(folder / "reference" / f"{name}.png", _photograph(first, before, past, rng)[0])
        picture, number = _photograph(second, after, present, rng)
        write_png(folder / "live" / f"{name}.png", picture)
        changed = _visible_changes(number, len(stay))
        (folder / "mask" / f"{name}.png").write_bytes(encode_png(changed))
        rows.append(("reference", name, 100 + 0.5 * k, before))
        rows.append(("live", name, 86500 + 0.5 * k, after))
    _write_poses(folder / "poses.csv", rows)
    _write_map(folder, room)
    (folder / "complete").touch()
    return plan.name


def _visible_changes(number: npt.NDArray[np.int32], unchanged: int) -> npt.NDArray[np.bool_]:
    """Mark the objects that only the live drive has; slivers no person could see do not count."""
    changed = number > unchanged
    for k in np.unique(number[changed]):
        if np.count_nonzero(number == k) < SMALLEST_CHANGE_PX:
            changed &= number != k
    return changed


def _stations(room: Room, count: int) -> list[list[Pose2]]:
    """Spread viewpoints along the path: each to one side of the way, to the other, and ahead."""
    points = np.asarray(room.path)
    legs = np.linalg.norm(np.diff(points, axis=0), axis=1)
    ends = np.concatenate([[0], np.cumsum(legs)])
    poses = []
    for k in range(count):
        along = ends[-1] * (k + 0.5) / count
        leg = min(int(np.searchsorted(ends, along, side="right")) - 1, len(legs) - 1)
        share = (along - ends[leg]) / legs[leg]
        x, y = points[leg] + share * (points[leg + 1] - points[leg])
        way = math.atan2(*(points[leg + 1] - points[leg])[::-1])
        side = 1.0 if int(along / 1.3) % 2 else -1.0
        turns = (side * room.gaze, -side * room.gaze, 0.0)
        poses.append([Pose2(float(x), float(y), wrap_angle(way + turn)) for turn in turns])
    return poses


def _length(room: Room) -> float:
    return float(np.linalg.norm(np.diff(np.asarray(room.path), axis=0), axis=1).sum())


def _best_side(scene: Scene, choices: list[Pose2]) -> Pose2:
    """Take the first viewpoint unless another shows clearly more than a bare wall."""
    across, down = np.meshgrid(range(20, 640, 24), range(20, 480, 24))
    x, y = across.ravel().astype(np.float32), down.ravel().astype(np.float32)
    shown = []
    for pose in choices:
        points, _, _ = scene.pick(camera_at(pose), x, y)
        depth = np.linalg.norm(points[:, :2] - [pose.x, pose.y], axis=1)
        shown.append(float(depth.std() + 0.4 * np.median(depth)))
    best = int(np.argmax(shown))
    return choices[best] if shown[best] > 1.35 * shown[0] else choices[0]


def _driven(pose: Pose2, rng: Rng) -> Pose2:
    """Add a drive's error: about 2 cm and 1.2 degrees."""
    dx, dy = rng.normal(0, 0.02, 2)
    return Pose2(pose.x + dx, pose.y + dy, wrap_angle(pose.theta + rng.normal(0, 0.021)))


def camera_at(pose: Pose2) -> Camera:
    """Return the robot's camera at a viewpoint."""
    return Camera((pose.x, pose.y, CAMERA_HEIGHT), pose.theta, CAMERA_PITCH)


def _leave_objects(
    scene: Scene,
    pose: Pose2,
    group: int,
    rng: Rng,
    taken: list[Place],
    *,
    count: int | None = None,
) -> list[Mesh]:
    """Put one to three objects of a group on level places that a viewpoint sees.

    Places are added to `taken`; objects keep their distance from each other.
    """
    near, far = VIEWING_RANGE[group]
    count = count or int(rng.integers(1, 4))
    kinds = list(GROUPS[group].values())
    camera = camera_at(pose)
    x = rng.uniform(70, 570, 400).astype(np.float32)
    y = rng.uniform(60, 450, 400).astype(np.float32)
    points, normals, numbers = scene.pick(camera, x, y)
    distance = np.linalg.norm(points - np.asarray(camera.position, np.float32), axis=1)
    level = (numbers >= 0) & (normals[:, 2] > 0.98) & (distance > near) & (distance < far)
    places: list[Place] = []
    for point in points[level]:
        free = all(np.linalg.norm(point - other) > LEAST_DISTANCE for other in taken)
        if free and _is_flat(scene, point):
            places.append(point)
            taken.append(point)
        if len(places) == count:
            break
    return [
        kinds[int(rng.integers(0, len(kinds)))](rng).moved(
            *(float(v) for v in point), yaw=float(rng.uniform(0, 2 * math.pi))
        )
        for point in places
    ]


def _is_flat(scene: Scene, point: npt.NDArray[np.float32]) -> bool:
    """Say whether the surface stays level 6 cm around a place: nothing hangs over an edge."""
    above = Camera((float(point[0]), float(point[1]), float(point[2]) + 0.2), 0.0, -math.pi / 2)
    reach = above.focal * 0.06 / 0.2
    angles = np.linspace(0, 2 * math.pi, 8, endpoint=False)
    x = (above.width / 2 + reach * np.cos(angles)).astype(np.float32)
    y = (above.height / 2 + reach * np.sin(angles)).astype(np.float32)
    around, _, _ = scene.pick(above, x, y)
    return bool(np.abs(around[:, 2] - point[2]).max() < 0.004)


def _moved_lights(lights: tuple[Light, ...], rng: Rng) -> tuple[Light, ...]:
    """Shift and dim the lamps a little, as another time of day does; shadows move with them."""
    moved = []
    for light in lights:
        a, b = np.asarray(light.side_a), np.asarray(light.side_b)
        step = rng.normal(0, 0.16, 2)
        shift = step[0] * a / np.linalg.norm(a) + step[1] * b / np.linalg.norm(b)
        x, y, z = (float(v) for v in np.asarray(light.centre) + shift)
        red, green, blue = (float(v) for v in np.asarray(light.power) * rng.uniform(0.85, 1.15))
        moved.append(replace(light, centre=(x, y, z), power=(red, green, blue)))
    return tuple(moved)


def _exposure(rng: Rng) -> Exposure:
    warm = float(rng.normal(0, 0.025))
    return Exposure(1.75 * float(rng.uniform(0.88, 1.14)), (1 + warm, 1.0, 1 - warm))


def _photograph(
    scene: Scene, pose: Pose2, exposure: Exposure, rng: Rng
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.int32]]:
    rendering = scene.render(camera_at(pose), rng)
    return develop(rendering.light, exposure, rng), rendering.object_number


def _write_poses(path: Path, rows: list[tuple[str, str, float, Pose2]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["session", "name", "stamp", "x", "y", "theta"])
        for session, name, stamp, pose in rows:
            numbers = [f"{v:.6f}" for v in (stamp, pose.x, pose.y, pose.theta)]
            writer.writerow([session, name, *numbers])


def _write_map(folder: Path, room: Room) -> None:
    """Write the grid a 2-D LiDAR would map: 0 = occupied, 254 = free, 205 = unknown."""
    margin = 0.5
    width = round((room.size[0] + 2 * margin) / MAP_RESOLUTION)
    height = round((room.size[1] + 2 * margin) / MAP_RESOLUTION)
    grid = np.full((height, width), 205, np.uint8)

    def cells(points: npt.NDArray[np.floating]) -> npt.NDArray[np.int32]:
        column = (points[..., 0] + margin) / MAP_RESOLUTION
        row = height - 1 - (points[..., 1] + margin) / MAP_RESOLUTION
        return np.stack([column, row], axis=-1).round().astype(np.int32)

    corners = np.array([[0, 0], [room.size[0], 0], list(room.size), [0, room.size[1]]], np.float64)
    cv2.fillPoly(grid, [cells(corners)], 254)
    low, high = room.mesh.corners[..., 2].min(axis=1), room.mesh.corners[..., 2].max(axis=1)
    for triangle in cells(room.mesh.corners[(low < 0.30) & (high > 0.12)]):
        cv2.fillPoly(grid, [triangle], 0)
    cv2.polylines(grid, [cells(corners)], True, 0, 2)
    if not cv2.imwrite(str(folder / "map.pgm"), grid):
        raise OSError(f"{folder / 'map.pgm'}: could not be written")
    description = {
        "image": "map.pgm",
        "resolution": MAP_RESOLUTION,
        "origin": [-margin, -margin, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    (folder / "map.yaml").write_text(yaml.safe_dump(description, sort_keys=False))


def _code(name: str) -> int:
    return sum(ord(c) * 131**k for k, c in enumerate(name))
