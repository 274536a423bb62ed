"""Layouts of public change detection sets, each as it was published."""

import cv2
import numpy as np
import pytest
from scenes import textured
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.dataset.layouts import find_splits
from reviewer.errors import InvalidInput, NotFound
from reviewer.masks import decode_rle
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import newest_revision

CHANGED = np.zeros((120, 160), bool)
CHANGED[10:20, 10:30] = True


def picture(path, image):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)


def bring_in(db, folder, layout, **settings):
    return {
        name: import_split(
            db, name, place, ImportSettings(layout=layout, **settings), lambda *_: None
        )
        for name, place in find_splits(folder, layout)
    }


def only_mask(db):
    (pair,) = list_pairs(db)
    return pair, decode_rle(newest_revision(db, pair.id).mask)


def test_pcd_by_folds_has_splits_two_levels_below(db, tmp_path):
    for fold in ("set0", "set1"):
        for part in ("train", "test"):
            place = tmp_path / "pcd_5cv" / fold / part
            for name in ("t0", "t1"):
                picture(place / name / "a.jpg", textured(1))
            picture(place / "mask" / "a.png", CHANGED * np.uint8(255))
    reports = bring_in(db, tmp_path / "pcd_5cv", "t0t1")
    assert sorted(reports) == ["set0-test", "set0-train", "set1-test", "set1-train"]
    assert all((r.pairs, r.masks) == (1, 1) for r in reports.values())


def test_raw_vl_cmu_cd_keeps_both_pictures_in_one_folder_and_sky_is_no_change(db, tmp_path):
    place = tmp_path / "raw" / "003"
    picture(place / "RGB" / "1_07.png", textured(1))
    picture(place / "RGB" / "2_07.png", textured(2))
    picture(place / "RGB" / "notes.png", textured(3))
    levels = np.zeros((120, 160), np.uint8)
    levels[CHANGED], levels[:5] = 7, 255
    picture(place / "GT" / "gt07.png", levels)
    ((name, report),) = bring_in(db, tmp_path / "raw", "vl-cmu-cd").items()
    assert name == "003" and "1 to 254 = changed" in report.polarity
    assert [reason for _, reason in report.skipped] == ["its name begins with none of 1_, 2_, gt"]
    pair, mask = only_mask(db)
    assert (pair.name, pair.reference.path.name, pair.live.path.name) == (
        "07", "1_07.png", "2_07.png"
    )  # fmt: skip
    assert (mask == CHANGED).all()


def test_pscd_takes_the_mask_in_the_frame_of_live(db, tmp_path):
    for name in ("t0", "t1"):
        picture(tmp_path / "pscd" / name / "a.png", textured(1))
    picture(tmp_path / "pscd" / "mask_t0" / "a.png", np.full((120, 160), 255, np.uint8))
    picture(tmp_path / "pscd" / "mask_t1" / "a.png", CHANGED * np.uint8(3))
    bring_in(db, tmp_path / "pscd", "pscd")
    assert (only_mask(db)[1] == CHANGED).all()


def test_changesim_is_found_deep_down_and_its_colours_are_changes(db, tmp_path):
    place = tmp_path / "Query" / "Query_Seq_Test" / "Warehouse_6" / "Seq_0"
    picture(place / "rgb" / "12.png", textured(1))
    picture(place / "t0" / "rgb" / "12.png", textured(2))
    colours = np.zeros((120, 160, 3), np.uint8)
    colours[CHANGED] = (0, 0, 9)
    picture(place / "change_segmentation" / "12.png", colours)
    reports = bring_in(db, tmp_path, "changesim")
    assert list(reports) == ["Query-Query_Seq_Test-Warehouse_6-Seq_0"]
    assert (only_mask(db)[1] == CHANGED).all()


@pytest.fixture
def levir(tmp_path):
    folder = tmp_path / "LEVIR-CD256"
    for name in ("A", "B"):
        for k in range(3):
            picture(folder / name / f"tile_{k}.png", textured(k))
    for k in range(3):
        picture(folder / "label" / f"tile_{k}.png", CHANGED * np.uint8(255))
    (folder / "list").mkdir()
    (folder / "list" / "train.txt").write_text("tile_0.png\ntile_2.png\n")
    (folder / "list" / "test.txt").write_text("tile_1.png\n")
    return folder


def test_levir_lists_are_splits(db, levir):
    reports = bring_in(db, levir, "t0t1")
    assert {name: report.pairs for name, report in reports.items()} == {
        "LEVIR-CD256-test": 1,
        "LEVIR-CD256-train": 2,
    }


def test_a_list_that_names_what_is_not_there_is_refused(db, levir):
    (levir / "list" / "train.txt").write_text("tile_9.png\n")
    with pytest.raises(InvalidInput, match="its list names tile_9, which is not in B/"):
        bring_in(db, levir, "t0t1")


def test_grey_masks_count_above_black_when_that_is_said(db, tmp_path):
    for name in ("t0", "t1"):
        picture(tmp_path / "set" / name / "a.png", textured(1))
    levels = CHANGED * np.uint8(90)
    levels[12] *= 2
    picture(tmp_path / "set" / "mask" / "a.png", levels)
    with pytest.raises(InvalidInput, match="holds 0 and one other value"):
        bring_in(db, tmp_path / "set", "t0t1")
    bring_in(db, tmp_path / "set", "t0t1", polarity="nonzero")
    assert (only_mask(db)[1] == CHANGED).all()


def test_a_layout_that_is_nowhere_is_told(tmp_path):
    with pytest.raises(NotFound, match=r"no t0/rgb/ rgb/ in it nor in 4 levels below"):
        find_splits(tmp_path, "changesim")


def test_a_dry_run_says_what_would_happen_and_writes_nothing(levir, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = CliRunner()
    command = ["import", str(levir), "--layout", "t0t1"]
    done = runner.invoke(app, [*command, "--dry-run"], catch_exceptions=False)
    assert "LEVIR-CD256-train: 2 pairs, 2 with a mask, 0 files skipped" in done.output
    assert "white = changed (guessed" in done.output and "3 pairs would be imported" in done.output
    assert not (tmp_path / "reviewer.db").exists()
    runner.invoke(app, command, catch_exceptions=False)
    again = runner.invoke(app, [*command, "--dry-run"], catch_exceptions=False)
    assert again.output.count("is in the database already") == 2


def test_a_told_polarity_is_kept_to_or_refused(db, tmp_path):
    for name in ("t0", "t1"):
        picture(tmp_path / "pscd" / name / "a.png", textured(1))
    picture(tmp_path / "pscd" / "mask_t1" / "a.png", ~CHANGED * np.uint8(255))
    bring_in(db, tmp_path / "pscd", "pscd", polarity="black")
    assert (only_mask(db)[1] == CHANGED).all()
    place = tmp_path / "Seq_0"
    picture(place / "rgb" / "12.png", textured(1))
    picture(place / "t0" / "rgb" / "12.png", textured(2))
    with pytest.raises(InvalidInput, match="polarity black: masks of layout changesim have their"):
        bring_in(db, tmp_path, "changesim", polarity="black")


@pytest.mark.parametrize("name", ["../evil", "a/b", "..", "c:x"])
def test_a_split_whose_name_leads_elsewhere_is_refused(db, levir, name):
    with pytest.raises(InvalidInput, match="a name has no slash"):
        import_split(db, name, levir, ImportSettings(layout="t0t1"), lambda *_: None)
