"""Regions that need another look, their place on the floor, and viewpoints ranked by them.

A place is where the ray through the middle of the region's box meets the floor; or, where the map
has something in the way before that, the first occupied cell: what lies on a shelf or hangs on a
wall is placed there. How far off that is on the demo world: `benchmarks/inspection.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from skimage.draw import line

from reviewer.geometry import FloorCamera, Grid, Pose2, bearing, cell_at, cell_centre, floor_point
from reviewer.records import Pair
from reviewer.store.regions_to_inspect import InspectRegion


@dataclass(frozen=True, slots=True)
class PlacedRegion:
    """A region with its place x, y, z, metres in the map; None where there is none within reach.

    On the floor z is 0, on an obstacle the height at which the ray meets it.
    """

    region: InspectRegion
    pose: Pose2
    place: tuple[float, float, float] | None


@dataclass(frozen=True, slots=True)
class RankedViewpoint:
    """A live viewpoint and its regions that need another look."""

    pair: Pair
    regions: int
    doi: float


@dataclass(frozen=True, slots=True)
class Target:
    """A place to look at again, and the regions that lie there together."""

    x: float
    y: float
    to_inspect: tuple[PlacedRegion, ...]

    @property
    def heights(self) -> tuple[float, float]:
        """Lowest and highest of its regions, metres above the floor."""
        known = [placed.place[2] for placed in self.to_inspect if placed.place is not None]
        return min(known), max(known)

    @property
    def weight(self) -> float:
        """Sum of DoI: what a look at it is worth."""
        return sum(placed.region.doi for placed in self.to_inspect)


def place_regions(
    regions: Sequence[InspectRegion],
    poses: dict[int, Pose2],
    camera: FloorCamera,
    occupied: npt.NDArray[np.bool_],
    grid: Grid,
    *,
    near: float = 0.22,
    farthest: float = 5.0,
) -> list[PlacedRegion]:
    """Return the regions with their places.

    Args:
        poses: live viewpoints by pair id; regions of other pairs are left out.
        occupied: bool (rows, columns) of the map, and `grid` its frame.
        near: metres around a viewpoint in which the robot itself stands, so nothing is in its way
            whatever the map says.
        farthest: metres beyond which a place is not believed: the ray is too flat.
    """
    to_inspect = []
    for region in regions:
        pose = poses.get(region.pair_id)
        if pose is None:
            continue
        x, y, width, height = region.box_xywh
        pixel = x + width / 2, y + height / 2
        to_inspect.append(
            PlacedRegion(region, pose, _place(camera, pose, pixel, occupied, grid, near, farthest))
        )
    return to_inspect


def _place(
    camera: FloorCamera,
    pose: Pose2,
    pixel: tuple[float, float],
    occupied: npt.NDArray[np.bool_],
    grid: Grid,
    near: float,
    farthest: float,
) -> tuple[float, float, float] | None:
    here = pose.x, pose.y
    floor = floor_point(camera, pose, *pixel)
    heading, slope = bearing(camera, pose, *pixel)
    away = math.inf if floor is None else math.dist(floor, here)
    reach = min(away, farthest)
    end = pose.x + reach * math.cos(heading), pose.y + reach * math.sin(heading)
    obstacle = _first_occupied(occupied, grid, here, end, near)
    if obstacle is not None:
        return *obstacle, max(0.0, camera.height + slope * math.dist(obstacle, here))
    return (*floor, 0.0) if floor is not None and away <= farthest else None


def _first_occupied(
    occupied: npt.NDArray[np.bool_],
    grid: Grid,
    start: tuple[float, float],
    end: tuple[float, float],
    near: float,
) -> tuple[float, float] | None:
    """Return the centre of the first occupied cell on the way, metres; None without any."""
    rows, columns = line(*cell_at(grid, *start), *cell_at(grid, *end))
    inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
    rows, columns = rows[inside], columns[inside]
    away = np.hypot(rows - rows[:1], columns - columns[:1]) * grid.resolution
    hits = np.flatnonzero(occupied[rows, columns] & (away > near))
    if not len(hits):
        return None
    return cell_centre(grid, int(rows[hits[0]]), int(columns[hits[0]]))


def rank_viewpoints(
    pairs: Sequence[Pair], regions: Sequence[InspectRegion]
) -> list[RankedViewpoint]:
    """Return the pairs with such regions, most of them first, then largest sum of DoI."""
    found: dict[int, list[InspectRegion]] = {}
    for region in regions:
        found.setdefault(region.pair_id, []).append(region)
    ranked = [
        RankedViewpoint(pair, len(own), sum(region.doi for region in own))
        for pair in pairs
        if (own := found.get(pair.id))
    ]
    return sorted(ranked, key=lambda each: (-each.regions, -each.doi, each.pair.title))


def gather(to_inspect: Sequence[PlacedRegion], *, within: float = 0.4) -> list[Target]:
    """Join regions that lie `within` metres of the heaviest one there; heaviest target first."""
    left = sorted(
        (placed for placed in to_inspect if placed.place is not None),
        key=lambda placed: (-placed.region.doi, placed.region.id),
    )
    targets = []
    while left:
        x, y, _ = left[0].place or (0.0, 0.0, 0.0)
        near = [d for d in left if d.place and math.dist(d.place[:2], (x, y)) <= within]
        targets.append(Target(x, y, tuple(near)))
        left = [placed for placed in left if placed not in near]
    return sorted(targets, key=lambda target: -target.weight)
