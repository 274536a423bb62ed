"""What a detector may have said: right, blurred, cut to a mask, with losses and inventions."""

import numpy as np
import pytest
from tiny_views import tiny_views

from reviewer.training.said_changes import said_of


class Knows:
    """A detector that is always right, and counts how often it is asked."""

    def __init__(self):
        self.asked = 0

    def detect_confident(self, warped, live, valid, confidence):
        self.asked += 1
        return self.views.change.astype(np.float32) * 0.9


def said(detector, seed):
    rng = np.random.default_rng(seed)
    detector.views = tiny_views(120)(rng)
    return detector.views, said_of(detector.views, detector, rng)


def test_a_detector_is_mostly_right_and_silent_in_part_of_the_views():
    detector, silent, agreement, masks = Knows(), 0, [], 0
    for seed in range(60):
        views, found = said(detector, seed)
        assert found.dtype == np.float32 and found.shape == views.change.shape
        assert 0 <= found.min() and found.max() <= 1
        assert not found[~views.valid].any()
        changed = views.change & views.valid
        if not changed.any():
            continue
        if not found.any():
            silent += 1
            continue
        agreement.append(((found > 0.5) == changed)[views.valid].mean())
        masks += set(np.unique(found)) <= {0.0, 1.0}
    assert 5 < silent < 30 and detector.asked < 60
    assert np.mean(agreement) > 0.9 and min(agreement) < 0.999
    assert 3 < masks < len(agreement)


def test_things_are_dropped_and_invented():
    detector, dropped, invented = Knows(), 0, 0
    for seed in range(80):
        views, found = said(detector, seed)
        if not found.any():
            continue
        things = [t & views.valid for t in (*views.came, *views.went)]
        dropped += any(t.sum() > 30 and (found[t] > 0.4).mean() < 0.1 for t in things)
        invented += (found[~views.change] > 0.6).sum() > 20
    assert dropped and invented


@pytest.mark.parametrize("seed", range(3))
def test_the_same_generator_state_gives_the_same_answer(seed):
    assert np.array_equal(said(Knows(), seed)[1], said(Knows(), seed)[1])
