"""Counts and scores, by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reviewer.metrics import Counts, boundary_f, count, f_score, precision, recall, total

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
