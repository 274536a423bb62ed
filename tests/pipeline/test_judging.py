"""How an alignment is judged: reach, way back, what it leaves over."""

import cv2
import numpy as np
import pytest
from scenes import textured

from reviewer.models.interfaces import Alignment
from reviewer.models.registry import build_aligner
from reviewer.models.warping import warp_image
from reviewer.pipeline.fields import store_detection
from reviewer.pipeline.judging import judge, judge_detection

REFERENCE = np.kron(textured(3), np.ones((2, 2, 1), np.uint8))
ALL = np.ones(REFERENCE.shape[:2], bool)


def constant(dx, dy):
    return np.broadcast_to(np.float32((dx, dy)), (*ALL.shape, 2)).copy()


def judged(alignment, live):
    return judge(alignment, REFERENCE, warp_image(REFERENCE, alignment.flow), live)


@pytest.mark.parametrize("name", ["dis", "ecc", "homography"])
def test_a_good_alignment_raises_no_doubt(name):
    live = np.roll(REFERENCE, (4, -6), axis=(0, 1))
    found = judged(build_aligner(name).align(REFERENCE, live), live)
    assert found.doubt == "" and found.backward_px < 0.5
    assert found.residual_after < 0.35 * found.residual_before


def test_the_forward_backward_error_is_what_two_constant_flows_say():
    found = judged(Alignment(constant(3, 0), ALL, constant(0, 4)), REFERENCE)
    assert found.backward_px == pytest.approx(5.0)
    assert "forward-backward error 5.0 px" in found.doubt
    assert judged(Alignment(constant(3, 0), ALL, constant(-3, 0)), REFERENCE).backward_px == 0


def test_without_a_way_back_there_is_no_error_to_tell():
    assert judged(Alignment(constant(0, 0), ALL), REFERENCE).backward_px is None


def test_little_reach_and_a_worse_picture_are_doubts():
    narrow = ALL.copy()
    narrow[:, 100:] = False
    assert "reaches 31% of the view" in judged(Alignment(constant(0, 0), narrow), REFERENCE).doubt
    found = judged(Alignment(constant(9, 9), ALL), REFERENCE)
    assert "leaves a larger difference" in found.doubt


def test_nothing_valid_is_the_worst_of_all():
    found = judged(Alignment(constant(0, 0), ~ALL, constant(0, 0)), REFERENCE)
    assert (found.residual_after, found.backward_px) == (255.0, None)
    assert "reaches 0% of the view" in found.doubt


def wavy(reference, flow_px, seed=0):
    """A live image whose pixels moved by smooth waves, as no plane and no room does it."""
    rng = np.random.default_rng(seed)
    waves = cv2.GaussianBlur(rng.standard_normal((*reference.shape[:2], 2)), (0, 0), 12)
    waves *= flow_px / waves.std()
    rows, columns = np.mgrid[: reference.shape[0], : reference.shape[1]]
    x, y = np.float32(columns + waves[..., 0]), np.float32(rows + waves[..., 1])
    return cv2.remap(reference, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)


def test_a_wavy_warp_that_does_not_find_back_within_a_pixel_is_doubted():
    live = wavy(REFERENCE, 10)
    found = judged(build_aligner("dis").align(REFERENCE, live), live)
    assert 1 < found.backward_px < 3 and "forward-backward error" in found.doubt


def test_a_there_and_back_of_just_over_a_pixel_is_a_doubt_and_of_half_a_pixel_none():
    for there, doubted in ((1.1, True), (0.5, False)):
        found = judged(Alignment(constant(there, 0), ALL, constant(0, 0)), REFERENCE)
        assert ("forward-backward error" in found.doubt) is doubted


def test_what_is_left_over_is_measured_by_the_contrast_of_the_picture():
    other = np.kron(textured(4), np.ones((2, 2, 1), np.uint8))
    found = judged(Alignment(constant(0, 0), ALL), other)
    assert "half of the view still differs by" in found.doubt
    # Light that changed, noise, and a large new thing are no misalignment.
    live = np.clip(REFERENCE * 1.2 + np.random.default_rng(0).normal(0, 3, REFERENCE.shape), 0, 255)
    live[:, :120] = 255
    assert judged(Alignment(constant(0, 0), ALL), live.astype(np.uint8)).doubt == ""


def test_a_detection_that_calls_much_of_the_picture_changed_is_doubted():
    probability = np.zeros((100, 100), np.float32)
    probability[:14] = 1
    assert store_detection(probability, 0.5).doubt == ""
    probability[:20] = 1
    found = store_detection(probability, 0.5)
    assert found.doubt == "20% of the picture is called changed"
    assert judge_detection(found.mask) == found.doubt
