"""Counts and scores, by hand."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from reviewer.metrics import (
    Counts,
    border_px,
    boundary_f,
    boundary_ious,
    count,
    f_score,
    precision,
    recall,
    total,
    unseen_share,
)

EMPTY, FULL = np.zeros((2, 3), bool), np.ones((2, 3), bool)


@pytest.mark.parametrize(
    ("predicted", "truth", "expected"),
    [(EMPTY, EMPTY, Counts(0, 0, 0, 6)), (FULL, EMPTY, Counts(0, 6, 0, 0)),
     (EMPTY, FULL, Counts(0, 0, 6, 0)), (FULL, FULL, Counts(6, 0, 0, 0))],
)  # fmt: skip
def test_counts_of_empty_and_full_masks(predicted, truth, expected):
    assert count(predicted, truth) == expected


def test_ignored_pixels_are_left_out_of_all_four():
    ignore = np.zeros((2, 3), bool)
    ignore[0] = True
    assert count(FULL, EMPTY, ignore) == Counts(0, 3, 0, 0, 3)


def test_unseen_pixels_are_left_out_of_all_four():
    valid, ignore = FULL.copy(), EMPTY.copy()
    valid[0] = False
    assert count(FULL, EMPTY, None, valid) == Counts(0, 3, unseen_px=3)
    ignore[:, 0] = True
    counts = count(FULL, EMPTY, ignore, valid)
    assert counts == Counts(0, 2, ignored=2, unseen_px=2), "an ignored pixel counted as unseen"
    assert counts + counts == Counts(0, 4, ignored=4, unseen_px=4)


def test_the_share_of_unseen_pixels_is_of_those_that_are_not_ignored():
    assert unseen_share(Counts(1, 1, 1, 3, ignored=100, unseen_px=2)) == 0.25
    assert unseen_share(Counts(ignored=6)) == 0.0


def test_a_changed_object_is_unseen_when_none_of_its_pixels_is_seen():
    truth, valid = np.zeros((4, 9), bool), np.ones((4, 9), bool)
    truth[0:2, 0:2] = truth[0:2, 4:6] = truth[3, 7:9] = True
    valid[0:2, 0:3] = valid[0, 4] = False
    hidden = count(truth & False, truth, None, valid)
    assert (hidden.unseen_objects, hidden.fn) == (1, 3 + 2)
    # An object that only ignored pixels keep from being unseen as a whole is unseen.
    ignore = np.zeros_like(truth)
    ignore[0, 5] = ignore[1, 4:6] = ignore[3] = True
    assert count(truth & False, truth, ignore, valid).unseen_objects == 2
    assert count(truth & False, truth, ignore).unseen_objects == 0


def test_one_wrong_pixel():
    predicted, truth = EMPTY.copy(), EMPTY.copy()
    predicted[0, 0] = predicted[0, 1] = truth[0, 0] = True
    counts = count(predicted, truth)
    assert (precision(counts), recall(counts)) == (0.5, 1.0)
    assert f_score(counts) == pytest.approx(2 / 3)


def test_zero_over_zero_is_the_named_value():
    assert f_score(Counts(tn=5)) == 0.0
    assert f_score(Counts(tn=5), zero_over_zero=1.0) == 1.0


pixels = st.integers(0, 10**9)


@given(pixels, pixels, pixels)
def test_f_is_the_harmonic_mean(tp, fp, fn):
    counts = Counts(tp, fp, fn)
    p, r = precision(counts), recall(counts)
    expected = 2 * p * r / (p + r) if p + r else 0.0
    assert f_score(counts) == pytest.approx(expected)


def test_pooling_adds_up():
    assert total([Counts(1, 2, 3, 4, 5), Counts(1, 1, 1, 1, 1)]) == Counts(2, 3, 4, 5, 6)


def test_boundary_f_forgives_what_lies_within_the_tolerance():
    truth = np.zeros((40, 60), bool)
    truth[10:30, 10:40] = True
    shifted = np.roll(truth, 2, axis=1)
    assert boundary_f(truth, truth, 0) == 1.0
    scores = [boundary_f(shifted, truth, tolerance) for tolerance in (1, 2, 3)]
    assert scores[0] < 1.0 and scores[1:] == [1.0, 1.0]


def test_boundary_f_by_hand():
    # A pixel apart: each boundary is one pixel, one step from the other.
    one, other = np.zeros((5, 5), bool), np.zeros((5, 5), bool)
    one[2, 2] = other[2, 3] = True
    assert boundary_f(one, other, 0) == 0.0
    assert boundary_f(one, other, 1) == 1.0
    # Half of our boundary is right, all of theirs is found: 2 * 0.5 * 1 / 1.5.
    both = one.copy()
    both[0, 0] = True
    assert boundary_f(both, one, 0) == pytest.approx(2 / 3)


def test_boundary_f_of_empty_masks():
    empty, some = np.zeros((5, 5), bool), np.ones((5, 5), bool)
    assert boundary_f(empty, empty, 1) == 1.0
    assert boundary_f(empty, some, 1) == boundary_f(some, empty, 1) == 0.0


def square(y0, y1, x0, x1):
    mask = np.zeros((60, 80), bool)
    mask[y0:y1, x0:x1] = True
    return mask


def test_the_border_is_two_percent_of_the_diagonal_and_never_less_than_a_pixel():
    assert border_px(480, 640, 0.02) == 16 and border_px(480, 640, 0.005) == 4
    assert border_px(60, 80, 0.02) == 2 and border_px(6, 8, 0.02) == 1


def test_boundary_iou_by_hand():
    truth, shifted = square(20, 40, 20, 40), square(20, 40, 21, 41)
    # Rings 2 px wide of 400 - 256 = 144 px each. They share 19 px in each of the four outer rows
    # and 2 px in each of the sixteen others: 108 of 2 * 144 - 108.
    assert boundary_ious(shifted, truth, (2,)) == (108 / 180,)
    assert boundary_ious(truth, truth, (1, 2, 50)) == (1.0, 1.0, 1.0)
    # A hole of one pixel deep inside is a border of its own: 8 px around it, 1 px wide.
    holed = truth.copy()
    holed[30, 30] = False
    assert boundary_ious(holed, truth, (1,)) == (76 / 84,)


def test_where_the_border_fills_the_object_boundary_iou_is_iou():
    truth, shifted = square(10, 13, 10, 13), square(10, 13, 11, 14)
    assert boundary_ious(shifted, truth, (1, 2)) == (pytest.approx(4 / 12), 6 / 12)


def test_an_object_that_the_image_cuts_has_a_border_there_too():
    # Without the image's edge the ring would be 39 px.
    cut = square(0, 20, 0, 20)
    assert boundary_ious(cut, square(0, 1, 0, 20), (1,)) == (20 / 76,)


def test_boundary_iou_of_empty_masks():
    empty, some = square(0, 0, 0, 0), square(1, 5, 1, 5)
    assert boundary_ious(empty, empty, (1, 2)) == (1.0, 1.0)
    assert boundary_ious(empty, some, (1,)) == boundary_ious(some, empty, (1,)) == (0.0,)


def eroded_band(mask, distance):
    """The band as the authors of Boundary IoU cut it: the mask without its erosion."""
    padded = np.pad(mask, 1).astype(np.uint8)
    inner = cv2.erode(padded, np.ones((3, 3), np.uint8), iterations=distance)[1:-1, 1:-1]
    return mask & (inner == 0)


@given(arrays(np.bool_, (17, 23)), arrays(np.bool_, (17, 23)), st.integers(1, 4))
def test_the_band_is_that_of_the_authors_of_boundary_iou(one, other, distance):
    ours, theirs = eroded_band(one, distance), eroded_band(other, distance)
    either = np.count_nonzero(ours | theirs)
    expected = np.count_nonzero(ours & theirs) / either if either else 1.0
    assert boundary_ious(one, other, (distance,))[0] == pytest.approx(expected)
