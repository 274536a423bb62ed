"""Masks survive every round trip; damaged ones are refused."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from pycocotools import mask as coco
from scipy import ndimage

from reviewer.errors import InvalidInput
from reviewer.masks import (
    as_mask,
    boundary,
    components,
    crop_of_rle,
    crop_to_box,
    decode_png,
    decode_rle,
    depth,
    dilate,
    encode_crops,
    encode_png,
    encode_rle,
    fill_holes,
    intersection_over_union,
    keep_touched,
    merge_rles,
    read_rle,
    shrunk,
    union,
)

VECTORS = json.loads((Path(__file__).parent / "static" / "rle_vectors.json").read_text())
any_mask = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=40))


@given(any_mask)
def test_run_lengths_round_trip(mask):
    rle = encode_rle(mask)
    assert (decode_rle(rle) == mask).all()
    assert rle.area == mask.sum()
    assert read_rle(rle.height, rle.width, rle.counts) == rle


@given(any_mask)
def test_run_lengths_decoded_in_their_box_are_the_cut_out_mask(mask):
    found, wanted = crop_of_rle(encode_rle(mask)), crop_to_box(mask)
    if wanted is None:
        assert found is None
        return
    assert (found.x, found.y, found.area) == (wanted.x, wanted.y, wanted.area)
    np.testing.assert_array_equal(found.pixels, wanted.pixels)


@given(any_mask)
def test_components_have_the_boxes_and_areas_that_opencv_tells(mask):
    labels, crops = components(mask)
    count, wanted, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    assert len(crops) == count - 1
    found = {(c.x, c.y, c.pixels.shape[1], c.pixels.shape[0], c.area) for c in crops}
    assert found == {tuple(int(v) for v in row) for row in stats[1:]}
    for number, crop in enumerate(crops, start=1):
        np.testing.assert_array_equal(crop.pixels, crop.window(labels) == number)
    assert ((labels > 0) == (wanted > 0)).all()


@given(arrays(np.bool_, (3, 9, 13)))
def test_merged_run_lengths_are_the_union(masks):
    merged = merge_rles([encode_rle(mask) for mask in masks], 9, 13)
    np.testing.assert_array_equal(merged, masks.any(axis=0))
    assert not merge_rles([], 9, 13).any()


@given(any_mask)
def test_png_round_trips(mask):
    assert (decode_png(encode_png(mask)) == mask).all()


@pytest.mark.parametrize("vector", VECTORS, ids=lambda v: v["name"])
def test_golden_vectors_agree_with_pycocotools(vector):
    mask = np.array(vector["rows"], bool)
    assert encode_rle(mask).counts == vector["counts"]
    encoded = {"size": list(mask.shape), "counts": vector["counts"].encode()}
    assert (coco.decode(encoded).astype(bool) == mask).all()


def test_the_box_and_area_are_measured():
    mask = np.zeros((10, 20), bool)
    mask[2:5, 7:11] = True
    rle = encode_rle(mask)
    assert (rle.area, rle.box_xywh) == (12, (7, 2, 4, 3))


def test_an_empty_mask_has_an_empty_box():
    assert encode_rle(np.zeros((4, 5), bool)).box_xywh == (0, 0, 0, 0)


def test_a_mask_without_pixels_is_refused():
    with pytest.raises(InvalidInput, match="at least one pixel"):
        encode_rle(np.zeros((0, 5), bool))


@pytest.mark.parametrize(
    ("counts", "message"),
    [("d0", "cover 20 pixels"), ("~~~", "not a run-length character"), ("oo", "ends inside a run"),
     ("ooooooooo0", "longer than any image"), ("O5", "negative")],
)  # fmt: skip
def test_malformed_run_lengths_are_refused(counts, message):
    with pytest.raises(InvalidInput, match=message):
        read_rle(4, 4, counts)


@given(st.text(alphabet=st.characters(min_codepoint=33, max_codepoint=126), max_size=12))
def test_any_text_is_a_mask_or_refused(text):
    try:
        rle = read_rle(6, 7, text)
    except InvalidInput:
        return
    assert decode_rle(rle).sum() == rle.area


def test_a_size_of_zero_is_refused():
    with pytest.raises(InvalidInput, match="size must be positive"):
        read_rle(0, 4, "")


def test_a_grey_picture_is_no_mask():
    data = cv2.imencode(".png", np.arange(16, dtype=np.uint8).reshape(4, 4))[1].tobytes()
    with pytest.raises(InvalidInput, match="16 values"):
        decode_png(data)


def test_a_coloured_picture_is_no_mask():
    data = cv2.imencode(".png", np.full((4, 4, 3), (0, 0, 255), np.uint8))[1].tobytes()
    with pytest.raises(InvalidInput, match="has colours"):
        decode_png(data)


@pytest.mark.parametrize("data", [b"", b"not a png"])
def test_bytes_that_are_no_picture_are_refused(data):
    with pytest.raises(InvalidInput, match="not a readable image"):
        decode_png(data)


def test_a_mask_must_be_two_dimensional():
    with pytest.raises(InvalidInput, match=r"\(height, width\)"):
        as_mask(np.zeros((2, 2, 1), bool))


def test_components_are_8_connected_and_cropped():
    mask = np.zeros((6, 6), bool)
    mask[0, 0] = mask[1, 1] = mask[4, 4:6] = True
    labels, parts = components(mask)
    assert [part.area for part in parts] == [2, 2]
    assert parts[1].box_xyxy == (4, 4, 6, 5)
    assert labels[1, 1] == 1
    assert parts[0].window(mask).sum() == 2


def test_cropping_an_empty_mask_gives_nothing():
    assert crop_to_box(np.zeros((3, 3), bool)) is None


def test_union_of_no_masks_is_empty():
    assert not union([], 3, 4).any()


def test_iou_counts_pixels():
    a, b = np.zeros((2, 4), bool), np.zeros((2, 4), bool)
    a[:, :2], b[:, 1:3] = True, True
    assert intersection_over_union(a, b) == pytest.approx(2 / 6)


def test_dilation_grows_by_half_the_kernel_each_time():
    mask = np.zeros((21, 21), bool)
    mask[10, 10] = True
    assert dilate(mask, size_px=5, times=2).sum() == 81


@pytest.mark.parametrize("seed", range(3))
def test_holes_parts_and_boundaries_agree_with_scipy(seed):
    mask = np.random.default_rng(seed).random((37, 53)) < 0.55
    assert (fill_holes(mask) == ndimage.binary_fill_holes(mask)).all()
    labels, _ = ndimage.label(mask, np.ones((3, 3)))
    row, column = np.argwhere(mask)[40]
    kept = keep_touched(mask, [(int(column), int(row))])
    assert (kept == (labels == labels[row, column])).all()
    assert not keep_touched(mask, [tuple(int(v) for v in np.argwhere(~mask)[3][::-1])]).any()
    inner = ndimage.binary_erosion(mask)
    assert (boundary(mask) == (mask & ~inner)).all()


def test_depth_is_the_distance_to_what_is_not_of_the_mask_or_beyond_the_picture():
    mask = np.zeros((9, 13), np.bool_)
    mask[2:7, 0:8] = True
    deep = depth(mask)
    assert deep.shape == mask.shape and deep.dtype == np.float32
    assert not deep[~mask].any()
    # The middle row is three rows from the outside; the left column touches the rim.
    np.testing.assert_allclose(deep[4, [0, 1, 2, 7]], [1, 2, 3, 1], atol=0.01)


def test_crops_are_encoded_as_their_union_is():
    rng = np.random.default_rng(5)
    for _ in range(40):
        mask = rng.random((14, 17)) < rng.choice([0.05, 0.3, 0.9])
        mask[:, : rng.integers(0, 5)] = mask[:, 17 - rng.integers(0, 5) :] = False
        crops = components(mask)[1]
        assert encode_crops(crops, 14, 17) == encode_rle(mask)
    corner = np.ones((14, 17), bool)
    assert encode_crops(components(corner)[1], 14, 17) == encode_rle(corner)


def test_a_shrunk_mask_keeps_what_fills_a_quarter_of_a_square():
    mask = np.zeros((9, 10), bool)
    mask[0:2, 0:2] = True  # a quarter of the first square of four
    mask[4, 4] = True  # a sixteenth
    assert np.argwhere(shrunk(mask, 4)).tolist() == [[0, 0]]
    assert shrunk(mask, 4).shape == (2, 2) and shrunk(mask, 1) is mask
