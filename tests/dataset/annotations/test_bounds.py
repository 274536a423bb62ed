"""Files that claim more than they hold, or hold what breaks readers: one sentence, no memory."""

import json
import os
import tracemalloc
import zlib
from base64 import b64encode
from struct import pack

import pytest

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.dataset.mask_importer import import_masks
from reviewer.errors import InvalidInput, NotFound
from reviewer.store.database import Store
from reviewer.store.revisions import newest_revision

HUGE = 2**40


@pytest.fixture
def bare(split_folder, tmp_path):
    """A database with images of 160x120 and without masks."""
    for path in (split_folder / "mask").iterdir():
        path.unlink()
    with Store(tmp_path / "bare.db", create=True) as store:
        import_split(store, "cs1", split_folder, ImportSettings(), lambda *_: None)
        yield store


def coco(segmentation, **image):
    document = {
        "images": [{"id": 1, "file_name": "0000.png", "height": 120, "width": 160, **image}],
        "categories": [{"id": 1, "name": "pen"}],
        "annotations": [{"id": 7, "image_id": 1, "category_id": 1, "segmentation": segmentation}],
    }
    return json.dumps(document)


def cvat(shape, size='width="160" height="120"'):
    return f'<annotations><image id="0" name="0000.png" {size}>{shape}</image></annotations>'


def label_studio(value, height=120, width=160):
    result = {"type": "labels", "original_height": height, "original_width": width, "value": value}
    task = {"id": 1, "data": {"image": "0000.png"}, "annotations": [{"result": [result]}]}
    return json.dumps([task])


def labelme(shape):
    return json.dumps(
        {"imagePath": "0000.png", "imageHeight": 120, "imageWidth": 160, "shapes": [shape]}
    )


def png_header(side):
    def chunk(kind, data):
        return pack(">I", len(data)) + kind + data + pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0))
    body = chunk(b"IDAT", zlib.compress(bytes(100))) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + header + body


MASK = '<mask label="c" rle="{rle}" left="0" top="0" width="{side}" height="{side}"/>'
PIXELS = label_studio({"rle": [0] * 40}, 20000, 20000)


@pytest.mark.parametrize(
    ("tool", "text", "message"),
    [
        ("cvat", cvat(MASK.format(rle=10**10, side=100000)), "100000x100000 at .* beyond the im"),
        ("cvat", cvat(MASK.format(rle=HUGE, side=9)), "run-lengths cover 1099511627776 pixels"),
        ("cvat", cvat("", 'width="20000" height="20000"'), "is 20000x20000, but the live image"),
        ("coco", coco({"size": [20000, 20000], "counts": [4 * 10**8]}, height=20000, width=20000),
         "is 20000x20000, but the live image"),
        ("coco", coco({"size": [10**6, 10**6], "counts": [10**12]}), "of 1000000x1000000, but the"),
        ("coco", coco({"size": [120, 160], "counts": [HUGE]}), "annotation 7: .* 1099511627776"),
        ("coco", coco({"size": [120, 160], "counts": "oooo7"}), "annotation 7: run-lengths: "),
        ("coco", coco({"size": [120, 160], "counts": [0, -5, 19205]}), "annotation 7: "),
        ("label-studio", PIXELS, "is 20000x20000, but the live image"),
        ("label-studio", label_studio({"rle": [255, 255, 255, 252] + [0] * 9}),
         "the brush has 4294967292 values, but 160x120 has 76800"),
        ("labelme", labelme({"label": "c", "shape_type": "mask", "points": [[0, 0], [9, 9]],
         "mask": b64encode(png_header(30000)).decode()}), "30000x30000 at .* beyond the image"),
        ("labelme", labelme({"label": "c", "shape_type": "circle", "points": [[0, 0], [1e300, 9]]}),
         "a circle lies nowhere near the image"),
    ],
)  # fmt: skip
def test_a_size_is_checked_before_anything_is_unpacked(bare, tmp_path, tool, text, message):
    path = tmp_path / "file"
    path.write_text(text)
    tracemalloc.start()
    with pytest.raises(InvalidInput, match=message):
        import_masks(bare, tool, path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 20_000_000
    assert newest_revision(bare, 1) is None


DEEP = "[" * 200_000 + "]" * 200_000
ENTITIES = (
    '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'
    "<annotations><image name='&b;' width='160' height='120'/></annotations>"
)
NUMBER = '{"images": [{"id": 1, "file_name": "0000.png", "height": 1e999, "width": NaN}]'


@pytest.mark.parametrize(
    ("tool", "content", "message"),
    [
        ("coco", DEEP, "not a COCO instances file, it is nested too deeply"),
        ("label-studio", DEEP, "not a Label Studio export, it is nested too deeply"),
        ("labelme", DEEP, "not a labelme file, it is nested too deeply"),
        ("coco", NUMBER + ', "categories": [], "annotations": []}', "not a COCO .*OverflowError"),
        ("coco", coco([[1, 1, 9, "x", 5, 5]]), "annotation 7: malformed shape"),
        ("coco", "", "it is no JSON"),
        ("coco", b"\xff\xfe\x00", "is no UTF-8 text"),
        ("label-studio", "[1]", "not a Label Studio export, AttributeError"),
        ("label-studio", label_studio({"x": 1e999, "y": 1, "width": 2, "height": 3}),
         "task 1: a box's corner is not a number"),
        ("label-studio", label_studio({"rle": [999, -1]}), "task 1: malformed shape"),
        ("label-studio", label_studio({"x": "a", "y": 1, "radiusX": 2, "radiusY": 3}), "malformed"),
        ("cvat", ENTITIES, "not readable XML, it declares a document type"),
        ("cvat", b"\x89PNG\r\n\x1a\n\x00\x00", "not readable XML"),
        ("cvat", '<?xml version="1.0" encoding="klingon"?><annotations/>', "not readable XML"),
        ("cvat", cvat('<ellipse label="e" cx="1e308" cy="1" rx="1" ry="nan"/>'), "an ellipse lies"),
        ("cvat", cvat('<box label="e" xtl="1"/>'), "malformed shape, KeyError"),
        ("labelme", labelme({"label": "c", "shape_type": "mask", "points": [[0, 0], [9, 9]],
         "mask": "!!"}), "malformed shape"),
        ("labelme", labelme({"label": "c", "shape_type": "mask", "points": [[0, 0], [9, 9]],
         "mask": b64encode(b"junk").decode()}), "a mask is no readable image"),
        ("labelme", labelme(5), "not a labelme file"),
    ],
)  # fmt: skip
def test_a_broken_file_is_one_sentence_with_its_name(bare, tmp_path, tool, content, message):
    path = tmp_path / "broken-file"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InvalidInput, match=message) as caught:
        import_masks(bare, tool, path)
    assert "broken-file" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("tool", ["coco", "cvat", "label-studio", "labelme"])
@pytest.mark.parametrize("kind", ["pipe", "loop", "device"])
def test_what_is_no_regular_file_is_not_read(bare, tmp_path, tool, kind):
    path = tmp_path / "file"
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to(path if kind == "loop" else "/dev/zero")
    with pytest.raises((InvalidInput, NotFound), match="file: "):
        import_masks(bare, tool, path)


def test_folders_of_labelme_may_hold_folders_with_a_file_s_name(bare, tmp_path):
    folder = tmp_path / "drawn"
    (folder / "old.json").mkdir(parents=True)
    square = {"label": "c", "shape_type": "rectangle", "points": [[0, 0], [9, 9]]}
    (folder / "0000.json").write_text(labelme(square))
    assert import_masks(bare, "labelme", folder).written == (("cs1/0000", 100),)
