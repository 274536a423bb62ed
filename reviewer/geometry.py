"""Planar poses, viewpoint distance and the occupancy grid's frame.

Poses are SE(2) in the map frame: metres and radians, theta counter-clockwise from +x. Grids follow
ROS `map_server`: `origin` is the world pose of the lower left corner, image row 0 is the top row.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True)
class Pose2:
    """A viewpoint in the map: x, y in metres, theta in radians."""

    x: float
    y: float
    theta: float


@dataclass(frozen=True, slots=True)
class Grid:
    """Frame of an occupancy grid: metres per cell, size in cells, world pose of its lower left."""

    resolution: float
    height: int
    width: int
    origin: Pose2


def wrap_angle(angle: float) -> float:
    """Return the same angle in [-pi, pi)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def compose(parent: Pose2, child: Pose2) -> Pose2:
    """Return parent * child: the pose `child`, given in the frame of `parent`, in the world."""
    c, s = math.cos(parent.theta), math.sin(parent.theta)
    return Pose2(
        parent.x + c * child.x - s * child.y,
        parent.y + s * child.x + c * child.y,
        wrap_angle(parent.theta + child.theta),
    )


def inverse(pose: Pose2) -> Pose2:
    """Return the pose that undoes `pose`: compose(pose, inverse(pose)) is the identity."""
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    return Pose2(-c * pose.x - s * pose.y, s * pose.x - c * pose.y, wrap_angle(-pose.theta))


def viewpoint_distance(first: Pose2, second: Pose2, *, metres_per_radian: float = 1.0) -> float:
    """Return sqrt(dx^2 + dy^2 + (w * dtheta)^2) in metres, w = `metres_per_radian`.

    The paper pairs a live image with "the closest viewpoint in the 3DoF viewpoint space" and leaves
    the weight of the angle open; 1 m per radian makes 10 degrees cost as much as 17 cm.
    """
    turn = wrap_angle(first.theta - second.theta) * metres_per_radian
    return math.sqrt((first.x - second.x) ** 2 + (first.y - second.y) ** 2 + turn**2)


def viewpoint_distances(
    poses: npt.NDArray[np.float64],
    others: npt.NDArray[np.float64],
    *,
    metres_per_radian: float = 1.0,
) -> npt.NDArray[np.float64]:
    """Return the (N, M) matrix of `viewpoint_distance` between (N, 3) and (M, 3) rows x, y, theta.

    Memory is N x M float64; a split has a few hundred images on each side.
    """
    delta = poses[:, None, :] - others[None, :, :]
    turn = (delta[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return np.sqrt(delta[..., 0] ** 2 + delta[..., 1] ** 2 + (turn * metres_per_radian) ** 2)


def cell_centre(grid: Grid, row: int, column: int) -> tuple[float, float]:
    """Return world (x, y) in metres of a cell's centre; row 0 is the image's top row."""
    local = Pose2(
        (column + 0.5) * grid.resolution, (grid.height - row - 0.5) * grid.resolution, 0.0
    )
    placed = compose(grid.origin, local)
    return placed.x, placed.y


def cell_at(grid: Grid, x: float, y: float) -> tuple[int, int]:
    """Return (row, column) of the cell holding world (x, y); may lie outside the grid."""
    local = compose(inverse(grid.origin), Pose2(x, y, 0.0))
    column = math.floor(local.x / grid.resolution)
    row = grid.height - 1 - math.floor(local.y / grid.resolution)
    return row, column
