"""The weight-free segmenter snaps a rough mask to the object, and knows old objects."""

import numpy as np
import pytest
from scenes import textured

from reviewer.masks import intersection_over_union
from reviewer.models.interfaces import PairView
from reviewer.models.registry import build_segmenter


@pytest.fixture
def scene():
    """Background, object mask, and a rough detection that is shifted and too large."""
    image = textured(9) // 3 + 90
    thing = np.zeros(image.shape[:2], bool)
    thing[40:60, 60:90] = True
    rough = np.zeros_like(thing)
    rough[38:61, 63:92] = True
    return image.astype(np.uint8), thing, rough


def segment(warped, live, change, valid):
    flow = np.zeros((*change.shape, 2), np.float32)
    view = PairView(live, warped, valid, change, (), warped, flow)
    return build_segmenter("oversegment").segment(view)


def with_object(image, thing):
    live = image.copy()
    live[thing] = (235, 30, 20)
    return live


def test_the_object_is_found_with_a_better_border_than_the_rough_mask(scene):
    image, thing, rough = scene
    valid = np.ones_like(thing)
    found = segment(image, with_object(image, thing), rough, valid)
    (instance,) = found.live
    assert intersection_over_union(instance.mask, thing) > 0.85
    assert intersection_over_union(instance.mask, thing) > intersection_over_union(rough, thing)
    assert found.reference == () and 0 < instance.score <= 1


def test_an_object_that_was_there_before_is_a_reference_object(scene):
    image, thing, rough = scene
    live = with_object(image, thing)
    found = segment(live, live, rough, np.ones_like(thing))
    assert (found.reference[0].mask & thing).sum() > 0.9 * thing.sum()


def test_nothing_changed_means_nothing_to_search(scene):
    image, thing, _ = scene
    found = segment(image, image, np.zeros_like(thing), ~thing)
    assert found.live == () and found.reference == ()


def test_a_change_at_the_image_border_is_searched_too(scene):
    image, thing, _ = scene
    edge = np.zeros_like(thing)
    edge[:15, :20] = True
    found = segment(image, with_object(image, edge), edge, np.ones_like(edge))
    assert intersection_over_union(found.live[0].mask, edge) > 0.9
