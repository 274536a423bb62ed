"""Masks of other tools: what those tools write is read pixel by pixel, and bad files are named."""

import json

import numpy as np
import pytest
from label_studio_converter.brush import encode_rle as encode_brush
from people import draw
from pycocotools import mask as coco
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.dataset.annotations.coco import read_coco
from reviewer.dataset.annotations.cvat import read_cvat
from reviewer.dataset.annotations.label_studio import read_label_studio, unpack_brush
from reviewer.dataset.annotations.labelme import read_labelme
from reviewer.dataset.mask_importer import import_masks
from reviewer.editing.commit import MaskEdit
from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.export.formats import Options, export_as
from reviewer.export.selection import Selection, select_labelled
from reviewer.masks import decode_rle, encode_rle
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import list_revisions, newest_revision

ALL = Selection()
SIZE = {"imageHeight": 120, "imageWidth": 160}


@pytest.fixture
def bare(db, split_folder, tmp_path):
    """The same images in another database, without masks."""
    from reviewer.dataset.importer import ImportSettings, import_split

    for path in (split_folder / "mask").iterdir():
        path.unlink()
    with Store(tmp_path / "bare.db", create=True) as store:
        import_split(store, "cs1", split_folder, ImportSettings(), lambda *_: None)
        yield store


@pytest.mark.parametrize(
    ("form", "tool", "inside"),
    [("labelme", "labelme", ""), ("cvat", "cvat", "annotations.xml"), ("coco", "coco", "")],
)
def test_what_is_exported_comes_back_the_same(db, tiny_split, bare, tmp_path, form, tool, inside):
    pair = tiny_split[0]
    ignored = np.zeros((120, 160), bool)
    ignored[3:9, 100:130] = True
    mask = newest_revision(db, pair.id).mask
    edit = MaskEdit(mask, 1, ignore=encode_rle(ignored))
    draw(db, pair.id, "Ada", edit)
    labelled, _ = select_labelled(db, ALL)
    export_as(db, form, labelled, tmp_path / "out", ALL, Options())
    report = import_masks(bare, tool, tmp_path / "out" / inside, empty=True)
    assert len(report.written) == 3 and not report.strangers
    for old, new in zip(tiny_split, list_pairs(bare), strict=True):
        assert newest_revision(db, old.id).mask == newest_revision(bare, new.id).mask
    kept = newest_revision(bare, list_pairs(bare)[0].id).ignore()
    assert (kept == ignored).all()


def test_a_brush_of_label_studio_is_unpacked(tmp_path):
    rng = np.random.default_rng(3)
    for mask in (rng.random((37, 53)) > 0.5, np.zeros((20, 30), bool), np.ones((64, 64), bool)):
        rgba = np.repeat(mask.astype(np.uint8)[..., None] * 255, 4, axis=2)
        packed = [int(v) for v in encode_brush(rgba.flatten())]
        assert (unpack_brush(packed, *mask.shape) == mask).all()
    with pytest.raises(InvalidInput, match="cut off"):
        unpack_brush(packed[:-3], 64, 64)
    with pytest.raises(InvalidInput, match=r"has 16384 values, but 65x64 has 16640"):
        unpack_brush(packed, 64, 65)


def write_tasks(path, mask, image="/data/local-files/?d=sets/cs1/0001.png"):
    rgba = np.repeat(mask.astype(np.uint8)[..., None] * 255, 4, axis=2)
    size = {"original_height": 120, "original_width": 160}
    brush = {"format": "rle", "rle": [int(v) for v in encode_brush(rgba.flatten())],
             "brushlabels": ["change"]}  # fmt: skip
    box = {
        "x": 50,
        "y": 50,
        "width": 25,
        "height": 10,
        "rotation": 0,
        "rectanglelabels": ["ill-posed"],
    }
    results = [
        {"type": "brushlabels", "value": brush, **size},
        {"type": "rectanglelabels", "value": box, **size},
    ]
    old = {"updated_at": "2026-01-01", "result": []}
    new = {"updated_at": "2026-02-01", "result": results}
    tasks = [{"id": 5, "data": {"image": image}, "annotations": [new, old]},
             {"id": 6, "data": {"image": "x.png"}, "annotations": []}]  # fmt: skip
    path.write_text(json.dumps(tasks))
    return path


def test_the_newest_annotation_of_a_task_is_read(tmp_path):
    mask = np.zeros((120, 160), bool)
    mask[5:9, 7:70] = True
    (image,) = read_label_studio(write_tasks(tmp_path / "ls.json", mask))
    assert image.name == "sets/cs1/0001.png" and (image.layers["change"] == mask).all()
    ignored = image.layers["ill-posed"]
    assert ignored.sum() == 40 * 12 and ignored[60:72, 80:120].all()


