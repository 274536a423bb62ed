"""Places, views and tours on maps that are drawn by hand."""

import math
from itertools import pairwise

import numpy as np
import pytest

from reviewer.geometry import FloorCamera, Grid, Pose2, cell_at, floor_point, image_point
from reviewer.inspection.regions_to_inspect import PlacedRegion, Target, gather, place_regions
from reviewer.inspection.tour import plan_tour
from reviewer.inspection.views import Terrain, View, ViewSettings, best_view
from reviewer.store.regions_to_inspect import InspectRegion

CAMERA = FloorCamera(0.7, -0.4, 400.0)
GRID = Grid(0.05, 80, 120, Pose2(0.0, 0.0, 0.0))
"""6 m by 4 m."""
START = Pose2(1.0, 2.0, 0.0)


def levels(*walls):
    """A free room; walls are (x0, y0, x1, y1) in metres."""
    made = np.full((80, 120), 254, np.uint8)
    made[:2] = made[-2:] = 0
    made[:, :2] = made[:, -2:] = 0
    for x0, y0, x1, y1 in walls:
        bottom, left = cell_at(GRID, x0, y0)
        top, right = cell_at(GRID, x1, y1)
        made[top : bottom + 1, left : right + 1] = 0
    return made


def terrain(*walls, radius=0.2):
    return Terrain(levels(*walls), GRID, radius, START)


def region(number=1, doi=1.0, box=(0, 0, 1, 1)):
    return InspectRegion(number, 1, "cs1", "0000", "pen", doi, box)


def target(x, y, z=0.0, first=START, doi=1.0):
    return Target(x, y, (PlacedRegion(region(doi=doi), first, (x, y, z)),))


def test_a_pixel_and_its_place_on_the_floor_are_each_other_s_inverse():
    rng = np.random.default_rng(2)
    for _ in range(50):
        pose = Pose2(*rng.uniform(-3, 3, 2), rng.uniform(-math.pi, math.pi))
        pixel = rng.uniform(0, 640), rng.uniform(230, 480)
        place = floor_point(CAMERA, pose, *pixel)
        assert image_point(CAMERA, pose, (*place, 0.0)) == pytest.approx(pixel, abs=1e-6)
    # Straight ahead and down the optical axis: height / tan(pitch).
    ahead = floor_point(CAMERA, Pose2(0, 0, 0), 320, 240)
    assert ahead == pytest.approx((0.7 / math.tan(0.4), 0.0))
    left = floor_point(CAMERA, Pose2(0, 0, math.pi / 2), 320, 240)
    assert left == pytest.approx((0.0, 0.7 / math.tan(0.4)))
    assert floor_point(CAMERA, Pose2(0, 0, 0), 320, 40) is None


def test_what_an_obstacle_is_in_the_way_of_is_placed_there_at_its_height():
    occupied = levels((2.5, 0.5, 2.6, 3.5)) == 0
    poses = {1: START}
    (low,) = place_regions([region(box=(319, 239, 2, 2))], poses, CAMERA, levels() == 0, GRID)
    assert low.place == pytest.approx((1 + 0.7 / math.tan(0.4), 2.0, 0.0))
    (high,) = place_regions([region(box=(319, 139, 2, 2))], poses, CAMERA, occupied, GRID)
    x, y, z = high.place
    assert (x, y) == pytest.approx((2.5, 2.0), abs=0.06)
    assert z == pytest.approx(0.7 + 1.5 * math.tan(-0.4 + math.atan(100 / 400)), abs=0.02)
    far = place_regions(
        [region(box=(319, 60, 2, 2))], poses, CAMERA, levels() == 0, GRID, farthest=2
    )
    assert far[0].place is None


def test_a_view_is_free_reachable_at_its_distance_and_faces_the_target():
    wall = (2.9, 0.0, 3.0, 3.2)
    place = terrain(wall)
    view = best_view(place, target(2.0, 1.0), CAMERA, ViewSettings(robot_radius=0.2))
    away = math.hypot(view.pose.x - 2.0, view.pose.y - 1.0)
    assert 0.6 <= away <= 1.4
    assert view.pose.theta == pytest.approx(math.atan2(1.0 - view.pose.y, 2.0 - view.pose.x))
    assert place.standing[cell_at(GRID, view.pose.x, view.pose.y)]
    assert view.pose.x < 2.7, "the other side of the wall sees nothing"


def test_a_room_that_cannot_be_reached_is_no_place_to_stand():
    closed = terrain((2.9, 0.0, 3.0, 3.99))
    assert not closed.standing[cell_at(GRID, 4.0, 2.0)]
    assert best_view(closed, target(5.0, 2.0), CAMERA, ViewSettings()) is None
    assert best_view(terrain(), target(5.0, 2.0), CAMERA, ViewSettings()) is not None


