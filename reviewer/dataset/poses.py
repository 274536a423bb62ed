"""Read viewpoints and pair live images with the closest reference."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reviewer.dataset.documents import MALFORMED, read_text, read_yaml
from reviewer.dataset.files import image_size
from reviewer.errors import InvalidInput
from reviewer.geometry import Grid, Pose2, viewpoint_distances
from reviewer.words import SIDES, Heading

FARTHEST_M = 1e8
"""Ten times what any projected map counts to; beyond it distances lose their digits."""
TURN = 2 * math.pi + 0.01


@dataclass(frozen=True, slots=True)
class StampedPose:
    """A viewpoint and when it was taken, seconds."""

    stamp: float
    pose: Pose2


def read_poses(path: Path, heading: Heading = "auto") -> dict[tuple[str, str], StampedPose]:
    """Read `poses.csv` with the columns session, name, stamp, x, y, theta.

    Args:
        heading: unit of theta; "auto" takes radians, and refuses what is more than a turn of them.

    Returns:
        Poses by (session, image name); session is "reference" or "live".

    Raises:
        InvalidInput: for missing columns, text or NaN where numbers belong, positions off any map,
            or a name twice; the message names file and line.
    """
    poses: dict[tuple[str, str], StampedPose] = {}
    reader = csv.DictReader(read_text(path).splitlines())
    wanted = ["session", "name", "stamp", "x", "y", "theta"]
    try:
        missing = [column for column in wanted if column not in (reader.fieldnames or [])]
        if missing:
            raise InvalidInput(f"{path}: has no column {', '.join(missing)}; needed: {wanted}")
        for row in reader:
            place = f"{path}, line {reader.line_num}"
            session, name = row["session"], Path(row["name"] or "").stem
            if session not in SIDES:
                raise InvalidInput(f"{place}: session must be reference or live, not {session!r}")
            if (session, name) in poses:
                raise InvalidInput(f"{place}: {session} image {name!r} has a pose already")
            poses[session, name] = _pose([row[column] for column in wanted[2:]], heading, place)
    except csv.Error as error:
        raise InvalidInput(f"{path}, line {reader.line_num}: {error}") from error
    return poses


def _pose(texts: list[str | None], heading: Heading, place: str) -> StampedPose:
    try:
        stamp, x, y, theta = (float(text or "") for text in texts)
    except ValueError as error:
        raise InvalidInput(f"{place}: {error}") from error
    if not all(map(math.isfinite, (stamp, x, y, theta))):
        raise InvalidInput(f"{place}: stamp, x, y, theta must be finite numbers")
    if max(abs(x), abs(y), abs(theta)) > FARTHEST_M:
        raise InvalidInput(f"{place}: x, y in metres and theta go up to {FARTHEST_M:g} at most")
    if heading == "auto" and abs(theta) > TURN:
        raise InvalidInput(
            f"{place}: heading (column theta) is {theta:g}, more than a turn in radians; say"
            " --heading degrees, or --heading radians if it counts on after a turn"
        )
    return StampedPose(stamp, Pose2(x, y, math.radians(theta) if heading == "degrees" else theta))


def closest_references(
    live: list[Pose2], references: list[Pose2], *, metres_per_radian: float
) -> list[tuple[int, float]]:
    """Return for each live pose the index of the closest reference and its viewpoint distance."""
    if not live:
        return []
    distances = viewpoint_distances(
        _rows(live), _rows(references), metres_per_radian=metres_per_radian
    )
    best = distances.argmin(axis=1)
    return [(int(j), float(distances[i, j])) for i, j in enumerate(best)]


def _rows(poses: list[Pose2]) -> np.ndarray:
    return np.array([[pose.x, pose.y, pose.theta] for pose in poses], np.float64)


def read_map(path: Path, root: Path) -> tuple[Path, Grid]:
    """Read a ROS `map_server` description: the path of its image, and its frame.

    Raises:
        InvalidInput: when a key is missing or malformed, or the image lies outside `root`.
    """
    content = read_yaml(path)
    try:
        image = (path.parent / str(content["image"])).resolve()
        resolution = float(content["resolution"])
        x, y, theta = (float(v) for v in content["origin"])
    except (*MALFORMED, OSError, RuntimeError) as error:
        raise InvalidInput(
            f"{path}: needs image, resolution and origin [x, y, theta]; {error!r}"
        ) from error
    if not image.is_relative_to(root.resolve()):
        raise InvalidInput(f"{path}: its image {image} lies outside {root}")
    if not (math.isfinite(resolution) and resolution > 0):
        raise InvalidInput(f"{path}: resolution must be positive metres per cell, not {resolution}")
    if not all(math.isfinite(v) and abs(v) <= FARTHEST_M for v in (x, y, theta, resolution)):
        raise InvalidInput(f"{path}: origin and resolution go up to {FARTHEST_M:g} at most")
    height, width = image_size(image)
    return image, Grid(resolution, height, width, Pose2(x, y, theta))
