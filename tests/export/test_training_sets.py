"""What detectors train on: the t0t1 layout, folds without leaks, and what is selected."""

import hashlib
import json
import pickle
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from people import draw
from scenes import write_split
from seeing import hide
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.dataset.layouts import find_splits
from reviewer.editing.commit import MaskEdit, change_state
from reviewer.editing.verdicts import give_verdict
from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.export.folds import export_folds, make_folds
from reviewer.export.png import export_png
from reviewer.export.selection import Selection, select_labelled
from reviewer.export.t0t1 import export_t0t1
from reviewer.export.webdataset import export_webdataset
from reviewer.masks import decode_png, decode_rle, encode_rle
from reviewer.pipeline.stored import warped_reference
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.regions import load_regions
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import newest_revision

ALL = Selection()


def export(db, target, selection=ALL, **options):
    labelled, _ = select_labelled(db, selection)
    return export_t0t1(db, labelled, target, selection, **options)


def grey(path):
    return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)


def test_what_is_exported_can_be_imported_again_and_nothing_has_changed(db, tiny_split, tmp_path):
    assert export(db, tmp_path / "set") == 3
    with Store(tmp_path / "again.db", create=True) as store:
        ((name, place),) = find_splits(tmp_path / "set", "t0t1")
        import_split(store, name, place, ImportSettings(layout="t0t1"), lambda *_: None)
        for old, new in zip(tiny_split, list_pairs(store), strict=True):
            assert (old.title, old.live.sha256) == (new.title, new.live.sha256)
            assert old.reference.sha256 == new.reference.sha256
            assert newest_revision(db, old.id).mask == newest_revision(store, new.id).mask


def test_the_manifest_names_every_file_with_its_hash(db, tiny_split, tmp_path):
    export(db, tmp_path / "set")
    manifest = json.loads((tmp_path / "set" / "manifest.json").read_text())
    found = {
        path.relative_to(tmp_path / "set").as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in (tmp_path / "set").rglob("*.png")
    }
    named = {path: h for entry in manifest["pairs"] for path, h in entry["files"].items()}
    assert named == found and len(named) == 9
    export(db, tmp_path / "again")
    assert (tmp_path / "again" / "manifest.json").read_bytes() == (
        tmp_path / "set" / "manifest.json"
    ).read_bytes()


def test_an_export_is_a_copy(db, tiny_split, tmp_path):
    export(db, tmp_path / "set")
    (tmp_path / "set" / "cs1" / "t1" / "0000.png").write_bytes(b"spoilt")
    assert tiny_split[0].live.path.read_bytes() != b"spoilt"


def test_references_can_be_warped_by_a_run(db, run, tiny_split, tmp_path):
    export(db, tmp_path / "set", warped_by=run)
    pair = tiny_split[0]
    warped, _ = warped_reference(db, run, pair)
    written = cv2.imread(str(tmp_path / "set" / "cs1" / "t0" / "0000.png"))
    np.testing.assert_array_equal(written[..., ::-1], warped)
    assert (
        json.loads((tmp_path / "set" / "manifest.json").read_text())["settings"]["warped_by"]
        == run.name
    )


@pytest.fixture
def ill_posed(db, tiny_split):
    """Ignored pixels that lie over a part of the change."""
    pair = tiny_split[0]
    newest = newest_revision(db, pair.id)
    ignored = np.zeros((120, 160), bool)
    ignored[40:50, 50:60] = ignored[:5, :5] = True
    edit = MaskEdit(newest.mask, 1, ignore=encode_rle(ignored))
    draw(db, pair.id, "Ada", edit, "approved")
    return decode_rle(newest.mask), ignored


@pytest.mark.parametrize("mode", ["separate", "255", "none"])
def test_ill_posed_pixels_lie_beside_or_inside_or_nowhere(db, ill_posed, tmp_path, mode):
    changed, ignored = ill_posed
    export(db, tmp_path / "set", ignore=mode)
    mask = grey(tmp_path / "set" / "cs1" / "mask" / "0000.png")
    beside = tmp_path / "set" / "cs1" / "ignore" / "0000.png"
    manifest = json.loads((tmp_path / "set" / "manifest.json").read_text())
    if mode == "255":
        assert (mask == np.where(ignored, 255, changed)).all() and manifest["changed"] == 1
        assert set(np.unique(grey(tmp_path / "set" / "cs1" / "mask" / "0001.png"))) == {0, 1}
    else:
        assert (mask == 255 * changed).all() and manifest["changed"] == 255
    assert beside.exists() == (mode == "separate")
    if mode == "separate":
        assert (grey(beside) == 255 * ignored).all()


