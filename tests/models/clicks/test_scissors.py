"""Paths follow edges."""

import numpy as np

from reviewer.models.clicks.scissors import Scissors


def picture():
    image = np.full((120, 160, 3), 60, np.uint8)
    image[30:90, 40:120] = (200, 190, 60)
    return image


def test_a_path_goes_around_a_corner_along_the_edge():
    points = np.array(Scissors().path("a", picture, (60, 30), (40, 70)))
    assert tuple(points[0]) == (60, 30) and tuple(points[-1]) == (40, 70)
    on_edge = (np.abs(points[:, 0] - 40) <= 2) | (np.abs(points[:, 1] - 30) <= 2)
    assert on_edge.mean() > 0.9
    assert (np.abs(np.diff(points, axis=0)) <= 1).all()


def test_a_map_is_made_once_for_a_start():
    calls = []

    def load():
        calls.append(1)
        return picture()

    scissors = Scissors()
    for end in ((40, 70), (100, 30), (119, 60)):
        scissors.path("a", load, (60, 30), end)
    assert len(calls) == 1
    scissors.path("a", load, (61, 30), (40, 70))
    assert len(calls) == 2


def test_an_end_out_of_reach_is_joined_straight():
    wide = np.zeros((50, 900, 3), np.uint8)
    points = Scissors().path("a", lambda: wide, (5, 20), (890, 20))
    assert points[0] == (5, 20) and points[-1] == (890, 20)
