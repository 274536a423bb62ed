"""How sure an alignment is: kept with it, and given to whoever reads it."""

import zlib
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from reviewer.models.aligners.dense import DisAligner
from reviewer.models.detectors.difference import DifferenceDetector
from reviewer.models.interfaces import Alignment, Objects
from reviewer.pipeline.fields import load_confidence, pack_confidence, store_alignment
from reviewer.pipeline.members import build_members
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.pipeline.stored import warped_view
from reviewer.store.layers import load_alignment
from reviewer.store.pairs import pair_ids

SHAPE = (120, 160)
RISING = np.tile(np.linspace(0, 1, SHAPE[1], dtype=np.float32), (SHAPE[0], 1))
"""A confidence that rises from left to right."""


class SureAligner(DisAligner):
    """Aligns as `dis` does, and is surer on the right."""

    def align(self, reference, live):
        return replace(super().align(reference, live), confidence=RISING)


class ReadingDetector(DifferenceDetector):
    """Keeps the confidences that it was given."""

    given: ClassVar[list] = []

    def detect_confident(self, warped, live, valid, confidence):
        self.given.append(confidence)
        return self.detect(warped, live, valid)


@dataclass(frozen=True)
class LookingSegmenter:
    """Finds nothing, and keeps what it was shown."""

    views: ClassVar[list] = []

    def segment(self, view):
        self.views.append(view)
        return Objects((), ())


@pytest.fixture(autouse=True)
def nothing_kept():
    ReadingDetector.given.clear()
    LookingSegmenter.views.clear()


def do_run(db, name, **members):
    settings = PipelineSettings(segmenter="oversegment", detector="difference")
    made = replace(build_members(settings), **members)
    run = prepare_run(db, name, settings, made)
    report = run_pipeline(db, run, pair_ids(db), members=made)
    return run, report


def test_the_confidence_is_kept_and_given_to_those_who_read_it(db, tiny_split):
    detector, segmenter = ReadingDetector(), LookingSegmenter()
    run, report = do_run(db, "sure", aligner=SureAligner(), detector=detector, segmenter=segmenter)
    assert report.failures == [] and len(detector.given) == len(tiny_split)
    warped, valid, kept = warped_view(db, run, tiny_split[0])
    assert kept.dtype == np.float32 and kept.shape == valid.shape == warped.shape[:2]
    assert 0 <= kept.min() and kept.max() <= 1
    np.testing.assert_allclose(kept[:, 4:-4], RISING[:, 4:-4], atol=0.01)
    np.testing.assert_array_equal(detector.given[0], kept)
    np.testing.assert_array_equal(segmenter.views[0].confidence, kept)


def test_an_aligner_that_does_not_say_leaves_none(db, tiny_split):
    class Silent(DisAligner):
        def align(self, reference, live):
            return replace(super().align(reference, live), confidence=None)

    detector, segmenter = ReadingDetector(), LookingSegmenter()
    run, report = do_run(db, "plain", aligner=Silent(), detector=detector, segmenter=segmenter)
    assert report.failures == [] and detector.given == []
    assert warped_view(db, run, tiny_split[0])[2] is None
    assert segmenter.views[0].confidence is None


def test_a_confidence_that_is_none_fails_the_pair(db, tiny_split):
    class Wrong(DisAligner):
        def align(self, reference, live):
            return replace(super().align(reference, live), confidence=RISING * np.nan)

    _, report = do_run(db, "wrong", aligner=Wrong())
    assert "aligner: gave a confidence that is not in [0, 1]" in report.failures[0]


@pytest.mark.parametrize("shape", [(1, 1), (7, 10), (120, 161), (481, 640)])
def test_a_constant_confidence_comes_back_as_it_was(shape):
    image = np.zeros((*shape, 3), np.uint8)
    flow, everywhere = np.zeros((*shape, 2), np.float32), np.ones(shape, bool)
    sure = np.full(shape, 0.4, np.float32)
    kept = load_confidence(store_alignment(Alignment(flow, everywhere, None, sure), image, image))
    assert kept.shape == shape
    np.testing.assert_allclose(kept, 0.4, atol=1e-6)


def test_a_confidence_is_smaller_than_a_flow():
    rng = np.random.default_rng(0)
    noise = rng.uniform(0, 1, (480, 640)).astype(np.float32)
    assert len(pack_confidence(noise)) < 20_000
    flow = np.cumsum(rng.normal(0, 0.1, (120, 160, 2)), axis=1)
    assert len(pack_confidence(noise)) < len(zlib.compress((flow * 32).astype("<i2").tobytes()))


def test_a_run_that_takes_an_alignment_over_has_its_confidence(db, tiny_split):
    class Idle(DisAligner):
        def align(self, reference, live):
            raise AssertionError("the alignment is there already")

    first, _ = do_run(db, "first", aligner=SureAligner())
    second, report = do_run(db, "second", aligner=Idle())
    assert report.failures == []
    kept = [load_alignment(db, run.id, tiny_split[0].id).confidence_png for run in (first, second)]
    assert kept[0] and kept[0] == kept[1]
