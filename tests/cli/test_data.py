"""`import`: options reach the importer, and what it does unasked is printed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from scenes import textured
from typer.testing import CliRunner

from reviewer.cli import app, main
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import newest_revision


@pytest.fixture
def grey_set(tmp_path, monkeypatch):
    """One pair whose mask has the levels 0, 90, 170 and 255, and a live image of 16 bits."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "set"
    for name in ("t0", "t1", "mask"):
        (folder / name).mkdir(parents=True)
    for name in ("t0", "t1"):
        cv2.imwrite(str(folder / name / "a.png"), textured(1))
        cv2.imwrite(str(folder / name / "deep.png"), textured(2).astype(np.uint16))
    levels = np.zeros((120, 160), np.uint8)
    levels[10:20], levels[30:40], levels[50:60] = 90, 170, 255
    cv2.imwrite(str(folder / "mask" / "a.png"), levels)
    return folder


def call(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=False)


def imported():
    with Store(Path("reviewer.db")) as store:
        (pair,) = list_pairs(store)
        revision = newest_revision(store, pair.id)
        ignored = revision.ignore()
        return revision.mask.area, 0 if ignored is None else int(ignored.sum())


@pytest.mark.parametrize(
    ("options", "changed", "ignored"),
    [
        (["--changed", 255, "--ignore", 170, "--ignore", 90], 10, 20),
        (["--changed", 255, "--changed", 90, "--ignore", 170], 20, 10),
        (["--mask-threshold", 100], 20, 0),
        (["--changed-colour", "5a5a5a"], 10, 0),
    ],
)
def test_options_say_what_masks_mean(grey_set, options, changed, ignored):
    done = call("import", grey_set, "--layout", "t0t1", "--skip-bad", *options)
    assert "set: 1 pairs, 1 with a mask, 1 files skipped" in done.output, done.output
    assert "(as told)" in done.output
    assert "deep.png: bad pair, " in done.output and "more than 8 bits a channel" in done.output
    assert imported() == (changed * 160, ignored * 160)


def test_a_dry_run_shows_the_guess_and_the_notes(grey_set):
    levels = np.zeros((120, 160), np.uint8)
    levels[30:40], levels[50:60], levels[0, 0] = 170, 255, 250
    cv2.imwrite(str(grey_set / "mask" / "a.png"), levels)
    done = call("import", grey_set, "--layout", "t0t1", "--skip-bad", "--dry-run")
    assert "masks: 255 = changed, 85 and 170 = not scored, 0 and 50 unchanged (gu" in done.output
    assert "set: 1 masks hold pixels that are not scored" in done.output
    assert "set: 1 stray pixels in 1 masks count as the nearest level" in done.output
    assert "1 pairs would be imported" in done.output


def test_the_unit_of_headings_is_named(split_folder, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    done = call("import", split_folder, "--heading", "degrees")
    assert "cs1: viewpoints are x, y in metres and heading (column theta) in deg" in done.output


def stopped(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["reviewer", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


@pytest.mark.parametrize("colour", ["red", "ff00", "ff000000", "gg0000"])
def test_a_colour_that_is_none_is_refused(grey_set, monkeypatch, capsys, colour):
    error = stopped(monkeypatch, capsys, "import", grey_set, "--changed-colour", colour)
    assert f"--changed-colour {colour}: six hexadecimal digits are needed" in error


def test_a_file_name_that_is_no_text_ends_in_one_line(grey_set, monkeypatch, capsys):
    (grey_set / "t0" / os.fsdecode(b"\xff\xfe.png")).write_bytes(b"x")
    error = stopped(monkeypatch, capsys, "import", grey_set, "--layout", "t0t1")
    assert "a name of readable characters is needed" in error


def test_a_name_in_a_file_that_is_no_text_is_told_all_the_same(split_folder, tmp_path):
    square = [[1, 1, 9, 1, 9, 9, 1, 9]]
    document = {
        "images": [
            {"id": 0, "file_name": "0000.png", "height": 120, "width": 160},
            {"id": 1, "file_name": "\ud800.png", "height": 120, "width": 160},
        ],
        "categories": [{"id": 1, "name": "\ud800"}],
        "annotations": [{"image_id": 0, "category_id": 1, "segmentation": square}],
    }
    (tmp_path / "a.json").write_text(json.dumps(document))
    for command in (["import", "cs1"], ["import-masks", "coco", "a.json", "--replace"]):
        done = subprocess.run(
            [sys.executable, "-m", "reviewer", *command],
            cwd=tmp_path, capture_output=True, text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    assert "skipped \\ud800.png: no live image of that name here" in done.stdout
    assert "1 masks imported" in done.stdout
