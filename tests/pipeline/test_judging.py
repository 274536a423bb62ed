"""How an alignment is judged: reach, way back, what it leaves over."""

import numpy as np
import pytest
from scenes import textured

from reviewer.models.interfaces import Alignment
from reviewer.models.registry import build_aligner
from reviewer.models.warping import warp_image
from reviewer.pipeline.judging import judge

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
