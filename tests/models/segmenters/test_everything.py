"""SAM asked everywhere: the grid, the filters, the suppression, the real network."""

import numpy as np
import pytest
import torch
from checkpoints import write_sam2
from scenes import textured

from reviewer.errors import InvalidInput
from reviewer.models.interfaces import PairView
from reviewer.models.registry import build_segmenter
from reviewer.models.segmenters.everything import grid_points, suppress

LIVE = textured(4)
ALL = np.ones(LIVE.shape[:2], bool)
VIEW = PairView(LIVE, LIVE, ALL, ALL & False, (), LIVE, np.zeros((*ALL.shape, 2), np.float32))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_sam2(tmp_path_factory.mktemp("sam2"))


@pytest.fixture
def everything(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def build(**settings):
        own = {"sam": f"sam2:{folder}", "points_per_side": 4, "least_score": 0.0}
        return build_segmenter("sam-everything", {**own, "least_stability": 0.0, **settings})

    return build


def test_the_grid_lies_in_the_middle_of_square_cells():
    points = grid_points(120, 160, 4)
    assert points.shape == (12, 2)
    assert points[0].tolist() == [20, 20] and points[-1].tolist() == [140, 100]


def test_of_boxes_that_lie_over_each_other_the_best_stays():
    boxes = np.float32([[0, 0, 10, 10], [1, 0, 11, 10], [20, 20, 30, 30], [0, 0, 4, 4]])
    assert suppress(boxes, np.float32([0.5, 0.9, 0.7, 0.1]), 0.7) == [1, 2, 3]
    assert suppress(boxes, np.float32([0.5, 0.9, 0.7, 0.1]), 0.99) == [1, 2, 0, 3]


def test_both_images_are_searched_and_masks_are_small_enough(everything):
    found = everything(most_share=0.9).segment(VIEW)
    assert len(found.live) > 0 and len(found.live) == len(found.reference)
    assert all(20 <= thing.mask.sum() <= 0.9 * ALL.size for thing in found.live)
    assert [thing.score for thing in found.live] == sorted(
        (thing.score for thing in found.live), reverse=True
    )


def test_filters_are_sams_guess_stability_and_size(everything, monkeypatch):
    segmenter = everything(least_score=0.5, least_stability=0.9, least_px=20, most_share=0.5)
    logits = torch.full((1, 5, *ALL.shape), -5.0)
    logits[0, 0, 10:30, 10:30] = 5.0  # good
    logits[0, 1, 10:30, 40:60] = 0.5  # falls apart one logit higher
    logits[0, 2, :2, :2] = 5.0  # a speck
    logits[0, 3] = 5.0  # everything
    logits[0, 4, 50:70, 10:30] = 5.0  # SAM is not sure
    sure = np.float32([[0.8, 0.8, 0.8, 0.8, 0.3]])
    monkeypatch.setattr(segmenter._sam, "predict_points", lambda *a: (logits, sure))
    ((mask, score),) = segmenter._candidates({}, np.zeros((1, 2), np.float32))
    assert (mask.sum(), score) == (400, pytest.approx(0.8))


def test_points_give_what_single_clicks_give(everything):
    from reviewer.models.interfaces import Click, Prompt

    sam = everything()._sam
    embedding = sam.embed(LIVE, None)
    points = np.float32([[30, 40], [100, 60]])
    logits, sure = sam.predict_points(embedding, points)
    for k, (x, y) in enumerate(points):
        best = sam.predict(embedding, Prompt((Click(float(x), float(y)),)))[0]
        chosen = int(np.argmax(sure[k]))
        assert best.score == pytest.approx(float(sure[k, chosen]), abs=1e-5)
        assert ((logits[k, chosen] > 0).numpy() != best.mask).mean() < 1e-3


def test_a_grid_without_points_is_refused(everything):
    with pytest.raises(InvalidInput, match="points_per_side must be >= 1"):
        everything(points_per_side=0)
