"""Read viewpoints and pair live images with the closest reference."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from reviewer.dataset.files import image_size
from reviewer.errors import InvalidInput
from reviewer.geometry import Grid, Pose2, viewpoint_distances


@dataclass(frozen=True, slots=True)
class StampedPose:
    """A viewpoint and when it was taken, seconds."""

    stamp: float
    pose: Pose2


def read_poses(path: Path) -> dict[tuple[str, str], StampedPose]:
    """Read `poses.csv` with the columns session, name, stamp, x, y, theta.

    Returns:
        Poses by (session, image name); session is "reference" or "live".

    Raises:
        InvalidInput: for missing columns, text or NaN where numbers belong, or a name twice; the
            message names file and line.
    """
    poses: dict[tuple[str, str], StampedPose] = {}
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InvalidInput(f"{path}: cannot be read, {error}") from error
    reader = csv.DictReader(text.splitlines())
    wanted = ["session", "name", "stamp", "x", "y", "theta"]
    missing = [column for column in wanted if column not in (reader.fieldnames or [])]
    if missing:
        raise InvalidInput(f"{path}: has no column {', '.join(missing)}; needed: {wanted}")
    for row in reader:
        place = f"{path}, line {reader.line_num}"
        session, name = row["session"], Path(row["name"] or "").stem
        if session not in ("reference", "live"):
            raise InvalidInput(f"{place}: session must be reference or live, not {session!r}")
        try:
            stamp, x, y, theta = (float(row[column]) for column in wanted[2:])
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"{place}: {error}") from error
        if not all(map(math.isfinite, (stamp, x, y, theta))):
            raise InvalidInput(f"{place}: stamp, x, y, theta must be finite numbers")
        if (session, name) in poses:
            raise InvalidInput(f"{place}: {session} image {name!r} has a pose already")
        poses[session, name] = StampedPose(stamp, Pose2(x, y, theta))
    return poses


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
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InvalidInput(f"{path}: cannot be read, {error}") from error
    try:
        image = (path.parent / str(content["image"])).resolve()
        resolution = float(content["resolution"])
        x, y, theta = (float(v) for v in content["origin"])
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInput(
            f"{path}: needs image, resolution and origin [x, y, theta]; {error!r}"
        ) from error
    if not image.is_relative_to(root.resolve()):
        raise InvalidInput(f"{path}: its image {image} lies outside {root}")
    if not (math.isfinite(resolution) and resolution > 0):
        raise InvalidInput(f"{path}: resolution must be positive metres per cell, not {resolution}")
    height, width = image_size(image)
    return image, Grid(resolution, height, width, Pose2(x, y, theta))
