"""What is exported is what is stored, byte for byte."""

import hashlib
import json

import numpy as np
import pytest
from people import draw
from pycocotools.coco import COCO

from reviewer.atomic import whole_folder
from reviewer.editing.commit import MaskEdit
from reviewer.errors import Conflict, NotFound
from reviewer.export.coco import export_coco
from reviewer.export.formats import Options, export_as
from reviewer.export.png import export_png
from reviewer.export.selection import Selection, select_labelled
from reviewer.masks import decode_png, decode_rle, encode_rle
from reviewer.store.revisions import NewRevision, add_revision, newest_revision

ALL = Selection()


def test_png_masks_are_the_stored_masks(db, tiny_split, tmp_path):
    labelled, without = select_labelled(db, ALL)
    assert (export_png(labelled, tmp_path / "out", ALL), without) == (3, [])
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    for pair, entry in zip(tiny_split, manifest["pairs"], strict=True):
        ((path, digest),) = entry["files"].items()
        data = (tmp_path / "out" / path).read_bytes()
        assert hashlib.sha256(data).hexdigest() == digest
        assert encode_rle(decode_png(data)) == newest_revision(db, pair.id).mask
        assert entry["live_sha256"] == pair.live.sha256
    assert manifest["pairs"][2]["area"] == 0


def test_exports_are_deterministic(db, tiny_split, tmp_path):
    labelled, _ = select_labelled(db, ALL)
    for name in ("a", "b"):
        export_png(labelled, tmp_path / name, ALL)
        export_coco(labelled, tmp_path / f"{name}.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    assert len(files) == 4
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_an_ignore_mask_lies_beside_its_mask(db, tiny_split, tmp_path):
    pair = tiny_split[0]
    newest = newest_revision(db, pair.id)
    edit = MaskEdit(newest.mask, 1, ignore=newest.mask)
    draw(db, pair.id, "Ada", edit)
    export_png(select_labelled(db, ALL)[0], tmp_path / "out", ALL)
    ignore = decode_png((tmp_path / "out" / "cs1" / "0000.ignore.png").read_bytes())
    assert (ignore == decode_rle(newest.mask)).all()


def test_coco_reads_back_with_pycocotools(db, tiny_split, tmp_path, capsys):
    export_coco(select_labelled(db, ALL)[0], tmp_path / "coco.json")
    coco = COCO(tmp_path / "coco.json")
    assert len(coco.imgs) == 3 and len(coco.anns) == 2
    for pair in tiny_split:
        truth = newest_revision(db, pair.id).mask
        annotations = coco.loadAnns(coco.getAnnIds(imgIds=[pair.id]))
        if not annotations:
            assert truth.area == 0
            continue
        (annotation,) = annotations
        assert (coco.annToMask(annotation).astype(bool) == decode_rle(truth)).all()
        assert (annotation["area"], annotation["iscrowd"]) == (truth.area, 0)
        assert tuple(annotation["bbox"]) == truth.box_xywh


def test_coco_can_have_an_annotation_a_component(db, tiny_split, tmp_path, capsys):
    pair = tiny_split[0]
    mask = np.zeros((120, 160), bool)
    mask[10:20, 10:20] = mask[20:25, 20:25] = mask[60:70, 90:95] = True
    add_revision(
        db, NewRevision(pair.id, encode_rle(mask), parent=1, annotator_id=None, source="import")
    )
    labelled, _ = select_labelled(db, ALL)
    options = Options(per_component=True)
    assert export_as(db, "coco", labelled, tmp_path / "coco.json", ALL, options) == 3
    coco = COCO(tmp_path / "coco.json")
    found = coco.loadAnns(coco.getAnnIds(imgIds=[pair.id]))
    # Corners that touch are one component.
    assert [(each["area"], each["iscrowd"]) for each in found] == [(125, 0), (50, 0)]
    together = np.sum([coco.annToMask(each) for each in found], axis=0)
    assert (together == mask).all()


def test_ill_posed_pixels_are_a_crowd_in_coco(db, tiny_split, tmp_path, capsys):
    pair = tiny_split[0]
    mask = newest_revision(db, pair.id).mask
    draw(db, pair.id, "Ada", MaskEdit(mask, 1, ignore=mask))
    export_coco(select_labelled(db, ALL)[0], tmp_path / "coco.json")
    coco = COCO(tmp_path / "coco.json")
    change, crowd = (coco.loadAnns(coco.getAnnIds(imgIds=[pair.id], iscrowd=k)) for k in (0, 1))
    assert len(change) == len(crowd) == 1 and crowd[0]["id"] != change[0]["id"]
    assert (coco.annToMask(crowd[0]).astype(bool) == decode_rle(mask)).all()


def test_nothing_is_overwritten(db, tiny_split, tmp_path):
    labelled, _ = select_labelled(db, ALL)
    export_png(labelled, tmp_path / "out", ALL)
    export_coco(labelled, tmp_path / "coco.json")
    with pytest.raises(Conflict, match="exists already"):
        export_png(labelled, tmp_path / "out", ALL)
    with pytest.raises(Conflict, match="exists already"):
        export_coco(labelled, tmp_path / "coco.json")


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    with pytest.raises(RuntimeError), whole_folder(tmp_path / "out") as folder:
        (folder / "half.png").write_text("x")
        raise RuntimeError("disk full")
    assert list(tmp_path.iterdir()) == []


def test_without_ground_truth_there_is_nothing_to_export(db):
    with pytest.raises(NotFound, match="none of 0 pairs has ground truth"):
        select_labelled(db, ALL)


def test_an_unknown_split_is_named(db, tiny_split):
    with pytest.raises(NotFound, match="split zz9: does not exist; there are cs1"):
        select_labelled(db, Selection(("zz9",)))