def test_polygons_of_coco_are_filled_as_pycocotools_does(tmp_path):
    corners = [10.5, 10.0, 60.0, 12.0, 40.0, 80.5]
    runs = coco.frPyObjects([corners], 120, 160)
    counts = {"size": [120, 160], "counts": [0, 5, 120 * 160 - 5]}
    document = {
        "images": [{"id": 1, "file_name": "0000.png", "height": 120, "width": 160}],
        "categories": [{"id": 1, "name": "pen"}, {"id": 2, "name": "cup"}],
        "annotations": [
            {"id": 1, "image_id": 1, "category_id": 1, "segmentation": [corners]},
            {"id": 2, "image_id": 1, "category_id": 2, "segmentation": counts},
            {"id": 3, "image_id": 1, "category_id": 2, "segmentation": []},
        ],
    }
    (tmp_path / "a.json").write_text(json.dumps(document))
    (image,) = read_coco(tmp_path / "a.json")
    assert (image.layers["pen"] == coco.decode(runs)[..., 0].astype(bool)).all()
    assert image.layers["cup"].sum() == 5 and image.left_out == {"box without a mask": 1}


def test_shapes_of_labelme_are_filled_as_labelme_does(tmp_path, monkeypatch):
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    from labelme.utils import shape_to_mask

    shapes = {
        "polygon": [[10.2, 10.0], [60.7, 12.0], [40.0, 80.0]],
        "rectangle": [[90.0, 20.0], [70.0, 40.0]],
        "circle": [[120.0, 60.0], [120.0, 72.5]],
    }
    document = {
        "imagePath": "..\\cs1\\0000.png",
        **SIZE,
        "shapes": [
            {"label": kind, "shape_type": kind, "points": points} for kind, points in shapes.items()
        ]
        + [{"label": "x", "shape_type": "linestrip", "points": [[0, 0], [9, 9]]}],
    }
    (tmp_path / "0000.json").write_text(json.dumps(document))
    (image,) = read_labelme(tmp_path)
    assert image.name == "../cs1/0000.png" and image.left_out == {"linestrip": 1}
    for kind, points in shapes.items():
        assert (image.layers[kind] == shape_to_mask((120, 160), points, kind)).all(), kind


def test_other_shapes_of_cvat_are_areas_too(tmp_path):
    (tmp_path / "a.xml").write_text(
        """<annotations><image id="0" name="cs1/0000.png" width="160" height="120">
        <polygon label="p" points="10,10;50,10;50,30;10,30"/>
        <box label="b" xtl="60" ytl="20" xbr="80" ybr="40"/>
        <box label="t" xtl="100" ytl="50" xbr="120" ybr="60" rotation="90"/>
        <ellipse label="e" cx="40" cy="80" rx="10" ry="5"/>
        <polyline label="l" points="0,0;5,5"/><tag label="day"/></image></annotations>"""
    )
    (image,) = read_cvat(tmp_path / "a.xml")
    assert image.layers["p"].sum() == 800 and image.layers["b"].sum() == 400
    turned = image.layers["t"]
    assert turned[46:64, 106:114].all() and abs(int(turned.sum()) - 200) <= 22
    assert abs(int(image.layers["e"].sum()) - np.pi * 50) < 8
    assert image.left_out == {"polyline": 1}


