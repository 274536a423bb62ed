"""The two pictures swapped: a detector that compares stands, one that learnt an order falls."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from reviewer.errors import InvalidInput
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.swapping import swap_pictures
from reviewer.masks import encode_rle
from reviewer.models.interfaces import ModelFailed
from reviewer.models.registry import DETECTORS
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import IMPORTED, PipelineSettings
from reviewer.store.pairs import pair_ids
from reviewer.store.revisions import NewRevision, add_revision, newest_revision
from reviewer.store.runs import complete_settings, run_of_name


def redness(picture):
    return picture[..., 0].astype(int) - picture[..., 1]


@dataclass
class Even:
    """Changed is where one picture is much redder than the other."""

    def detect(self, warped, live, valid):
        changed = np.abs(redness(live) - redness(warped)) > 120
        return np.where(changed & valid, 0.9, 0.1).astype(np.float32)


@dataclass
class OrderBound:
    """Knows one thing: what is new is red, in the live picture."""

    def detect(self, warped, live, valid):
        return np.where((redness(live) > 150) & valid, 0.9, 0.1).astype(np.float32)


@pytest.fixture
def finished(db, tiny_split, monkeypatch):
    """Finish a run of one of these detectors and count it."""
    monkeypatch.setitem(DETECTORS, "even", Even)
    monkeypatch.setitem(DETECTORS, "order-bound", OrderBound)

    def make(detector):
        run = prepare_run(
            db, detector, PipelineSettings(segmenter="oversegment", detector=detector)
        )
        run_pipeline(db, run, pair_ids(db))
        refresh_counts(db)
        return run

    return make


def test_an_even_detector_stands(db, finished):
    found = swap_pictures(db, finished("even"))
    assert [(row["split"], row["pairs"]) for row in found.splits] == [("cs1", 3), ("mean", 3)]
    assert found.splits[-1]["F"] > 0.9
    assert found.splits[-1]["swapped"] == found.splits[-1]["F"]
    assert (found.change.value, found.change.low, found.change.high) == (0, 0, 0)
    assert found.failures == []


def test_a_detector_that_learnt_an_order_falls(db, finished):
    found = swap_pictures(db, finished("order-bound"))
    mean = found.splits[-1]
    assert mean["F"] > 0.9 and mean["swapped"] == 0
    assert mean["change"] == pytest.approx(found.change.value) and found.change.low < -0.5


def test_the_detector_sees_the_same_pixels_in_each_others_place(db, finished, monkeypatch):
    seen = []

    class Spy(Even):
        def detect(self, warped, live, valid):
            seen.append((warped.copy(), live.copy(), valid.copy()))
            return super().detect(warped, live, valid)

    monkeypatch.setitem(DETECTORS, "even", Spy)
    swap_pictures(db, finished("even"))
    assert len(seen) == 6 and (seen[0][0] != seen[0][1]).any()
    for usual, other in zip(seen[:3], seen[3:], strict=True):
        assert (usual[0] == other[1]).all() and (usual[1] == other[0]).all()
        assert (usual[2] == other[2]).all()


def test_pairs_that_cannot_be_detected_again_are_named_and_in_no_figure(db, finished):
    run = finished("even")

    class Fails(Even):
        def detect(self, warped, live, valid):
            if redness(warped).max() < 150:
                raise ModelFailed("even: sees nothing red")
            return super().detect(warped, live, valid)

    found = swap_pictures(db, run, detector=Fails())
    assert found.failures == ["pair cs1/0002: even: sees nothing red"]
    assert [row["pairs"] for row in found.splits] == [2, 2]


def test_probabilities_that_are_not_finite_are_a_failure(db, finished):
    class Mad(Even):
        def detect(self, warped, live, valid):
            return np.full(valid.shape, np.nan, np.float32)

    found = swap_pictures(db, finished("even"), detector=Mad())
    assert len(found.failures) == 3 and "are not finite" in found.failures[0]
    assert found.splits == [] and math.isnan(found.change.value)


def test_what_is_not_to_be_scored_counts_in_neither_order(db, finished, tiny_split):
    run = finished("even")
    everything = encode_rle(np.ones((120, 160), bool))
    for pair in tiny_split:
        now = newest_revision(db, pair.id)
        add_revision(db, NewRevision(pair.id, now.mask, now.number, ignore=everything))
    refresh_counts(db)
    found = swap_pictures(db, run)
    assert {(row["F"], row["swapped"]) for row in found.splits} == {(0.0, 0.0)}


def test_imported_detections_cannot_be_made_again(db, finished):
    run = finished("even")
    complete_settings(db, run.id, {**run.settings, "detector": IMPORTED})
    with pytest.raises(InvalidInput, match=r"run even: its detections were imported"):
        swap_pictures(db, run_of_name(db, "even"))


def test_progress_names_the_pair_that_is_next(db, finished):
    steps = []
    swap_pictures(db, finished("even"), lambda *step: steps.append(step))
    assert steps == [(0, 3, "cs1/0000"), (1, 3, "cs1/0001"), (2, 3, "cs1/0002")]
