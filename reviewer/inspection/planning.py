"""Plan the inspection of a split from the regions to inspect of a run."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from reviewer.dataset.files import read_grey
from reviewer.errors import InvalidInput, NotFound
from reviewer.geometry import FloorCamera, Pose2
from reviewer.inspection.regions_to_inspect import (
    PlacedRegion,
    RankedViewpoint,
    gather,
    place_regions,
    rank_viewpoints,
)
from reviewer.inspection.tour import Tour, plan_tour
from reviewer.inspection.views import Terrain, View, ViewSettings, best_view
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.pairs import list_maps, list_pairs, list_splits
from reviewer.store.regions_to_inspect import inspect_regions

DEFAULT_CAMERA = FloorCamera(0.72, -0.42, 385.0)
"""The demo world's: an Intel RealSense D455 at 640x480 (focal length about 385 pixels), 72 cm above
the floor, looking 24 degrees down."""


MOST_TARGETS = 150
"""Heaviest targets that views are looked for; nobody drives to more, and each costs a search."""


@dataclass(frozen=True, slots=True)
class PlanSettings:
    """Camera, views, and metres of way."""

    camera: FloorCamera = DEFAULT_CAMERA
    views: ViewSettings = field(default_factory=ViewSettings)
    budget: float = 20.0


@dataclass(frozen=True, slots=True)
class InspectionPlan:
    """What to look at again in a split.

    Attributes:
        ranked: live viewpoints by their regions.
        to_inspect: regions with their places; those without one cannot be planned.
        tour: views in order.
        unseen: targets that no reachable cell sees, as "x, y" metres.
        not_looked_for: targets beyond the heaviest 150, for which no view was looked for.
    """

    split: str
    start: Pose2
    ranked: tuple[RankedViewpoint, ...]
    to_inspect: tuple[PlacedRegion, ...]
    tour: Tour
    unseen: tuple[tuple[float, float], ...]
    not_looked_for: int


def plan_inspection(
    store: Store, run: Run, split: str, settings: PlanSettings, start: Pose2 | None = None
) -> InspectionPlan:
    """Return the plan of a split.

    Args:
        start: where the robot stands; the first live viewpoint when None.

    Raises:
        NotFound: when the split does not exist, or has no map.
        InvalidInput: when its images have no poses or another size than the camera, or the robot
            fits nowhere.
    """
    pairs = list_pairs(store, [split])
    poses = {pair.id: pair.live.pose for pair in pairs if pair.live.pose is not None}
    if not poses:
        raise InvalidInput(f"split {split}: its images have no poses, so nothing can be planned")
    camera = settings.camera
    for pair in pairs:
        if (pair.live.height, pair.live.width) != (camera.height_px, camera.width_px):
            raise InvalidInput(
                f"pair {pair.title}: is {pair.live.width}x{pair.live.height}, but the camera takes"
                f" {camera.width_px}x{camera.height_px}"
            )
    map_id = next(known.map_id for known in list_splits(store) if known.name == split)
    if map_id is None:
        raise NotFound(f"split {split}: has no occupancy map (map.yaml), so no place to stand")
    occupancy = next(known for known in list_maps(store) if known.id == map_id)
    begin = start or next(iter(poses.values()))
    regions = inspect_regions(store, run.id, [split])
    levels = np.asarray(read_grey(occupancy.path), np.uint8)
    terrain = Terrain(levels, occupancy.grid, settings.views.robot_radius, begin)
    if not terrain.standing.any():
        raise InvalidInput(
            f"split {split}: a robot of radius {settings.views.robot_radius:g} m fits nowhere"
        )
    to_inspect = place_regions(
        regions, poses, camera, terrain.occupied, occupancy.grid, near=settings.views.robot_radius
    )
    views: list[View] = []
    unseen = []
    targets = gather(to_inspect)
    for target in targets[:MOST_TARGETS]:
        view = best_view(terrain, target, camera, settings.views)
        if view is None:
            unseen.append((target.x, target.y))
        else:
            views.append(view)
    tour = plan_tour(terrain, begin, views, settings.budget)
    ranked = rank_viewpoints(pairs, regions)
    return InspectionPlan(
        split,
        begin,
        tuple(ranked),
        tuple(to_inspect),
        tour,
        tuple(unseen),
        len(targets[MOST_TARGETS:]),
    )
