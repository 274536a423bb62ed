"""Turned shapes: as their tools draw them, checked against converters of those tools."""

import json

import cv2
import numpy as np
import pytest
from label_studio_converter.utils import convert_annotation_to_yolo_obb
from pycocotools import mask as coco

from reviewer.dataset.annotations.cvat import read_cvat
from reviewer.dataset.annotations.label_studio import read_label_studio
from reviewer.errors import InvalidInput
from reviewer.masks import intersection_over_union

HEIGHT, WIDTH = 120, 160
ANGLES = [0, 30, 90, 180, 233.5, -45]


def label_studio(path, kind, value, **more):
    result = {"type": kind, "original_height": HEIGHT, "original_width": WIDTH, "value": value}
    task = {"id": 1, "data": {"image": "0000.png"}, "annotations": [{"result": [result | more]}]}
    path.write_text(json.dumps([task]))
    return path


def cvat(path, shape):
    path.write_text(
        f'<annotations><image id="0" name="0000.png" width="{WIDTH}" height="{HEIGHT}">{shape}'
        "</image></annotations>"
    )
    return path


def drawn_ellipse(x, y, rx, ry, angle):
    """OpenCV's, with 8 bits behind the point: the angle goes clockwise, pixel centres are whole."""
    canvas = np.zeros((HEIGHT, WIDTH), np.uint8)
    centre = round((x - 0.5) * 256), round((y - 0.5) * 256)
    axes = round(rx * 256), round(ry * 256)
    return cv2.ellipse(canvas, centre, axes, angle, 0, 360, 1, -1, cv2.LINE_8, 8) > 0


@pytest.mark.parametrize("angle", ANGLES)
def test_an_ellipse_of_label_studio_is_turned_around_its_middle_in_pixels(tmp_path, angle):
    value = {"x": 50, "y": 50, "radiusX": 25, "radiusY": 10, "rotation": angle,
             "ellipselabels": ["change"]}  # fmt: skip
    (image,) = read_label_studio(label_studio(tmp_path / "a.json", "ellipselabels", value))
    expected = drawn_ellipse(80, 60, 40, 12, angle)
    assert intersection_over_union(image.layers["change"], expected) > 0.92


@pytest.mark.parametrize("angle", ANGLES)
def test_a_rectangle_of_label_studio_is_turned_around_its_upper_left_corner(tmp_path, angle):
    value = {"x": 50, "y": 50, "width": 25, "height": 10, "rotation": angle,
             "rectanglelabels": ["change"]}  # fmt: skip
    (image,) = read_label_studio(label_studio(tmp_path / "a.json", "rectanglelabels", value))
    label = {**value, "original_height": HEIGHT, "original_width": WIDTH}
    corners = convert_annotation_to_yolo_obb(label)
    flat = [value for x, y in corners for value in (x * WIDTH, y * HEIGHT)]
    expected = coco.decode(coco.frPyObjects([flat], HEIGHT, WIDTH))[..., 0] > 0
    assert not image.left_out
    assert intersection_over_union(image.layers["change"], expected) > 0.92


def test_a_picture_that_was_turned_in_label_studio_is_refused(tmp_path):
    value = {"x": 5, "y": 5, "width": 25, "height": 10, "rectanglelabels": ["change"]}
    path = label_studio(tmp_path / "a.json", "rectanglelabels", value, image_rotation=90)
    with pytest.raises(InvalidInput, match="the picture is turned by 90 degrees there"):
        read_label_studio(path)


@pytest.mark.parametrize("angle", ANGLES)
def test_an_ellipse_of_cvat_is_turned_clockwise_around_its_middle(tmp_path, angle):
    shape = f'<ellipse label="e" cx="80" cy="60" rx="40" ry="12" rotation="{angle}"/>'
    (image,) = read_cvat(cvat(tmp_path / "a.xml", shape))
    assert not image.left_out
    expected = drawn_ellipse(80, 60, 40, 12, angle)
    assert intersection_over_union(image.layers["e"], expected) > 0.92


@pytest.mark.parametrize("angle", ANGLES)
def test_a_box_of_cvat_is_turned_clockwise_around_its_middle(tmp_path, angle):
    shape = f'<box label="b" xtl="40" ytl="48" xbr="120" ybr="72" rotation="{angle}"/>'
    (image,) = read_cvat(cvat(tmp_path / "a.xml", shape))
    corners = cv2.boxPoints(((80, 60), (80, 24), angle)).ravel().tolist()
    expected = coco.decode(coco.frPyObjects([corners], HEIGHT, WIDTH))[..., 0] > 0
    assert intersection_over_union(image.layers["b"], expected) > 0.92


def test_an_ellipse_that_reaches_beyond_the_image_is_cut(tmp_path):
    shape = '<ellipse label="e" cx="0" cy="0" rx="40" ry="12" rotation="90"/>'
    (image,) = read_cvat(cvat(tmp_path / "a.xml", shape))
    layer = image.layers["e"]
    assert layer[:39, 0].all() and layer[0, :11].all() and not layer[41:].any()
