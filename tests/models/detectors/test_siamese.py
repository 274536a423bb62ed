"""`siamese-lite` on pictures of any size: padded, 0 where nothing is compared, weights checked."""

import numpy as np
import pytest
import torch
from scenes import textured

from reviewer.errors import InvalidInput, NotFound
from reviewer.models.detectors.siamese import SiameseLiteDetector
from reviewer.models.interfaces import ModelFailed
from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.siamese_lite import SiameseLite
from reviewer.models.nets.small import save_small
from reviewer.models.registry import DETECTORS


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    """Random weights whose logits are about zero, so that nothing saturates."""
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "siamese-lite.safetensors"
    save_small(path, SiameseLite().eval(), "siamese-lite", {})
    return path


@pytest.fixture(scope="module")
def detector(weights):
    return SiameseLiteDetector(str(weights))


def pair(height, width):
    return textured(0)[:height, :width], textured(1)[:height, :width]


@pytest.mark.parametrize("size", [(64, 64), (97, 113), (120, 160), (65, 158)])
def test_a_picture_of_any_size_gets_a_probability_for_every_pixel(detector, size):
    live, warped = pair(*size)
    found = detector.detect(warped, live, np.ones(size, bool))
    assert found.shape == size and found.dtype == np.float32
    assert found.min() > 0 and found.max() < 1


def test_padding_does_not_reach_the_pixels_that_a_whole_picture_has(detector):
    live, warped = pair(112, 160)
    whole = detector.detect(warped, live, np.ones((112, 160), bool))
    odd = detector.detect(warped[:105], live[:105], np.ones((105, 160), bool))
    assert np.abs(odd[:40] - whole[:40]).max() < 0.02


def test_nothing_has_changed_where_nothing_can_be_compared(detector):
    live, warped = pair(120, 160)
    valid = np.ones((120, 160), bool)
    valid[:, :70] = False
    found = detector.detect(warped, live, valid)
    assert not found[~valid].any() and found[valid].all()


def test_the_net_is_told_how_sure_the_alignment_is(detector):
    live, warped = pair(120, 160)
    valid = np.ones((120, 160), bool)
    sure = detector.detect(warped, live, valid)
    same = detector.detect_confident(warped, live, valid, np.ones((120, 160), np.float32))
    assert np.array_equal(sure, same)
    unsure = detector.detect_confident(warped, live, valid, np.full((120, 160), 0.2, np.float32))
    assert np.abs(sure - unsure).max() > 1e-3
    # Outside of what can be compared no confidence counts.
    valid[:60] = False
    high = detector.detect_confident(warped, live, valid, np.ones((120, 160), np.float32))
    assert np.array_equal(high, detector.detect(warped, live, valid))


def test_pictures_that_are_too_small_are_refused(detector):
    live, warped = pair(63, 160)
    with pytest.raises(ModelFailed, match="siamese-lite: needs 64 pixels a side, not 160x63"):
        detector.detect(warped, live, np.ones((63, 160), bool))


def test_a_run_that_began_with_other_weights_is_refused(detector, weights):
    assert SiameseLiteDetector(str(weights), detector.weights).weights == detector.weights
    with pytest.raises(InvalidInput, match=r"siamese-lite\.safetensors"):
        SiameseLiteDetector(str(weights), SiameseLiteDetector().weights)


def test_the_registry_builds_it_with_and_without_a_file(detector, weights):
    build = DETECTORS["siamese-lite"]
    assert build(checkpoint=str(weights)).weights == detector.weights
    assert build().weights == SiameseLiteDetector().weights != detector.weights


def test_files_that_will_not_do_are_named(tmp_path):
    with pytest.raises(NotFound, match=r"no\.safetensors: weights of siamese-lite do not exist"):
        SiameseLiteDetector(str(tmp_path / "no.safetensors"))
    save_small(tmp_path / "a.safetensors", ClickNet((4, 8, 8, 8, 8)), "click-net", {})
    with pytest.raises(InvalidInput, match="'click-net', but siamese-lite is wanted"):
        SiameseLiteDetector(str(tmp_path / "a.safetensors"))