def test_another_side_is_preferred_and_what_is_high_is_seen_from_farther_away():
    settings = ViewSettings()
    low = best_view(terrain(), target(3.0, 2.0), CAMERA, settings)
    assert low.pose.x > 3.0, "the first look came from the left"
    high = best_view(terrain(), target(3.0, 2.0, z=0.8), CAMERA, settings)
    distances = [math.hypot(v.pose.x - 3, v.pose.y - 2) for v in (low, high)]
    assert distances[1] > distances[0] + 0.4
    row = image_point(CAMERA, high.pose, (3.0, 2.0, 0.8))[1]
    assert 0.08 * 480 <= row <= 0.92 * 480
    assert best_view(terrain(), target(3.0, 2.0, z=2.4), CAMERA, settings) is None


def test_doubts_that_lie_together_are_one_target():
    to_inspect = [
        PlacedRegion(region(1, 0.9), START, (2.0, 2.0, 0.0)),
        PlacedRegion(region(2, 1.0), START, (2.2, 2.0, 0.1)),
        PlacedRegion(region(3, 0.95), START, (4.0, 1.0, 0.0)),
        PlacedRegion(region(4, 1.0), START, None),
    ]
    first, second = gather(to_inspect)
    assert {placed.region.id for placed in first.to_inspect} == {1, 2} and first.weight == 1.9
    assert first.heights == (0.0, 0.1) and second.to_inspect[0].region.id == 3


def views_at(*points):
    return [View(Pose2(x, y, 0.0), target(x, y, doi=doi)) for x, y, doi in points]


def test_a_tour_is_short_and_keeps_to_its_budget():
    points = [(1.0, 3.5, 1), (2.0, 3.5, 1), (3.0, 3.5, 1), (4.0, 3.5, 1), (5.0, 3.5, 1)]
    shuffled = [points[k] for k in (3, 0, 4, 2, 1)]
    tour = plan_tour(terrain(), START, views_at(*shuffled), 20.0)
    assert [view.pose.x for view in tour.views] == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert tour.length == pytest.approx(5.5, abs=0.15) and not tour.left_out
    short = plan_tour(terrain(), START, views_at(*shuffled), 3.0)
    assert [view.pose.x for view in short.views] == [1.0, 2.0] and short.length <= 3.0
    assert len(short.left_out) == 3
    assert plan_tour(terrain(), START, [], 3.0).views == ()


def test_the_way_goes_around_walls():
    walls = terrain((2.9, 0.0, 3.0, 3.2))
    (view,) = views_at((4.0, 1.0, 1))
    tour = plan_tour(walls, Pose2(2.0, 1.0, 0.0), [view], 20.0)
    assert tour.length > 5.0
    steps = zip(tour.way[:-1], tour.way[1:], strict=True)
    assert sum(math.dist(a, b) for a, b in steps) == pytest.approx(tour.length, abs=0.3)
    assert max(y for _, y in tour.way) > 3.2
    assert plan_tour(walls, Pose2(2.0, 1.0, 0.0), [view], 4.0).left_out == (view,)


def test_of_two_the_one_with_more_doi_fits_the_budget():
    views = views_at((1.0, 3.5, 0.9), (2.5, 2.0, 2.7))
    tour = plan_tour(terrain(), START, views, 1.6)
    assert [view.target.weight for view in tour.views] == [2.7]


def test_a_viewpoint_inside_a_wall_sees_beyond_it():
    occupied = levels((0.95, 1.95, 1.1, 2.1), (2.5, 0.5, 2.6, 3.5)) == 0
    (placed,) = place_regions([region(box=(319, 139, 2, 2))], {1: START}, CAMERA, occupied, GRID)
    assert placed.place[0] == pytest.approx(2.5, abs=0.06)


def test_a_long_tour_is_planned_in_no_time_and_has_no_crossings():
    rng = np.random.default_rng(5)
    points = [(*rng.uniform((0.5, 0.5), (5.5, 3.5)), 1.0) for _ in range(60)]
    tour = plan_tour(terrain(), START, views_at(*points), 1000.0)
    assert len(tour.views) == 60
    stops = [(START.x, START.y), *((v.pose.x, v.pose.y) for v in tour.views)]
    # A tour by nearest neighbours and 2-opt is about 0.75 sqrt(n area) long.
    assert sum(math.dist(a, b) for a, b in pairwise(stops)) < 1.05 * math.sqrt(60 * 15)
