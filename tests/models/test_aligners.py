"""Aligners: the direction of the flow, what is valid, and honest failures."""

import cv2
import numpy as np
import pytest
import skimage.data
from scenes import textured

from reviewer.errors import InvalidInput
from reviewer.models.interfaces import ModelFailed
from reviewer.models.registry import build_aligner, build_segmenter, open_detector
from reviewer.models.warping import warp_image, warp_mask


def shifted(image, dx, dy):
    """The same scene seen so that its content lies dx to the right and dy further down."""
    return np.roll(image, (dy, dx), axis=(0, 1))


def large(seed):
    return np.kron(textured(seed), np.ones((2, 2, 1), np.uint8))


@pytest.mark.parametrize("name", ["dis", "ecc", "homography"])
def test_a_known_shift_is_found_in_the_direction_live_to_reference(name):
    reference = large(3)
    live = shifted(reference, 6, -4)
    alignment = build_aligner(name).align(reference, live)
    inner = alignment.flow[40:-40, 40:-40]
    assert np.median(inner[..., 0]) == pytest.approx(-6, abs=0.3)
    assert np.median(inner[..., 1]) == pytest.approx(4, abs=0.3)
    warped = warp_image(reference, alignment.flow).astype(int)
    error = np.abs(warped - live)[alignment.valid].mean()
    assert error < 0.35 * np.abs(reference.astype(int) - live)[alignment.valid].mean()


@pytest.mark.parametrize("name", ["dis", "ecc", "homography"])
def test_what_leaves_the_reference_is_not_valid(name):
    reference = large(4)
    alignment = build_aligner(name).align(reference, shifted(reference, 20, 0))
    assert not alignment.valid[40:-40, :12].any()
    assert alignment.valid[40:-40, 60:-60].mean() > 0.95


def test_a_new_object_does_not_bend_the_flow():
    reference = large(5)
    live = reference.copy()
    live[100:130, 140:180] = (250, 10, 10)
    alignment = build_aligner("dis").align(reference, live)
    # Believed flow may still be off by the disagreement that is allowed, and no more than that.
    around = np.abs(alignment.flow[95:135, 135:185])
    assert np.median(around) < 0.1 and around.max() < 2.0
    assert alignment.valid[100:130, 140:180].all()


def test_photographs_that_have_nothing_in_common_are_unseen():
    one, other = (
        cv2.resize(picture, (640, 480))
        for picture in (skimage.data.astronaut(), skimage.data.coffee())
    )
    alignment = build_aligner("dis").align(one, other)
    assert alignment.confidence.dtype == np.float32
    assert alignment.confidence.min() >= 0 and alignment.confidence.max() <= 1
    assert alignment.valid.mean() < 0.1
    np.testing.assert_array_equal(alignment.valid, alignment.confidence >= 0.25)


def test_a_large_new_object_in_a_still_view_is_compared_with_what_lay_behind_it():
    reference = large(8)
    live = reference.copy()
    live[60:180, 100:200] = large(9)[60:180, 100:200]
    alignment = build_aligner("dis").align(reference, live)
    assert alignment.valid[60:180, 100:200].mean() > 0.95


def test_clipped_pixels_are_no_evidence_unless_the_reference_is_dark_there():
    reference = large(10) // 3
    live = reference.copy()
    reference[40:80, 40:80] = 200
    live[40:80, 40:80] = 255  # the same bright thing, burnt out
    live[120:160, 120:160] = 255  # a bright thing that came
    alignment = build_aligner("dis").align(reference, live)
    assert not alignment.valid[44:76, 44:76].any()
    assert alignment.valid[124:156, 124:156].all()


def test_a_shift_beyond_the_reach_of_dense_flow_is_found_from_matched_features():
    # Features need a picture; this one repeats nothing.
    scene = cv2.GaussianBlur(cv2.resize(skimage.data.astronaut(), (640, 480)), (0, 0), 0.8)
    reference, live = scene[:400, :440], scene[30:430, 150:590]
    plain = build_aligner("dis", {"starts": 0}).align(reference, live)
    found = build_aligner("dis").align(reference, live)
    there = np.s_[60:340, 20:260]
    assert plain.valid[there].mean() < 0.5
    assert found.valid[there].mean() > 0.9
    assert np.median(found.flow[there][..., 0]) == pytest.approx(150, abs=1)
    assert np.median(found.flow[there][..., 1]) == pytest.approx(30, abs=1)
    back = found.backward[90:340, 180:400]
    assert np.median(back[..., 0]) == pytest.approx(-150, abs=1)


def test_a_view_without_features_fails_by_name():
    blank = np.full((120, 160, 3), 128, np.uint8)
    with pytest.raises(ModelFailed, match="aligner homography: an image has no features"):
        build_aligner("homography").align(blank, blank)


def test_images_of_two_sizes_fail_by_name():
    with pytest.raises(ModelFailed, match="aligner dis: needs images of one size"):
        build_aligner("dis").align(textured(0), large(0))


def test_masks_warp_by_nearest_neighbour_and_are_false_outside():
    mask = np.zeros((6, 6), bool)
    mask[2, 2] = True
    flow = np.zeros((6, 6, 2), np.float32)
    flow[..., 0] = -1
    warped = warp_mask(mask, flow)
    assert warped[2, 3] and warped.sum() == 1


@pytest.mark.parametrize("build", [build_aligner, open_detector, build_segmenter])
def test_unknown_names_and_settings_are_told_what_there_is(build):
    with pytest.raises(InvalidInput, match="'nothing': unknown; there are "):
        build("nothing")


def test_an_unknown_setting_is_refused():
    with pytest.raises(InvalidInput, match=r"detector difference: .*colour"):
        open_detector("difference", {"colour": 1})