def test_an_image_that_is_gone_leaves_no_half_of_an_export_and_it_goes_on(db, tiny_split, tmp_path):
    live = tiny_split[2].live.path
    kept = live.read_bytes()
    live.unlink()
    with pytest.raises(NotFound, match=r"0002\.png: is gone.* the same command goes on"):
        export(db, tmp_path / "set")
    assert not (tmp_path / "set").exists()
    part = tmp_path / ".set.partial"
    done = part / "cs1" / "t1" / "0000.png"
    times = {path: path.stat().st_mtime_ns for path in part.rglob("*.png")}
    assert done in times
    (part / "cs1" / "mask" / "0001.png").write_bytes(b"cut off")
    (part / "left-over.png").write_bytes(b"of another mask")
    live.write_bytes(kept)
    assert export(db, tmp_path / "set") == 3 and not part.exists()
    # What was whole is taken over, what was not is written again.
    assert (tmp_path / "set" / "cs1" / "t1" / "0000.png").stat().st_mtime_ns == times[done]
    export(db, tmp_path / "whole")
    files = sorted(p.relative_to(tmp_path / "set") for p in (tmp_path / "set").rglob("*.*"))
    assert files == sorted(
        p.relative_to(tmp_path / "whole") for p in (tmp_path / "whole").rglob("*.*")
    )
    for path in files:
        assert (tmp_path / "set" / path).read_bytes() == (tmp_path / "whole" / path).read_bytes()


def test_a_part_that_would_be_another_now_is_written_again(db, tiny_split, tmp_path):
    live = tiny_split[2].live.path
    kept = live.read_bytes()
    live.unlink()
    with pytest.raises(NotFound):
        export(db, tmp_path / "set")
    edit = MaskEdit(encode_rle(np.ones((120, 160), bool)), 1)
    draw(db, tiny_split[0].id, "Ada", edit)
    live.write_bytes(kept)
    export(db, tmp_path / "set")
    assert grey(tmp_path / "set" / "cs1" / "mask" / "0000.png").min() == 255


def test_a_consensus_is_what_more_than_half_drew_and_ties_are_ignored(db, tiny_split):
    pair = tiny_split[0]
    drawn = {"Ada": np.s_[:, :40], "Bob": np.s_[:, :80], "Cy": np.s_[:, :20]}
    for number, (name, where) in enumerate(drawn.items(), start=1):
        mask = np.zeros((120, 160), bool)
        mask[where] = True
        draw(db, pair.id, name, MaskEdit(encode_rle(mask), number))
    (three,), without = select_labelled(db, Selection(consensus=2))
    assert three.origin["annotators"] == ["Ada", "Bob", "Cy"] and len(without) == 2
    mask = decode_rle(three.mask)
    assert mask[:, :40].all() and not mask[:, 40:].any() and three.ignore() is None
    edit = MaskEdit(encode_rle(np.zeros((120, 160), bool)), 4)
    draw(db, pair.id, "Dee", edit)
    (four,), _ = select_labelled(db, Selection(consensus=4))
    mask, ignore = decode_rle(four.mask), four.ignore()
    assert mask[:, :20].all() and not mask[:, 20:].any()
    assert ignore[:, 20:40].all() and not ignore[:, :20].any() and not ignore[:, 40:].any()
    with pytest.raises(NotFound, match="none of 3 pairs has ground truth of 5 people"):
        select_labelled(db, Selection(consensus=5))
    with pytest.raises(InvalidInput, match="consensus is of all people"):
        Selection(consensus=2, annotators=("Ada",))


def test_pairs_are_selected_by_a_verdict_on_their_regions(db, run, tiny_split):
    region = load_regions(db, run.id, tiny_split[1].id)[0]
    ada = annotator_id(db, "Ada")
    give_verdict(db, region.id, ada, "keep")
    give_verdict(db, region.id, ada, "reject")
    assert titles(db, verdicts=("reject", "agree")) == ["0001"]
    assert titles(db, verdicts=("reject",), run=run.name) == ["0001"]
    with pytest.raises(NotFound):
        titles(db, verdicts=("keep",))
    with pytest.raises(InvalidInput, match="there is no verdict 'no'; there are agree, adopt"):
        Selection(verdicts=("no",))


