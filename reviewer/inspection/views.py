"""Next-best views: a free, reachable cell at a stand-off that faces a target with line of sight."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from skimage.draw import line

from reviewer.geometry import FloorCamera, Grid, Pose2, cell_at, cell_centre
from reviewer.inspection.regions_to_inspect import Target

FREE, OCCUPIED = 250, 50
"""Levels of a ROS map: brighter is free, darker is occupied, between is unknown."""
TOUCHING = 0.25
"""Metres around a target in which occupied cells do not hide it: objects lie beside things."""


@dataclass(frozen=True, slots=True)
class ViewSettings:
    """How a view is chosen, metres.

    Attributes:
        robot_radius: distance that the robot keeps from what is not free.
        stand_off: best distance to a target; `nearest` and `farthest` bound it.
        new_side: share of the stand-off that a view from the side opposite to the first look may be
            off, and still be as good as one from the same side at the stand-off.
        margin: share of the picture at its top and bottom in which a target does not count as seen.
    """

    robot_radius: float = 0.22
    stand_off: float = 1.0
    nearest: float = 0.6
    farthest: float = 2.5
    new_side: float = 0.3
    margin: float = 0.08


@dataclass(frozen=True, slots=True)
class View:
    """A pose from which to look at a target."""

    pose: Pose2
    target: Target


class Terrain:
    """An occupancy grid as the robot can use it.

    Attributes:
        grid: its frame.
        occupied: bool (rows, columns).
        standing: bool, where the robot fits.
    """

    def __init__(
        self, levels: npt.NDArray[np.uint8], grid: Grid, robot_radius: float, start: Pose2
    ) -> None:
        """Keep the cells that can be reached from `start`."""
        self.grid = grid
        self.occupied = levels <= OCCUPIED
        # Unknown cells are no obstacle to sight, but nothing to stand on.
        clearance = cv2.distanceTransform((levels >= FREE).astype(np.uint8), cv2.DIST_L2, 5)
        fits = clearance * grid.resolution >= robot_radius
        _, regions = cv2.connectedComponents(fits.astype(np.uint8), connectivity=8)
        own = regions[self.nearest_cell(start, fits)] if fits.any() else 0
        self.standing = (regions == own) & fits

    def nearest_cell(self, pose: Pose2, among: npt.NDArray[np.bool_]) -> tuple[int, int]:
        """Return the (row, column) of a set of cells that is nearest to a pose."""
        rows, columns = np.nonzero(among)
        row, column = cell_at(self.grid, pose.x, pose.y)
        place = int(np.argmin((rows - row) ** 2 + (columns - column) ** 2))
        return int(rows[place]), int(columns[place])

    def sees(self, cell: tuple[int, int], target: tuple[float, float]) -> bool:
        """Say whether no occupied cell lies between a cell and a target, metres."""
        goal = cell_at(self.grid, *target)
        rows, columns = line(*cell, *goal)
        height, width = self.occupied.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        rows, columns = rows[inside], columns[inside]
        away = np.hypot(rows - goal[0], columns - goal[1]) * self.grid.resolution
        return not self.occupied[rows[away > TOUCHING], columns[away > TOUCHING]].any()


def best_view(
    terrain: Terrain, target: Target, camera: FloorCamera, settings: ViewSettings
) -> View | None:
    """Return the view of a target, None where no cell sees it and has it in the picture.

    Best is the distance nearest to the stand-off; among those alike, the one that looks from
    another side than the first look did, whose glare or occlusion it may escape.
    """
    rows, columns = np.nonzero(terrain.standing)
    if not len(rows):
        return None
    xs, ys = _centres(terrain.grid, rows, columns)
    away = np.hypot(xs - target.x, ys - target.y)
    first = target.to_inspect[0].pose
    old = math.atan2(first.y - target.y, first.x - target.x)
    turned = np.cos(np.arctan2(ys - target.y, xs - target.x) - old)
    cost = np.abs(away - settings.stand_off) + settings.new_side * settings.stand_off * (
        (1 + turned) / 2
    )
    near = (away >= settings.nearest) & (away <= settings.farthest)
    near &= _framed(away, target, camera, settings.margin)
    for place in np.flatnonzero(near)[np.argsort(cost[near], kind="stable")]:
        if terrain.sees((int(rows[place]), int(columns[place])), (target.x, target.y)):
            x, y = float(xs[place]), float(ys[place])
            theta = math.atan2(target.y - y, target.x - x)
            return View(Pose2(x, y, theta), target)
    return None


def _framed(
    away: npt.NDArray[np.float64], target: Target, camera: FloorCamera, margin: float
) -> npt.NDArray[np.bool_]:
    """Say from which distances a camera that faces a target has all its heights in the picture."""
    c, s = math.cos(camera.pitch), math.sin(camera.pitch)
    inside = np.ones(away.shape, np.bool_)
    for z in target.heights:
        rise = z - camera.height
        depth = c * away + s * rise
        row = camera.height_px / 2 + camera.focal * (s * away - c * rise) / np.maximum(depth, 1e-6)
        inside &= (depth > 0) & (row >= margin * camera.height_px)
        inside &= row <= (1 - margin) * camera.height_px
    return inside


def _centres(
    grid: Grid, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return `cell_centre` of many cells; it is linear in row and column."""
    origin, across, down = (np.array(cell_centre(grid, *cell)) for cell in ((0, 0), (0, 1), (1, 0)))
    x, y = (origin[k] + columns * (across - origin)[k] + rows * (down - origin)[k] for k in (0, 1))
    return x, y
