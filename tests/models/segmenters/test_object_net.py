"""`object-net`: what changed becomes objects of the picture that has them."""

import numpy as np
import pytest
import torch
from scenes import HEIGHT, WIDTH, textured

from reviewer.masks import intersection_over_union
from reviewer.models.interfaces import PairView
from reviewer.models.nets.click_net import ClickNet
from reviewer.models.nets.small import save_small
from reviewer.models.registry import SEGMENTERS
from reviewer.models.segmenters.object_net import ObjectNetSegmenter


@pytest.fixture(scope="module")
def segmenter(tmp_path_factory):
    """Tiny random weights: their masks are of no use, so the detector's components stay."""
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "click-net.safetensors"
    net = ClickNet()
    # Whatever the window shows, nothing is found in it.
    torch.nn.init.constant_(net.mask.bias, -50.0)
    save_small(path, net, "click-net", {})
    return ObjectNetSegmenter(str(path))


def block(y, x, height=20, width=24):
    mask = np.zeros((HEIGHT, WIDTH), bool)
    mask[y : y + height, x : x + width] = True
    return mask


def view(live, warped, change, valid=None):
    valid = np.ones((HEIGHT, WIDTH), bool) if valid is None else valid
    still = np.zeros((HEIGHT, WIDTH, 2), np.float32)
    return PairView(live, warped, valid, change, (), warped, still)


def shown(picture, mask, colour=(250, 20, 20)):
    picture = picture.copy()
    picture[mask] = colour
    return picture


ROOM, CUP, BOX = textured(3), block(20, 30), block(70, 100)


def test_what_came_is_an_object_of_the_live_picture_and_what_went_of_the_reference(segmenter):
    found = segmenter.segment(view(shown(ROOM, CUP), shown(ROOM, BOX), CUP | BOX))
    (came,), (went,) = found.live, found.reference
    assert intersection_over_union(came.mask, CUP) > 0.9
    assert intersection_over_union(went.mask, BOX) > 0.9


def test_what_stands_some_pixels_aside_in_the_reference_is_an_object_of_both(segmenter):
    aside = np.roll(CUP, 6, axis=1)
    patterned = np.random.default_rng(0).integers(0, 255, (20, 24, 3), np.uint8)
    live, past = ROOM.copy(), ROOM.copy()
    live[CUP], past[aside] = patterned.reshape(-1, 3), patterned.reshape(-1, 3)
    found = segmenter.segment(view(live, past, CUP))
    assert len(found.live) == 1 and len(found.reference) == 1


def test_a_component_that_is_too_small_is_left_alone(segmenter):
    speck = block(50, 50, 3, 3)
    found = segmenter.segment(view(shown(ROOM, speck), ROOM, speck))
    assert not found.live and not found.reference


def test_components_that_nearly_touch_are_one_object(segmenter):
    halves = CUP.copy()
    halves[:, 41:43] = False
    found = segmenter.segment(view(shown(ROOM, CUP), ROOM, halves))
    assert len(found.live) == 1
    apart = CUP | BOX
    assert len(segmenter.segment(view(shown(ROOM, apart), ROOM, apart)).live) == 2


def test_no_change_gives_no_object(segmenter):
    found = segmenter.segment(view(ROOM, ROOM, np.zeros((HEIGHT, WIDTH), bool)))
    assert not found.live and not found.reference


def test_objects_of_the_reference_keep_to_what_can_be_compared(segmenter):
    valid = np.ones((HEIGHT, WIDTH), bool)
    valid[:, 110:] = False
    found = segmenter.segment(view(ROOM, shown(ROOM, BOX), BOX, valid))
    assert all(not (each.mask & ~valid).any() for each in found.reference)


def test_it_is_built_by_name_with_the_weights_of_the_package_or_a_file(segmenter):
    build = SEGMENTERS["object-net"]
    assert build().weights == ObjectNetSegmenter().weights
    assert build(checkpoint=segmenter.checkpoint).weights == segmenter.weights
    assert segmenter.weights != ObjectNetSegmenter().weights
