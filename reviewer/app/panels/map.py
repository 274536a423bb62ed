"""The map in Viser: occupancy grid with low walls, and a frustum for every viewpoint.

Live viewpoints are coloured by review state (blue = to do, yellow = the open pair); those whose run
asks for another look carry a red mark. Reference viewpoints are grey and smaller. A click on either
opens the pair.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
import viser
from viser import transforms

from reviewer.app.desks import Desk
from reviewer.app.panels.queue import STATE_COLOUR
from reviewer.dataset.files import read_grey
from reviewer.geometry import Grid, Pose2, cell_centre
from reviewer.records import OccupancyMap, Pair
from reviewer.store.pairs import list_maps, list_pairs, list_splits, pair_of_id
from reviewer.store.queue import QueueEntry
from reviewer.words import PairState

CAMERA_HEIGHT = 0.45
WALL_HEIGHT = 0.35
LEAST_AWAY = 3.0
OPEN_PAIR = (255, 222, 60)
REFERENCE = (150, 156, 165)
UNSEEN = (36, 120, 200)
LOOK_AGAIN = (255, 64, 90)

PYRAMID = np.array(
    [[0, 0, 0], [-0.13, -0.1, 0.22], [0.13, -0.1, 0.22], [0.13, 0.1, 0.22], [-0.13, 0.1, 0.22]],
    np.float32,
)
SIDES = np.array([[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [1, 2, 3], [1, 3, 4]], np.uint32)


class MapPanel:
    """The scene of one Viser client."""

    def __init__(self, client: viser.ClientHandle, desk: Desk) -> None:
        """Prepare the scene; `draw` fills it."""
        self._client = client
        self._desk = desk
        self._split: str | None = None
        self._pairs: list[Pair] = []
        self._live: viser.BatchedMeshHandle | None = None
        self._marks: viser.PointCloudHandle | None = None
        self._aimed: tuple[float, npt.NDArray[np.float64]] | None = None
        self._occupancy: OccupancyMap | None = None
        client.camera.on_update(self._camera_moved)
        client.scene.set_up_direction("+z")
        client.scene.configure_environment_map(hdri=None)
        client.scene.configure_default_lights(enabled=True, cast_shadow=False)

    def draw(self) -> None:
        """Show the split of the open pair, with the states and marks of now."""
        desk = self._desk
        with desk.lock:
            if desk.pair_id is None:
                return
            split = pair_of_id(desk.store, desk.pair_id).split
            if split != self._split:
                self._build(split)
            self._colour()
            there = bool(self._pairs) or self._occupancy is not None
            desk.send({"type": "map", "there": there})

    def _build(self, split: str) -> None:
        desk, scene = self._desk, self._client.scene
        scene.reset()
        scene.add_light_ambient("/light", intensity=1.4, color=(255, 255, 255))
        self._split, self._live, self._marks = None, None, None
        pairs = list_pairs(desk.store, [split])
        self._pairs = [p for p in pairs if p.live.pose and p.reference.pose]
        map_id = next(s.map_id for s in list_splits(desk.store) if s.name == split)
        occupancy = next((m for m in list_maps(desk.store) if m.id == map_id), None)
        self._occupancy = occupancy
        if occupancy is not None:
            self._build_grid(occupancy)
        if self._pairs:
            self._build_viewpoints()
            self._aim()
        self._split = split

    def _build_grid(self, occupancy: OccupancyMap) -> None:
        """Lay the grid on the floor and raise its occupied cells."""
        grid, levels = occupancy.grid, read_grey(occupancy.path)
        scene = self._client.scene
        shades = np.full((*levels.shape, 3), (84, 90, 99), np.uint8)
        shades[levels >= 250] = (236, 238, 241)
        shades[levels <= 50] = (52, 57, 66)
        # Viser smooths textures and puts row 0 at the smallest y: enlarge, and turn upside down.
        picture = np.kron(np.flipud(shades), np.ones((4, 4, 1), np.uint8))
        width, height = grid.width * grid.resolution, grid.height * grid.resolution
        corner = cell_centre(grid, grid.height - 1, 0)
        middle = (
            corner[0] + (width - grid.resolution) / 2,
            corner[1] + (height - grid.resolution) / 2,
            0.0,
        )
        scene.add_image(
            "/map/grid", picture, width, height, format="png", position=middle,
            cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        walls = _wall_boxes(levels <= 50, grid)
        if len(walls):
            vertices, faces = _unit_box()
            upright = np.tile(np.array([1, 0, 0, 0], np.float32), (len(walls), 1))
            scene.add_batched_meshes_simple(
                "/map/walls", vertices, faces, upright, walls[:, :3],
                batched_scales=walls[:, 3:],
                batched_colors=np.tile(np.array([[112, 120, 134]], np.uint8), (len(walls), 1)),
                lod="off", cast_shadow=False, receive_shadow=False, flat_shading=True,
            )  # fmt: skip

    def _build_viewpoints(self) -> None:
        poses = {"reference": [p.reference.pose for p in self._pairs],
                 "live": [p.live.pose for p in self._pairs]}  # fmt: skip
        for session, height, size in (("reference", 0.22, 0.9), ("live", CAMERA_HEIGHT, 1.5)):
            positions, turns = _placed([p for p in poses[session] if p is not None], height)
            handle = self._client.scene.add_batched_meshes_simple(
                f"/viewpoints/{session}", PYRAMID * size, SIDES, turns, positions,
                batched_colors=np.tile(np.array([REFERENCE], np.uint8), (len(positions), 1)),
                side="double", lod="off", cast_shadow=False, receive_shadow=False,
            )  # fmt: skip

            @handle.on_click
            def _(event: viser.SceneNodePointerEvent[viser.BatchedMeshHandle]) -> None:
                if event.instance_index is not None:
                    self._desk.open_pair(self._pairs[event.instance_index].id)

            if session == "live":
                self._live = handle

    def _colour(self) -> None:
        if self._live is None:
            return
        entries = {
            e.id: e for e in self._desk.entries([p.id for p in self._pairs], len(self._pairs))
        }
        colours = np.array(
            [self._colour_of(pair, entries.get(pair.id)) for pair in self._pairs], np.uint8
        )
        self._live.batched_colors = colours
        marked = [
            (p.live.pose.x, p.live.pose.y, CAMERA_HEIGHT + 0.3)
            for p in self._pairs
            if p.live.pose is not None and p.id in entries and entries[p.id].inspect
        ]
        if self._marks is not None:
            self._marks.remove()
            self._marks = None
        if marked:
            self._marks = self._client.scene.add_point_cloud(
                "/viewpoints/inspect", np.array(marked, np.float32), LOOK_AGAIN,
                point_size=0.09, point_shape="circle",
            )  # fmt: skip

    def _colour_of(self, pair: Pair, entry: QueueEntry | None) -> tuple[int, int, int]:
        if pair.id == self._desk.pair_id:
            return OPEN_PAIR
        state: PairState = entry.state if entry else "todo"
        return UNSEEN if state == "todo" else STATE_COLOUR[state]

    def _camera_moved(self, camera: viser.CameraHandle) -> None:
        """Aim again when the canvas changed its shape and nobody has moved the camera since."""
        with self._desk.lock:
            if self._aimed is None or not self._pairs:
                return
            aspect, position = self._aimed
            if abs(camera.aspect - aspect) > 0.02 and np.allclose(
                camera.position, position, atol=0.02
            ):
                self._aim()

    def _aim(self) -> None:
        """Look at the whole map from the south, steeply."""
        occupancy = self._occupancy
        places = np.array([[p.live.pose.x, p.live.pose.y] for p in self._pairs if p.live.pose])
        low, high = places.min(axis=0), places.max(axis=0)
        if occupancy is not None:
            grid = occupancy.grid
            ends = [cell_centre(grid, grid.height - 1, 0), cell_centre(grid, 0, grid.width - 1)]
            low, high = np.minimum(low, ends[0]), np.maximum(high, ends[1])
        camera = self._client.camera
        position, middle = place_camera(low, high, camera.aspect)
        with self._client.atomic():
            camera.up_direction = (0.0, 0.0, 1.0)
            camera.position, camera.look_at = position, middle
        self._aimed = camera.aspect, np.array(camera.position)


def place_camera(
    low: npt.NDArray[np.float64], high: npt.NDArray[np.float64], aspect: float
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return where to stand and where to look so that a box of the floor (x, y) is seen whole."""
    x, y = (float(v) for v in (low + high) / 2)
    wide, deep = (float(v) for v in high - low)
    # A narrow canvas must stand further back to see the whole width; a single place has none.
    away = max(deep, 0.62 * wide / max(aspect, 0.2), LEAST_AWAY)
    return (x, y - 0.5 * away, 1.05 * away), (x, y, 0.0)


