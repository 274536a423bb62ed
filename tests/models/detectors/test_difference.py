"""The weight-free detector forgives light and small misalignment, and sees objects."""

import numpy as np
import pytest
from scenes import textured

from reviewer.models.registry import open_detector

HERE = (slice(40, 60), slice(60, 90))


@pytest.fixture
def scene():
    """A scene with sensor noise, and the same with a red object."""
    image = textured(8)
    live = image.copy()
    live[HERE] = (220, 20, 30)
    return image, live


def everywhere(image):
    return np.ones(image.shape[:2], bool)


def test_a_new_object_is_found_and_little_else(scene):
    image, live = scene
    probability = open_detector("difference").detect(image, live, everywhere(image))
    assert probability.dtype == np.float32 and probability.shape == image.shape[:2]
    found = probability > 0.5
    assert found[HERE].mean() > 0.9
    found[36:64, 56:94] = False
    assert found.mean() < 0.005


def test_another_exposure_is_no_change(scene):
    image, _ = scene
    darker = (image * 0.8).astype(np.uint8)
    assert (open_detector("difference").detect(image, darker, everywhere(image)) < 0.5).all()


def test_a_misalignment_of_one_pixel_is_no_change(scene):
    image, _ = scene
    moved = np.roll(image, 1, axis=1)
    probability = open_detector("difference").detect(image, moved, everywhere(image))
    assert (probability[:, 4:-4] > 0.5).mean() < 0.002


def test_pixels_outside_the_valid_warp_are_never_changed(scene):
    image, live = scene
    valid = everywhere(image)
    valid[HERE] = False
    assert open_detector("difference").detect(image, live, valid)[HERE].max() == 0
    assert open_detector("difference").detect(image, live, ~everywhere(image)).max() == 0
