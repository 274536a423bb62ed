"""Each format is read back by the tool it is for, and the masks are the same."""

import json
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from people import draw

from reviewer.editing.commit import MaskEdit
from reviewer.errors import NotFound
from reviewer.export.formats import Options, export_as
from reviewer.export.selection import Selection, select_labelled
from reviewer.export.yolo import polygon_lines
from reviewer.masks import decode_rle, encode_rle, intersection_over_union
from reviewer.store.revisions import newest_revision

ALL = Selection()


@pytest.fixture
def drawn(db, tiny_split):
    """A mask with a hole, a speck, a line and a part at the rim; ill-posed pixels over some."""
    mask = np.zeros((120, 160), bool)
    mask[20:60, 30:90] = True
    mask[30:45, 40:70] = False
    mask[100, 10] = mask[110, 20:50] = True
    mask[90:, 150:] = True
    ignored = np.zeros((120, 160), bool)
    ignored[15:25, 25:95] = True
    edit = MaskEdit(encode_rle(mask), 1, ignore=encode_rle(ignored))
    draw(db, tiny_split[0].id, "Ada", edit)
    return mask, ignored


def truths(db, pairs):
    return {pair.name: decode_rle(newest_revision(db, pair.id).mask) for pair in pairs}


def export(db, form, target):
    labelled, _ = select_labelled(db, ALL)
    assert export_as(db, form, labelled, target, ALL, Options()) == 3
    again = target.with_name("again")
    export_as(db, form, labelled, again, ALL, Options())
    files = sorted(p.relative_to(target) for p in target.rglob("*") if p.is_file())
    assert files == sorted(p.relative_to(again) for p in again.rglob("*") if p.is_file())
    for path in files:
        assert (target / path).read_bytes() == (again / path).read_bytes(), path
    return target


def test_labelme_reads_the_same_masks(db, tiny_split, drawn, tmp_path, monkeypatch):
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    import labelme

    folder = export(db, "labelme", tmp_path / "set") / "cs1"
    for name, truth in truths(db, tiny_split).items():
        found = labelme.LabelFile(str(folder / f"{name}.json"))
        assert found.image_path == f"{name}.png" and found.image_data
        shapes = [shape for shape in found.shapes if shape["label"] == "change"]
        levels, _ = labelme.utils.shapes_to_label((120, 160), shapes, {"change": 1})
        assert ((levels == 1) == truth).all()
    first = labelme.LabelFile(str(folder / "0000.json"))
    shapes = [shape for shape in first.shapes if shape["label"] == "ill-posed"]
    levels, _ = labelme.utils.shapes_to_label((120, 160), shapes, {"ill-posed": 1})
    assert ((levels == 1) == drawn[1]).all() and len(first.shapes) == 5


def test_cvat_reads_the_same_masks(db, tiny_split, drawn, tmp_path):
    from cvat_sdk.masks import decode_mask

    folder = export(db, "cvat", tmp_path / "set")
    root = ElementTree.parse(folder / "annotations.xml").getroot()
    assert root.findtext("version") == "1.1"
    assert [label.findtext("name") for label in root.iter("label")] == ["change", "ill-posed"]
    images = root.findall("image")
    assert [image.get("name") for image in images] == [f"cs1/000{k}.png" for k in range(3)]
    for image, truth in zip(images, truths(db, tiny_split).values(), strict=True):
        size = int(image.get("width")), int(image.get("height"))
        found = np.zeros_like(truth)
        for mask in image.findall("mask[@label='change']"):
            left, top, width, height = (
                int(mask.get(key)) for key in ("left", "top", "width", "height")
            )
            # CVAT's own points: run-lengths, then the box with both corners inside.
            box = [left, top, left + width - 1, top + height - 1]
            runs = [int(run) for run in mask.get("rle").split(",")]
            found |= decode_mask([*runs, *box], image_width=size[0], image_height=size[1])
        assert (found == truth).all()
        assert (folder / "images" / image.get("name")).exists()