def titles(db, **selection):
    return [item.pair.name for item in select_labelled(db, Selection(**selection))[0]]


def test_pairs_are_selected_by_state_person_and_size(db, tiny_split, ill_posed):
    ada = annotator_id(db, "Ada")
    change_state(db, tiny_split[1].id, ada, "submitted", None, 0.0)
    assert titles(db, states=("submitted",)) == ["0001"]
    assert titles(db, annotators=("Ada",)) == ["0000"]
    assert titles(db, least_px=1) == ["0000", "0001"]
    assert titles(db, most_px=0) == ["0002"]
    with pytest.raises(NotFound, match="none of 3 masks is of that size"):
        titles(db, least_px=10**6)
    with pytest.raises(InvalidInput, match="is about ground truth"):
        Selection(annotators=("Ada",), run="x")
    with pytest.raises(InvalidInput, match="--ignore-unseen is about predictions"):
        Selection(ignore_unseen=True)
    with pytest.raises(InvalidInput, match="there is no state 'todo'; there are in_progress"):
        Selection(states=("todo",))


def test_final_masks_of_a_run_take_the_place_of_ground_truth(db, run, tiny_split):
    from reviewer.store.regions import load_final_mask

    labelled, without = select_labelled(db, Selection(run=run.name))
    assert without == [] and [item.origin for item in labelled] == [{"run": run.name}] * 3
    for item in labelled:
        assert item.mask == load_final_mask(db, run.id, item.pair.id)


@pytest.fixture
def left_unseen(db, run, tiny_split):
    """The run has not seen the left of the first pair, and all of the others."""
    unseen = np.arange(160)[None, :].repeat(120, axis=0) < 60
    for pair in tiny_split:
        hide(db, run.id, pair.id, unseen if pair is tiny_split[0] else unseen & False)
    return unseen


def test_unseen_pixels_of_a_prediction_are_void_where_asked(db, run, left_unseen, tmp_path):
    plain, void = tmp_path / "plain", tmp_path / "void"
    export(db, plain, Selection(run=run.name), ignore="255")
    export(db, void, Selection(run=run.name, ignore_unseen=True), ignore="255")
    for name in ("0000", "0001", "0002"):
        before, after = (grey(place / "cs1" / "mask" / f"{name}.png") for place in (plain, void))
        assert not (before == 255).any()
        hidden = left_unseen if name == "0000" else left_unseen & False
        assert ((after == 255) == hidden).all() and (after[~hidden] == before[~hidden]).all()


def test_what_a_run_has_not_seen_is_no_part_of_the_ground_truth(db, run, tiny_split, tmp_path):
    labelled, _ = select_labelled(db, ALL)
    assert export_png(labelled, tmp_path / "before", ALL) == 3
    for pair in tiny_split:
        hide(db, run.id, pair.id, np.ones((120, 160), bool))
    export_png(select_labelled(db, ALL)[0], tmp_path / "after", ALL)
    files = [path for path in (tmp_path / "before").rglob("*") if path.is_file()]
    assert len(files) == 4
    for path in files:
        other = tmp_path / "after" / path.relative_to(tmp_path / "before")
        assert other.read_bytes() == path.read_bytes()


def test_the_command_writes_unseen_pixels_beside_the_mask(db, run, left_unseen, tmp_path):
    given = ["--run", run.name, "--ignore-unseen", "--db", str(db.path)]
    done = CliRunner().invoke(app, ["export", "png", str(tmp_path / "set"), *given])
    assert done.exit_code == 0, done.output
    ignored = decode_png((tmp_path / "set" / "cs1" / "0000.ignore.png").read_bytes())
    assert (ignored == left_unseen).all()
    assert not (tmp_path / "set" / "cs1" / "0001.ignore.png").exists()


