"""Planar poses and the grid's frame."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reviewer.geometry import (
    Grid,
    Pose2,
    cell_at,
    cell_centre,
    compose,
    inverse,
    viewpoint_distance,
    viewpoint_distances,
    wrap_angle,
)

metres = st.floats(-50, 50)
angles = st.floats(-10, 10)
poses = st.builds(Pose2, metres, metres, angles)


@given(angles)
def test_a_wrapped_angle_points_the_same_way(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)


@given(poses)
def test_a_pose_and_its_inverse_cancel(pose):
    nothing = compose(pose, inverse(pose))
    assert (nothing.x, nothing.y) == (pytest.approx(0, abs=1e-9), pytest.approx(0, abs=1e-9))
    assert math.cos(nothing.theta) == pytest.approx(1)


def test_viewpoint_distance_counts_heading_over_the_wrap():
    first, second = Pose2(0, 0, math.pi - 0.1), Pose2(0.3, 0, -math.pi + 0.1)
    assert viewpoint_distance(first, second) == pytest.approx(math.hypot(0.3, 0.2))
    assert viewpoint_distance(first, second, metres_per_radian=0) == pytest.approx(0.3)


@given(st.lists(poses, min_size=1, max_size=4), st.lists(poses, min_size=1, max_size=4))
def test_the_matrix_agrees_with_the_pairs(first, second):
    rows = [np.array([[p.x, p.y, p.theta] for p in side]) for side in (first, second)]
    matrix = viewpoint_distances(*rows, metres_per_radian=0.7)
    for i, a in enumerate(first):
        for j, b in enumerate(second):
            expected = viewpoint_distance(a, b, metres_per_radian=0.7)
            assert matrix[i, j] == pytest.approx(expected, abs=1e-6)


def test_the_lower_left_cell_lies_at_the_origin():
    grid = Grid(0.05, 100, 200, Pose2(-1.0, -2.0, 0.0))
    assert cell_centre(grid, 99, 0) == (pytest.approx(-0.975), pytest.approx(-1.975))
    assert cell_at(grid, -0.975, -1.975) == (99, 0)


@given(st.integers(0, 99), st.integers(0, 199), st.floats(-3, 3))
def test_cells_and_metres_round_trip_on_a_turned_grid(row, column, theta):
    grid = Grid(0.05, 100, 200, Pose2(3.0, -2.0, theta))
    assert cell_at(grid, *cell_centre(grid, row, column)) == (row, column)
