"""Windows: there and back to less than a pixel, large ones averaged, discs after zooming."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reviewer.models.clicks.windows import (
    DIFFERENCE_GAIN,
    DISC_PX,
    LEAST_SIDE_PX,
    LOOSE,
    Sight,
    Square,
    look,
    placed_back,
    square_around,
)
from reviewer.models.interfaces import Click
from reviewer.models.nets.click_net import CHANNELS, SIDE

HEIGHT, WIDTH = 150, 200


def ramp():
    """A picture whose values tell where they are: x in red, y in green."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    return np.dstack([x, y, np.zeros_like(x)])


def seen(picture, square, clicks=(), previous=None, other=None, confidence=1.0, change=0.0):
    sure = np.full(picture.shape[:2], confidence, np.float32)
    sight = Sight(picture, picture if other is None else other, sure, change * sure)
    return look(sight, square, clicks, previous)


squares = st.builds(Square, st.floats(70, 130), st.floats(60, 90), st.floats(20, 110))


@given(squares)
def test_a_square_is_seen_and_put_back_to_less_than_a_tenth_of_a_pixel(square):
    window = seen(ramp(), square)[0] * 255
    back, covered = placed_back(window, square, (HEIGHT, WIDTH))
    inner = Square(square.x, square.y, 0.8 * square.side)
    _, within = placed_back(window, inner, (HEIGHT, WIDTH))
    assert covered[within].all() and within.any()
    assert np.abs(back - ramp()[..., 0])[within].max() < 0.1


@given(squares)
def test_a_large_window_has_its_middle_where_a_small_one_has(square):
    large = Square(square.x, square.y, 4 * square.side + 2 * SIDE)
    window = seen(ramp(), large)[:2, SIDE // 2 - 1 : SIDE // 2 + 1, SIDE // 2 - 1 : SIDE // 2 + 1]
    # The picture's coordinates count pixels' corners, its values their centres.
    assert window[0].mean() * 255 == pytest.approx(square.x - 0.5, abs=0.6)
    assert window[1].mean() * 255 == pytest.approx(square.y - 0.5, abs=0.6)


def test_a_large_window_averages_and_does_not_skip():
    stripes = np.zeros((480, 480, 3), np.float32)
    stripes[:, ::4] = 240
    window = seen(stripes, Square(240, 240, 384))[0] * 255
    assert np.abs(window[8:-8, 8:-8] - 60).max() < 1


def test_pictures_difference_and_confidence_lie_where_the_net_expects_them():
    picture = np.full((HEIGHT, WIDTH, 3), (200, 100, 50), np.float32)
    other = np.full((HEIGHT, WIDTH, 3), (100, 100, 60), np.float32)
    window = seen(picture, Square(100, 75, 96), other=other, confidence=0.5)
    assert window.shape == (CHANNELS, SIDE, SIDE) and window.dtype == np.float32
    middle = window[:, 48, 48]
    assert middle[:6] * 255 == pytest.approx([200, 100, 50, 100, 100, 60], abs=1e-3)
    apart = np.array([100, 0, 10]) / 255 * DIFFERENCE_GAIN * 0.5
    assert middle[6:9] == pytest.approx(apart, abs=1e-4)
    assert middle[9] == pytest.approx(0.5) and not middle[10:].any()


def test_what_a_detector_says_is_shown_and_ends_at_the_picture():
    picture = np.full((HEIGHT, WIDTH, 3), 120, np.float32)
    window = seen(picture, Square(0, 75, 96), change=0.7)
    assert not window[13, :, :46].any()
    assert window[13, 5:-5, 50:] == pytest.approx(0.7)


def test_nothing_of_the_other_time_is_shown_where_it_says_nothing():
    picture, other = np.full((2, HEIGHT, WIDTH, 3), 90, np.float32)
    window = seen(picture, Square(100, 75, 96), other=other + 50, confidence=0.0)
    assert window[:3].any() and not window[3:].any()


@pytest.mark.parametrize("side", [32.0, 96.0, 384.0])
def test_a_click_is_a_disc_of_the_same_size_in_every_window(side):
    clicks = [Click(100.5, 75.5), Click(100.5 - side / 4, 75.5, False)]
    window = seen(np.zeros((HEIGHT, WIDTH, 3), np.float32), Square(100.5, 75.5, side), clicks)
    for channel, x in ((10, SIDE / 2 - 0.5), (11, SIDE / 4 - 0.5)):
        rows, columns = np.nonzero(window[channel])
        assert columns.mean() == pytest.approx(x, abs=0.6)
        assert rows.mean() == pytest.approx(SIDE / 2 - 0.5, abs=0.6)
        assert np.ptp(columns) == 2 * DISC_PX


def test_the_mask_so_far_ends_at_the_picture_and_the_picture_goes_on():
    mask = np.ones((HEIGHT, WIDTH), bool)
    picture = np.full((HEIGHT, WIDTH, 3), 120, np.float32)
    window = seen(picture, Square(0, 75, 96), previous=mask)
    assert not window[12, :, :46].any() and (window[12, 5:-5, 50:] == 1).all()
    assert window[0].min() > 0.4


def test_a_second_look_holds_mask_and_clicks_with_room_around():
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[40:80, 60:120] = True
    square = square_around(mask, [Click(130, 60)])
    assert (square.x, square.y) == (95, 60)
    assert square.side == pytest.approx(LOOSE * 70)
    empty = np.zeros_like(mask)
    assert square_around(empty, [Click(20, 30)]) == Square(20, 30, LEAST_SIDE_PX)


def test_what_lies_beside_the_picture_covers_nothing():
    values = np.ones((SIDE, SIDE), np.float32)
    full, covered = placed_back(values, Square(-100, 50, 96), (HEIGHT, WIDTH))
    assert not covered.any() and not full.any()
    full, covered = placed_back(values, Square(0, 0, 96), (HEIGHT, WIDTH))
    assert covered.sum() == 48 * 48 and (full[covered] == 1).all()


def test_a_mask_keeps_its_outline_there_and_back():
    mask = np.zeros((HEIGHT, WIDTH), bool)
    cv2.circle(mask.view(np.uint8), (100, 75), 25, 1, -1)
    square = square_around(mask, [])
    window = seen(np.zeros((HEIGHT, WIDTH, 3), np.float32), square, previous=mask)[12]
    back, _ = placed_back(window, square, (HEIGHT, WIDTH))
    assert np.count_nonzero((back > 0.5) ^ mask) < 0.02 * np.count_nonzero(mask)
