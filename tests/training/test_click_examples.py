"""Simulated people: first clicks inside, next ones in the largest error, masks to correct."""

import cv2
import numpy as np
import pytest
from tiny_views import tiny_views

from reviewer.masks import intersection_over_union
from reviewer.models.clicks.windows import Sight, Square
from reviewer.models.interfaces import Click
from reviewer.models.nets.click_net import CHANNELS, SIDE
from reviewer.training.click_examples import (
    GOOD_ENOUGH,
    LEAST_PX,
    MOST_CLICKS,
    Episode,
    begin,
    corrupted,
    first_click,
    next_click,
)

SIZE = 120


def box(x0, y0, x1, y1):
    mask = np.zeros((SIZE, SIZE), bool)
    mask[y0:y1, x0:x1] = True
    return mask


def at(mask, click):
    return mask[int(click.y), int(click.x)]


def rng(seed=0):
    return np.random.default_rng(seed)


THING = box(40, 40, 80, 70)


@pytest.mark.parametrize("seed", range(8))
def test_a_first_click_lies_in_the_thing_and_not_at_its_rim(seed):
    click = first_click(THING, rng(seed))
    assert click.positive and at(THING, click)
    assert at(box(43, 43, 77, 67), click)


@pytest.mark.parametrize("seed", range(8))
def test_the_next_click_lies_deep_in_the_largest_error(seed):
    missing = box(40, 40, 70, 70)  # ten columns are missed
    click = next_click(missing, THING, rng(seed))
    assert click.positive and at(box(72, 43, 78, 67), click)
    too_much = THING | box(0, 0, 40, 40) | box(100, 100, 104, 104)
    click = next_click(too_much, THING, rng(seed))
    assert not click.positive and at(box(8, 8, 32, 32), click)
    # The larger of the two errors is corrected, whichever it is.
    both = box(40, 40, 78, 70) | box(0, 0, 20, 20)
    assert not next_click(both, THING, rng(seed)).positive
    both = box(40, 40, 60, 70) | box(0, 0, 4, 4)
    assert next_click(both, THING, rng(seed)).positive


def test_a_mask_without_an_error_gets_no_click():
    assert next_click(THING, THING.copy(), rng()) is None


def test_corrupted_masks_are_near_the_truth_but_not_it_and_differ_by_seed():
    overlaps = [intersection_over_union(corrupted(THING, rng(seed)), THING) for seed in range(40)]
    assert 0.4 < np.mean(overlaps) < 0.95
    assert sum(overlap < 1 for overlap in overlaps) >= 36
    masks = {corrupted(THING, rng(seed)).tobytes() for seed in range(40)}
    assert len(masks) > 30
    assert np.array_equal(corrupted(THING, rng(3)), corrupted(THING, rng(3)))
    assert corrupted(THING, rng(3)).shape == THING.shape


def episode(truth=THING, mask=None, square=None):
    picture = np.full((SIZE, SIZE, 3), 90, np.uint8)
    return Episode(
        Sight(picture, picture, np.ones((SIZE, SIZE), np.float32), np.zeros((SIZE, SIZE))), truth,
        np.zeros_like(truth) if mask is None else mask,
        square or Square(60, 55, 96), [Click(60.5, 55.5)],
    )  # fmt: skip


def test_an_episode_shows_its_window_and_the_truth_in_it():
    one = episode()
    assert one.window().shape == (CHANNELS, SIDE, SIDE)
    assert one.window()[10].any() and not one.window()[11:].any()
    truth, counts = one.target()
    assert truth.sum() == THING.sum()  # a window of 96 pixels shows each pixel as it is
    assert counts.min() == 1
    _, counts = episode(square=Square(0, 0, 96)).target()
    assert 0.2 < counts.mean() < 0.3  # three quarters of it lie outside the picture


def test_an_episode_follows_the_net_and_clicks_its_largest_error():
    one = episode()
    found = cv2.warpAffine(
        box(40, 40, 60, 70).astype(np.float32), one.square.matrix(), (SIDE, SIDE)
    )
    assert one.follow(found, rng())
    assert intersection_over_union(one.mask, box(40, 40, 60, 70)) > 0.9
    assert len(one.clicks) == 2 and one.clicks[1].positive
    assert at(box(60, 40, 80, 70), one.clicks[1])
    assert one.window()[12].any()


def test_an_episode_keeps_what_lies_outside_the_window():
    far = box(100, 100, 110, 110)
    one = episode(truth=THING | far, mask=far.copy(), square=Square(50, 50, 60))
    one.follow(np.zeros((SIDE, SIDE), np.float32), rng())
    assert np.array_equal(one.mask & far, far)


def test_an_episode_ends_when_the_mask_is_good_or_the_clicks_are_many():
    one = episode()
    exact = cv2.warpAffine(THING.astype(np.float32), one.square.matrix(), (SIDE, SIDE))
    assert not one.follow(exact, rng())
    assert intersection_over_union(one.mask, THING) > GOOD_ENOUGH
    tired = episode()
    for _ in range(MOST_CLICKS - 2):
        assert tired.follow(np.zeros((SIDE, SIDE), np.float32), rng())
    assert tired.follow(np.zeros((SIDE, SIDE), np.float32), rng())
    assert not tired.follow(np.zeros((SIDE, SIDE), np.float32), rng())
    assert len(tired.clicks) == MOST_CLICKS


def test_every_thing_of_the_views_that_changed_begins_an_episode_with_a_click_in_its_error():
    views, draw = tiny_views(160), rng()
    kinds = set()
    for _ in range(30):
        shown = views(draw)
        for one in begin(shown, shown.change.astype(np.float32), draw):
            assert np.count_nonzero(one.truth) >= LEAST_PX
            assert len(one.clicks) == 1
            (click,) = one.clicks
            assert at(one.truth, click) == click.positive
            assert click.positive or at(one.mask, click)
            assert (one.sight.picture is shown.live) != (one.sight.picture is shown.warped)
            kinds.add((bool(one.mask.any()), one.sight.picture is shown.live))
    assert kinds == {(False, False), (False, True), (True, False), (True, True)}