def test_shards_are_read_by_webdataset_and_masks_are_the_same(db, tiny_split, ill_posed, tmp_path):
    labelled, _ = select_labelled(db, ALL)
    assert export_webdataset(labelled, tmp_path / "set", ALL, pairs_a_shard=2) == 3
    shards = sorted(str(path) for path in (tmp_path / "set").glob("*.tar"))
    assert [Path(shard).name for shard in shards] == ["cs1-000000.tar", "cs1-000001.tar"]
    # In a process of its own: the library leaves its files to the garbage collector.
    code = (
        "import pickle, sys, webdataset;"
        "found = list(webdataset.WebDataset(sys.argv[1:], shardshuffle=False));"
        "sys.stdout.buffer.write(pickle.dumps(found))"
    )
    read = subprocess.run([sys.executable, "-c", code, *shards], check=True, capture_output=True)
    samples = pickle.loads(read.stdout)
    assert [sample["__key__"] for sample in samples] == ["0000", "0001", "0002"]
    for pair, sample in zip(tiny_split, samples, strict=True):
        truth = decode_rle(newest_revision(db, pair.id).mask)
        assert (decode_png(sample["mask.png"]) == truth).all()
        assert sample["t1.png"] == pair.live.path.read_bytes()
        assert sample["t0.png"] == pair.reference.path.read_bytes()
        assert json.loads(sample["json"])["pair"] == pair.title
    assert (decode_png(samples[0]["ignore.png"]) == ill_posed[1]).all()
    export_webdataset(labelled, tmp_path / "again", ALL, pairs_a_shard=2)
    for shard in shards:
        again = tmp_path / "again" / Path(shard).name
        assert again.read_bytes() == Path(shard).read_bytes()


@pytest.fixture
def two_workspaces(db, tmp_path):
    for name in ("cs1", "cs2", "hw1"):
        folder = write_split(tmp_path / "data" / name, 4)
        import_split(db, name, folder, ImportSettings(), lambda *_: None)
    return list_pairs(db)


@pytest.mark.parametrize(
    ("kind", "names"),
    [("split", ["cs1", "cs2", "hw1"]), ("workspace", ["cs", "hw"]),
     ("same-split", ["part-1", "part-2"])],
)  # fmt: skip
def test_no_pair_is_both_trained_and_tested_on(db, two_workspaces, kind, names):
    folds = make_folds(db, two_workspaces, kind, parts=2)
    assert [fold.name for fold in folds] == names
    tested = [pair.id for fold in folds for pair in fold.test]
    assert sorted(tested) == sorted(pair.id for pair in two_workspaces)
    for fold in folds:
        train, test = ({p.id for p in pairs} for pairs in (fold.train, fold.test))
        assert not train & test and len(train | test) == 12
        past = [{p.reference.id for p in pairs} for pairs in (fold.train, fold.test)]
        assert not past[0] & past[1]
    if kind == "same-split":
        assert all({p.split for p in fold.test} == {"cs1", "cs2", "hw1"} for fold in folds)


def test_a_reference_image_that_two_splits_share_is_in_one_part(db, tmp_path):
    # The same drive, imported with each of two groups of objects.
    for name in ("cs1", "cs2"):
        folder = write_split(tmp_path / "data" / name, 4)
        import_split(db, name, folder, ImportSettings(), lambda *_: None)
    for fold in make_folds(db, list_pairs(db), "same-split", 2):
        past = [{p.reference.sha256 for p in pairs} for pairs in (fold.train, fold.test)]
        assert not past[0] & past[1] and fold.test


def test_folds_are_lists_of_pairs(db, two_workspaces, tmp_path):
    labelled, _ = select_labelled(db, ALL)
    assert export_folds(db, labelled, tmp_path / "folds", ALL, "workspace") == 2
    lines = (tmp_path / "folds" / "hw" / "test.txt").read_text().splitlines()
    assert lines == ["hw1/0000", "hw1/0001", "hw1/0002", "hw1/0003"]
    with pytest.raises(Conflict, match="exists already"):
        export_folds(db, labelled, tmp_path / "folds", ALL, "workspace")


def test_folds_that_cannot_be_made_are_refused(db, tiny_split):
    for kind, parts, message in (
        ("split", 5, "there is only cs1"),
        ("same-split", 5, "has 3 reference images, fewer than 5 parts"),
        ("same-split", 1, "need two or more parts"),
    ):
        with pytest.raises(InvalidInput, match=message):
            make_folds(db, tiny_split, kind, parts)


def test_the_command_exports_training_sets(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_split(tmp_path / "data" / "cs1")
    runner = CliRunner()
    runner.invoke(app, ["import", "data"], catch_exceptions=False)
    done = runner.invoke(app, ["export", "t0t1", "set", "--least-px", "1"])
    assert "2 masks in set" in done.output, done.output
    done = runner.invoke(app, ["export", "folds", "folds", "--parts", "3"])
    assert "3 folds in folds" in done.output, done.output
