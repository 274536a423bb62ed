"""Views are brought together as the pipeline does it, and sometimes badly, which shows."""

from collections import defaultdict

import numpy as np
import pytest
from scenes import textured
from tiny_views import block_bank

from reviewer.models.warping import warp_image
from reviewer.synthesis.views import ViewSettings, make_views
from reviewer.training.aligned_views import ALONE, TORN, TRUE_FLOW, WRONG, align_views

SIDE = 128


class Drawn:
    """A generator whose first draw is given: it says how the views are aligned."""

    def __init__(self, kind, seed=0):
        self._first, self._rng = [kind], np.random.default_rng(seed)

    def random(self):
        return self._first.pop() if self._first else self._rng.random()

    def __getattr__(self, name):
        return getattr(self._rng, name)


TORN_FROM, WRONG_FROM = TRUE_FLOW, TRUE_FLOW + TORN
KINDS = {
    "true": 0.0,
    "torn": TORN_FROM + TORN / 2,
    "wrong": WRONG_FROM + WRONG / 2,
    "alone": WRONG_FROM + WRONG + ALONE / 2,
    "own": 0.99,
}


@pytest.fixture(scope="module")
def made():
    settings = ViewSettings(side=SIDE)
    return [
        make_views(textured(k % 3), block_bank(), settings, np.random.default_rng(k))
        for k in range(6)
    ]


def test_shares_of_bad_alignments_leave_most_pairs_to_the_aligner():
    assert TRUE_FLOW + TORN + WRONG + ALONE < 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_alignment_keeps_to_the_live_frame(made, kind):
    for views in made:
        aligned = align_views(views, Drawn(KINDS[kind]))
        assert aligned.live is views.live
        assert aligned.warped.shape == views.live.shape and aligned.warped.dtype == np.uint8
        assert aligned.confidence.dtype == np.float32
        assert 0 <= aligned.confidence.min() and aligned.confidence.max() <= 1
        assert not (aligned.valid & (aligned.confidence == 0)).any()


def test_the_true_flow_is_followed_up_to_a_pixel_and_trusted(made):
    for views in made:
        aligned = align_views(views, Drawn(KINDS["true"]))
        assert aligned.valid.any() and (aligned.confidence[aligned.valid] == 1).all()
        exact = warp_image(views.reference, views.flow).astype(np.float32)
        near = np.abs(aligned.warped - exact)[aligned.valid].mean()
        far = np.abs(np.roll(aligned.warped, 20, axis=1) - exact)[aligned.valid].mean()
        assert near < 0.4 * far


def test_nothing_can_be_compared_where_there_is_no_reference(made):
    for views in made:
        aligned = align_views(views, Drawn(KINDS["alone"]))
        assert not aligned.valid.any() and not aligned.confidence.any()


def test_wrong_and_torn_alignments_match_worse_than_the_aligner_s_own(made):
    error = defaultdict(list)
    sure = defaultdict(list)
    for views in made:
        for kind, first in KINDS.items():
            aligned = align_views(views, Drawn(first))
            difference = np.abs(aligned.warped.astype(np.float32) - aligned.live).mean()
            error[kind].append(difference)
            sure[kind].append(aligned.confidence.mean())
    means = {kind: np.mean(values) for kind, values in error.items()}
    assert means["wrong"] > means["torn"] > means["own"]
    assert np.mean(sure["wrong"]) < 0.5 * np.mean(sure["own"])


def test_what_changed_is_all_that_came_or_went_by_the_truth(made):
    for views in made:
        aligned = align_views(views, Drawn(KINDS["own"]))
        every = np.zeros((SIDE, SIDE), bool)
        for thing in views.changed:
            every |= thing.mask
        assert np.array_equal(aligned.change, every)
        assert len(aligned.came) + len(aligned.went) == len(views.changed)
        assert aligned.seen is views.seen


def test_the_same_generator_state_gives_the_same_views(made):
    twice = [align_views(made[0], np.random.default_rng(4)) for _ in range(2)]
    assert np.array_equal(twice[0].warped, twice[1].warped)
    assert np.array_equal(twice[0].confidence, twice[1].confidence)