def _placed(
    poses: list[Pose2], height: float
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Return positions (N, 3) and quaternions wxyz (N, 4) in the camera convention, z forward."""
    positions = np.array([[p.x, p.y, height] for p in poses], np.float32)
    turns = []
    for pose in poses:
        c, s = np.cos(pose.theta), np.sin(pose.theta)
        axes = np.array([[s, 0.0, c], [-c, 0.0, s], [0.0, -1.0, 0.0]])
        turns.append(transforms.SO3.from_matrix(axes).wxyz)
    return positions, np.array(turns, np.float32)


def _wall_boxes(occupied: npt.NDArray[np.bool_], grid: Grid) -> npt.NDArray[np.float32]:
    """Return boxes (x, y, z, sx, sy, sz) in metres: one per run of occupied cells in a row."""
    boxes = []
    cell = grid.resolution
    # Two rows at a time halve the number of boxes; the map stays recognisable.
    size = (grid.width, (grid.height + 1) // 2)
    half = cv2.resize(occupied.astype(np.uint8), size, interpolation=cv2.INTER_AREA)
    for row in range(half.shape[0]):
        padded = np.concatenate([[0], half[row], [0]]).astype(np.int8)
        starts, ends = np.flatnonzero(np.diff(padded) == 1), np.flatnonzero(np.diff(padded) == -1)
        for start, end in zip(starts, ends, strict=True):
            left, y = cell_centre(grid, row * 2, int(start))
            length = float(end - start) * cell
            middle = (left + (length - cell) / 2, y - cell / 2, WALL_HEIGHT / 2)
            boxes.append([*middle, length, 2 * cell, WALL_HEIGHT])
    return np.array(boxes, np.float32).reshape(-1, 6)


def _unit_box() -> tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
         [2, 3, 7], [2, 7, 6], [1, 5, 7], [1, 7, 3], [0, 2, 6], [0, 6, 4]],
        np.uint32,
    )  # fmt: skip
    return signs * np.float32(0.5), faces
