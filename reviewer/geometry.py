"""Planar poses, viewpoint distance, the occupancy grid's frame, and pixel rays on the floor.

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


@dataclass(frozen=True, slots=True)
class FloorCamera:
    """A pinhole camera on a robot that stands on the floor.

    Attributes:
        height: of the optical centre above the floor, metres.
        pitch: radians, < 0 looks down.
        focal: pixels.
        height_px, width_px: size of the image; its middle is the principal point.
    """

    height: float
    pitch: float
    focal: float
    height_px: int = 480
    width_px: int = 640


def floor_point(camera: FloorCamera, pose: Pose2, x: float, y: float) -> tuple[float, float] | None:
    """Return world (x, y), metres, where a pixel's ray meets the floor; None above the horizon.

    Args:
        pose: viewpoint of the camera; theta is the heading of its optical axis.
        x, y: pixels, (0, 0) is the upper left corner of the image.
    """
    ahead, left, rise = _ray(camera, x, y)
    if rise >= -1e-6:
        return None
    scale = camera.height / -rise
    placed = compose(pose, Pose2(scale * ahead, scale * left, 0.0))
    return placed.x, placed.y


def bearing(camera: FloorCamera, pose: Pose2, x: float, y: float) -> tuple[float, float]:
    """Return the direction of a pixel's ray: radians counter-clockwise from +x of the map, and
    metres that it rises a metre of way (negative: falls)."""
    ahead, left, rise = _ray(camera, x, y)
    return wrap_angle(pose.theta + math.atan2(left, ahead)), rise / math.hypot(ahead, left)


def _ray(camera: FloorCamera, x: float, y: float) -> tuple[float, float, float]:
    """Return the direction of a pixel's ray in the robot's frame: ahead, left, up."""
    across = (x - camera.width_px / 2) / camera.focal
    down = (y - camera.height_px / 2) / camera.focal
    c, s = math.cos(camera.pitch), math.sin(camera.pitch)
    return c + s * down, -across, s - c * down


def image_point(
    camera: FloorCamera, pose: Pose2, point: tuple[float, float, float]
) -> tuple[float, float] | None:
    """Return the pixel (x, y) of a world point, which may lie outside the image; None behind."""
    local = compose(inverse(pose), Pose2(point[0], point[1], 0.0))
    c, s = math.cos(camera.pitch), math.sin(camera.pitch)
    rise = point[2] - camera.height
    depth = c * local.x + s * rise
    if depth <= 1e-6:
        return None
    across, down = -local.y / depth, (s * local.x - c * rise) / depth
    return (
        camera.width_px / 2 + camera.focal * across,
        camera.height_px / 2 + camera.focal * down,
    )
