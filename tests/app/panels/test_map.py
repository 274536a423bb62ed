"""The map's camera: it sees the whole floor, and has somewhere to stand above a single place."""

import numpy as np
import pytest

from reviewer.app.panels.map import place_camera


def test_above_a_single_viewpoint_without_a_map_the_camera_stands_apart_from_what_it_sees():
    place = np.array([2.0, 3.0])
    position, middle = place_camera(place, place, 1.0)
    assert middle == (2.0, 3.0, 0.0)
    assert position[2] > 1 and position[1] < 3.0


@pytest.mark.parametrize(("aspect", "away"), [(2.0, 8.0), (0.5, 12.4), (0.0, 31.0)])
def test_a_narrow_canvas_is_looked_at_from_further_away(aspect, away):
    position, middle = place_camera(np.array([0.0, 0.0]), np.array([10.0, 8.0]), aspect)
    assert middle == (5.0, 4.0, 0.0)
    assert position == pytest.approx((5.0, 4.0 - 0.5 * away, 1.05 * away))