def test_yolo_polygons_come_back_within_a_pixel(db, tiny_split, drawn, tmp_path):
    import supervision

    folder = export(db, "yolo-seg", tmp_path / "set")
    found = {}
    for part in ("train", "val"):
        read = supervision.DetectionDataset.from_yolo(
            str(folder / "images" / part),
            str(folder / "labels" / part),
            str(folder / "data.yaml"),
            force_masks=True,
        )
        assert read.classes == ["change"]
        for path, _, detections in read:
            masks = [] if detections.mask is None else list(np.asarray(detections.mask))
            name = path.rpartition("_")[2].removesuffix(".png")
            found[name] = np.any([np.zeros((120, 160), bool), *masks], axis=0)
    kernel = np.ones((3, 3), np.uint8)
    for name, truth in truths(db, tiny_split).items():
        grown = cv2.dilate(truth.view(np.uint8), kernel).view(bool)
        assert not (found[name] & ~grown).any() and not (truth & ~found[name]).any()
        assert not truth.any() or intersection_over_union(found[name], truth) > 0.95
    assert len(found) == 3 and not found["0002"].any()


def test_a_line_a_component_holds_its_hole():
    mask = np.zeros((50, 50), bool)
    mask[5:40, 5:40] = True
    mask[15:30, 15:30] = False
    (line,) = polygon_lines(mask)
    corners = (np.array(line.split()[1:], float).reshape(-1, 2) * 50).astype(np.int32)
    filled = np.zeros((50, 50), np.uint8)
    cv2.fillPoly(filled, [corners], 1)
    assert not filled[18:28, 18:28].any() and filled[5:14, 5:39].all()


def test_datasets_loads_the_same_pictures_and_masks(db, tiny_split, drawn, tmp_path):
    import datasets

    folder = export(db, "huggingface", tmp_path / "set")
    read = datasets.load_dataset(str(folder), split="train", cache_dir=str(tmp_path / "cache"))
    assert read.num_rows == 3 and read[0]["annotator"] == "Ada" and read[0]["revision"] == 2
    for pair, row in zip(tiny_split, read, strict=True):
        assert row["pair"] == pair.title and row["split"] == "cs1"
        truth = decode_rle(newest_revision(db, pair.id).mask)
        assert (np.asarray(row["mask"]) == 255 * truth).all() and row["area"] == truth.sum()
        live = cv2.imread(str(pair.live.path))[..., ::-1]
        assert (np.asarray(row["live"].convert("RGB")) == live).all()
        assert row["reference"].size == (160, 120)
    assert (np.asarray(read[0]["ignore"]) == 255 * drawn[1]).all() and read[1]["ignore"] is None


def test_without_the_extra_the_way_to_it_is_told(db, tiny_split, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "datasets", None)
    labelled, _ = select_labelled(db, ALL)
    with pytest.raises(NotFound, match=r"install reviewer\[huggingface\]"):
        export_as(db, "huggingface", labelled, tmp_path / "set", ALL, Options())


def test_panoptic_ids_are_components_and_void_is_ill_posed(db, tiny_split, drawn, tmp_path):
    from transformers.image_transforms import rgb_to_id

    folder = export(db, "coco-panoptic", tmp_path / "set")
    document = json.loads((folder / "panoptic.json").read_text())
    assert [image["pair"] for image in document["images"]] == [pair.title for pair in tiny_split]
    masks = truths(db, tiny_split)
    for annotation, truth in zip(document["annotations"], masks.values(), strict=True):
        png = cv2.imread(str(folder / "panoptic" / annotation["file_name"]))[..., ::-1]
        ids = rgb_to_id(png)
        void = drawn[1] if annotation["image_id"] == tiny_split[0].id else np.zeros_like(truth)
        things = {s["id"] for s in annotation["segments_info"] if s["category_id"] == 1}
        assert (np.isin(ids, list(things)) == (truth & ~void)).all()
        assert ((ids == 0) == void).all()
        for segment in annotation["segments_info"]:
            x, y, width, height = segment["bbox"]
            own = ids == segment["id"]
            assert own.sum() == segment["area"] == own[y : y + height, x : x + width].sum()
