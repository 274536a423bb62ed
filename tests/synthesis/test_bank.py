"""Objects come out of COCO files whole, and what does not is told."""

import json

import cv2
import numpy as np
import pytest

from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.masks import encode_rle
from reviewer.synthesis.bank import LARGEST_SIDE_PX, cut_out, load_bank
from reviewer.synthesis.demo_bank import write_demo_bank

SIDE = 80


@pytest.fixture
def coco(tmp_path):
    """Write a COCO file with these annotations on one picture: blue left, green right."""
    picture = np.zeros((SIDE, SIDE, 3), np.uint8)
    picture[:, : SIDE // 2], picture[:, SIDE // 2 :] = (10, 20, 200), (10, 200, 20)
    (tmp_path / "images").mkdir()
    cv2.imwrite(str(tmp_path / "images" / "a.png"), picture[..., ::-1])

    def write(*annotations, **other):
        defaults = {"image_id": 1, "category_id": 7, "iscrowd": 0}
        content = {
            "images": [{"id": 1, "file_name": "a.png"}, {"id": 2, "file_name": "gone.png"}],
            "annotations": [{"id": k, **defaults, **a} for k, a in enumerate(annotations)],
            "categories": [{"id": 7, "name": "pen"}, {"id": 8, "name": "clip"}],
            **other,
        }
        (tmp_path / "instances.json").write_text(json.dumps(content))
        return tmp_path / "instances.json", tmp_path / "images"

    return write


SQUARE = {"segmentation": [[10, 10, 40, 10, 40, 40, 10, 40]], "area": 900}


def rle(compressed=True):
    mask = np.zeros((SIDE, SIDE), bool)
    mask[50:60, 20:60] = True
    encoded = encode_rle(mask)
    if compressed:
        return {"segmentation": {"size": [SIDE, SIDE], "counts": encoded.counts}, "area": 400}
    runs, value = [0], False
    for pixel in mask.T.ravel():
        if pixel == value:
            runs[-1] += 1
        else:
            runs.append(1)
            value = pixel
    return {"segmentation": {"size": [SIDE, SIDE], "counts": runs}, "area": 400}


def test_polygons_and_both_kinds_of_run_lengths_are_cut_out(coco):
    bank = load_bank(*coco(SQUARE, rle(), rle(compressed=False)))
    square, first, second = bank.objects
    assert square.pixels.shape == (30, 30, 3) and (square.alpha == 255).all()
    assert (square.pixels == (10, 20, 200)).all() and square.category == "pen"
    assert first.alpha.shape == (10, 40) and np.array_equal(first.pixels, second.pixels)
    assert bank.left_out == {}


def test_a_polygon_in_two_parts_is_one_object(coco):
    parts = [[4, 4, 20, 4, 20, 20, 4, 20], [40, 40, 60, 40, 60, 60, 40, 60]]
    (thing,) = load_bank(*coco({"segmentation": parts, "area": 656})).objects
    assert thing.alpha.shape == (56, 56) and thing.alpha[0, 0] == thing.alpha[-1, -1] == 255
    assert thing.alpha[0, -1] == 0


def test_what_is_left_out_is_counted_with_its_reason(coco):
    bank = load_bank(
        *coco(
            SQUARE,
            {**SQUARE, "iscrowd": 1},
            {**SQUARE, "area": 12},
            {"area": 900},
            {**SQUARE, "category_id": 8},
            {**SQUARE, "image_id": 2},
        ),
        categories=["pen"],
        least_area_px=100,
    )
    assert len(bank.objects) == 1
    assert bank.left_out == {
        "crowds": 1,
        "smaller than 100 px": 1,
        "without polygon or mask": 1,
        "of other categories": 1,
        "whose image is missing": 1,
    }


def test_a_large_file_gives_as_many_as_the_bank_holds_by_the_seed(coco):
    boxes = [
        {"segmentation": [[x, 4, x + 30, 4, x + 30, 34, x, 34]], "area": 900} for x in range(20)
    ]
    place = coco(*boxes)
    first = load_bank(*place, size=5, seed=1)
    assert len(first.objects) == 5 and first.left_out == {"more than the bank holds": 15}
    assert first.sha256 == load_bank(*place, size=5, seed=1).sha256
    assert first.sha256 != load_bank(*place, size=5, seed=2).sha256


@pytest.mark.parametrize(
    ("content", "error", "message"),
    [
        ({"annotations": []}, InvalidInput, "no object to paste; no annotations"),
        ({"annotations": [{"id": 1, "image_id": 1, "category_id": 7}]}, InvalidInput,
         "no object to paste; 1 without polygon or mask"),
        ({"annotations": [{"id": 9, "image_id": 1, "category_id": 7, "area": 900,
                           "segmentation": {"size": [80, 80], "counts": "zz!"}}]}, InvalidInput,
         "annotation 9: unreadable segmentation"),
        ({"annotations": [{"id": 9, "image_id": 1, "category_id": 7, "area": 900,
                           "segmentation": {"size": [4, 4], "counts": [8, 8]}}]}, InvalidInput,
         "annotation 9: mask is 4x4, but its image is 80x80"),
    ],
)  # fmt: skip
def test_a_file_without_objects_says_why(coco, content, error, message):
    with pytest.raises(error, match=message):
        load_bank(*coco(**content))


def test_a_file_that_is_no_coco_is_named(coco, tmp_path):
    instances, images = coco(SQUARE)
    with pytest.raises(NotFound, match="no category 'pan'; there are clip, pen"):
        load_bank(instances, images, categories=["pan"])
    with pytest.raises(NotFound, match="is not a folder"):
        load_bank(instances, tmp_path / "nowhere")
    instances.write_text('{"images": []}')
    with pytest.raises(InvalidInput, match="has annotations, categories; this has none"):
        load_bank(instances, images)
    instances.write_text("{")
    with pytest.raises(InvalidInput, match="not a readable JSON file"):
        load_bank(instances, images)
    with pytest.raises(NotFound, match="does not exist"):
        load_bank(tmp_path / "x.json", images)


def test_colours_go_on_beyond_the_rim_and_large_objects_are_shrunk():
    picture = np.zeros((600, 600, 3), np.uint8)
    mask = np.zeros((600, 600), bool)
    cv2.circle(mask.view(np.uint8), (300, 300), 280, 1, -1)
    picture[mask] = (200, 30, 30)
    thing = cut_out(picture, mask, "plate")
    assert max(thing.alpha.shape) == LARGEST_SIDE_PX
    assert (
        thing.alpha[0, 0] == 0 and (abs(thing.pixels[0, 0].astype(int) - (200, 30, 30)) < 3).all()
    )
    assert cut_out(picture, np.zeros_like(mask), "") is None


def test_some_objects_are_held_out_for_validation(coco):
    bank = load_bank(*coco(SQUARE, rle(), SQUARE, rle()))
    training, validation = bank.split(0.25)
    assert (len(training.objects), len(validation.objects)) == (3, 1)
    assert not {id(o) for o in training.objects} & {id(o) for o in validation.objects}
    with pytest.raises(InvalidInput, match="1 object is too few"):
        load_bank(*coco(SQUARE)).split(0.25)


def test_the_rendered_bank_is_a_coco_folder_of_the_ten_kinds(tmp_path):
    instances = write_demo_bank(tmp_path / "bank", a_kind=1, seed=3, progress=lambda *_: None)
    bank = load_bank(instances, tmp_path / "bank" / "images")
    kinds = {thing.category for thing in bank.objects}
    assert len(kinds) == len(bank.objects) == 10 and {"pen", "screw", "ic card"} <= kinds
    for thing in bank.objects:
        assert max(thing.alpha.shape) > 100 and 0.02 < (thing.alpha > 127).mean()
    with pytest.raises(Conflict, match="exists already"):
        write_demo_bank(tmp_path / "bank", a_kind=1, seed=3, progress=lambda *_: None)