@pytest.mark.parametrize(
    ("tool", "name", "text", "message"),
    [
        ("coco", "a.json", "{}", "not a COCO instances file"),
        ("coco", "a.json", "[", "not a COCO instances file"),
        ("labelme", "a.json", '{"imagePath": "0000.png"}', "not a labelme file, KeyError"),
        ("cvat", "a.xml", "<annotations", "not readable XML"),
        ("cvat", "a.xml", "<annotations/>", "holds no <image>"),
        ("cvat", "a.xml", '<annotations><image name="0000.png" width="160" height="120"><mask'
         ' label="c" rle="1, 2" left="0" top="0" width="2" height="2"/></image></annotations>',
         "run-lengths cover 3 pixels, but the box 2x2 has 4"),
        ("label-studio", "a.json", '{"x": 1}', "a list of tasks is expected"),
        ("labelme", "a.json", '{"imagePath": "0000.png", "imageHeight": 12, "imageWidth": 16,'
         ' "shapes": []}', "is 16x12, but the live image of pair cs1/0000 is 160x120"),
    ],
)  # fmt: skip
def test_a_bad_file_is_named_and_changes_nothing(bare, tmp_path, tool, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(InvalidInput, match=message):
        import_masks(bare, tool, tmp_path / name)
    assert newest_revision(bare, 1) is None


def test_ground_truth_that_is_there_is_replaced_only_when_that_is_said(db, tiny_split, tmp_path):
    mask = np.zeros((120, 160), bool)
    mask[5:9, 7:70] = True
    path = write_tasks(tmp_path / "ls.json", mask)
    with pytest.raises(Conflict, match=r"pair cs1/0001: has ground truth already \(revision 1\)"):
        import_masks(db, "label-studio", path)
    would = import_masks(db, "label-studio", path, replace=True, dry_run=True)
    assert would.written == (("cs1/0001", 252),)
    assert len(list_revisions(db, tiny_split[1].id)) == 1
    import_masks(db, "label-studio", path, replace=True)
    kept = list_revisions(db, tiny_split[1].id)
    assert [r.source for r in kept] == ["import"] * 2 and kept[1].mask.area == 252
    assert kept[1].ignore().sum() == 480
    assert import_masks(db, "label-studio", path).unchanged == 1
    with pytest.raises(InvalidInput, match="has no label 'chnage'; there are 'change', 'ill-"):
        import_masks(db, "label-studio", path, change=["chnage"], replace=True)
    other = import_masks(
        db, "label-studio", path, change=["ill-posed"], ill_posed="x", replace=True, dry_run=True
    )
    assert other.labels == {"change": "left out", "ill-posed": "change"}
    assert other.written == (("cs1/0001", 480),)


def test_what_says_nothing_is_not_taken_for_no_change(bare, tmp_path):
    images = [{"id": k, "file_name": f"000{k}.png", "height": 120, "width": 160} for k in range(3)]
    boxes = [{"id": 1, "image_id": 1, "category_id": 1, "segmentation": []}]
    counts = {"size": [120, 160], "counts": [0, 5, 120 * 160 - 5]}
    masks = [{"id": 2, "image_id": 0, "category_id": 1, "segmentation": counts}]
    document = {"images": images, "categories": [{"id": 1, "name": "pen"}]}
    path = tmp_path / "a.json"
    path.write_text(json.dumps({**document, "annotations": boxes + masks}))
    report = import_masks(bare, "coco", path, dry_run=True)
    assert report.written == (("cs1/0000", 5),) and report.empty == ("0001.png", "0002.png")
    # An image without any shape may mean "nothing changed"; one with only boxes never does.
    report = import_masks(bare, "coco", path, empty=True)
    assert [title for title, _ in report.written] == ["cs1/0000", "cs1/0002"]
    assert report.empty == ("0001.png",)
    counts["size"] = [60, 80]
    counts["counts"] = [0, 4800]
    path.write_text(json.dumps({**document, "annotations": masks}))
    with pytest.raises(InvalidInput, match="annotation 2: its run-lengths are of 80x60"):
        import_masks(bare, "coco", path, replace=True)


def test_a_path_from_elsewhere_is_believed_only_in_a_named_split(bare, tmp_path):
    mask = np.ones((120, 160), bool)
    path = write_tasks(tmp_path / "a.json", mask, "cs2/0001.png")
    with pytest.raises(NotFound, match=r"none of its 1 images, such as cs2/0001\.png"):
        import_masks(bare, "label-studio", path)
    assert import_masks(bare, "label-studio", path, splits=["cs1"], dry_run=True).written
    live = write_tasks(tmp_path / "b.json", mask, "live/0001.png")
    assert import_masks(bare, "label-studio", live, dry_run=True).written
    sent = write_tasks(tmp_path / "c.json", mask, "/data/upload/1/1a2b3c4d-0001.png")
    assert import_masks(bare, "label-studio", sent, dry_run=True).written


@pytest.mark.parametrize("corner", [float("nan"), float("inf"), 1e9])
def test_a_polygon_that_lies_nowhere_is_refused(bare, tmp_path, corner):
    document = {
        "images": [{"id": 1, "file_name": "0000.png", "height": 120, "width": 160}],
        "categories": [{"id": 1, "name": "pen"}],
        "annotations": [
            {"id": 1, "image_id": 1, "category_id": 1, "segmentation": [[1, 1, 9, corner, 5, 5]]}
        ],
    }
    (tmp_path / "a.json").write_text(json.dumps(document))
    with pytest.raises(InvalidInput, match="a polygon's corner lies nowhere near the image"):
        import_masks(bare, "coco", tmp_path / "a.json")


def test_images_that_fit_no_pair_or_several_are_told(db, tiny_split, tmp_path):
    from scenes import write_split

    from reviewer.dataset.importer import ImportSettings, import_split

    empty = np.zeros((120, 160), bool)
    with pytest.raises(NotFound, match=r"none of its 1 images, such as x/9\.png, is a live image"):
        import_masks(db, "label-studio", write_tasks(tmp_path / "a.json", empty, "x/9.png"))
    import_split(db, "hw1", write_split(tmp_path / "hw1"), ImportSettings(), lambda *_: None)
    path = write_tasks(tmp_path / "b.json", empty, "0001.png")
    with pytest.raises(InvalidInput, match=r"0001\.png may be cs1/0001, hw1/0001; narrow it"):
        import_masks(db, "label-studio", path, replace=True)
    found = import_masks(db, "label-studio", path, replace=True, splits=["hw1"])
    assert [title for title, _ in found.written] == ["hw1/0001"]


def test_the_command_says_how_labels_are_read(db, tiny_split, tmp_path):
    mask = np.zeros((120, 160), bool)
    mask[5:9, 7:70] = True
    path = write_tasks(tmp_path / "ls.json", mask)
    command = ["import-masks", "label-studio", str(path), "--replace", "--db", str(db.path)]
    done = CliRunner().invoke(app, [*command, "--dry-run"], catch_exceptions=False)
    assert "label 'ill-posed': ill-posed" in done.output
    assert "1 masks would be imported (0 of them empty), 0 are there already" in done.output
    CliRunner().invoke(app, command, catch_exceptions=False)
    assert (decode_rle(newest_revision(db, tiny_split[1].id).mask) == mask).all()
