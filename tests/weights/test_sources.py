"""What the shipped nets learn from: what is fit for it, and whether it is what is recorded."""

import csv
import importlib.util
import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from scenes import textured

from reviewer.synthesis.bank import load_bank

FOLDER = Path(__file__).resolve().parents[2] / "weights"


@pytest.fixture(scope="module")
def sources():
    sys.path.insert(0, str(FOLDER))
    try:
        spec = importlib.util.spec_from_file_location("sources", FOLDER / "sources.py")
        module = importlib.util.module_from_spec(spec)
        # Its dataclass looks itself up.
        sys.modules["sources"] = module
        spec.loader.exec_module(module)
        return module
    finally:
        sys.path.remove(str(FOLDER))


def cutout(solid):
    return np.dstack([np.full((60, 60, 3), 90, np.uint8), solid.astype(np.uint8) * 255])


def test_every_package_is_recorded_with_licence_and_hash(sources):
    with (FOLDER / "sources.csv").open(newline="") as file:
        rows = {row["package"]: row for row in csv.DictReader(file)}
    assert set(rows) == {*(package.name for package in sources.PACKAGES), "scikit-image"}
    for package in sources.PACKAGES:
        row = rows[package.name]
        assert row["licence"] == package.licence and row["version"]
        assert len(row["sha256"]) == 64


def test_what_differs_from_the_record_is_told(sources, tmp_path):
    record = tmp_path / "sources.csv"
    record.write_text("package,version,licence,sha256\na,1,CC0-1.0,00\nb,1,CC0-1.0,11\n")
    same, newer = ("a", "1", "CC0-1.0", "00"), ("b", "2", "CC0-1.0", "22")
    assert sources.differing([same], record) == []
    assert sources.differing([same, newer, ("c", "1", "MIT", "33")], record) == [
        "b: is 2 CC0-1.0 22, but the shipped nets learned from 1 CC0-1.0 11",
        "c: is 1 MIT 33, but the shipped nets learned from none",
    ]


def test_a_large_picture_is_made_smaller_and_tiny_or_blank_ones_are_left_out(sources, tmp_path):
    large = cv2.resize(textured(0), (3200, 400))
    sources.write_background(large, tmp_path / "large.jpg")
    sources.write_background(textured(0)[:100], tmp_path / "tiny.jpg")
    sources.write_background(np.full((300, 300, 3), 40, np.uint8), tmp_path / "blank.jpg")
    sources.write_background(None, tmp_path / "unreadable.jpg")
    assert [path.name for path in tmp_path.iterdir()] == ["large.jpg"]
    assert cv2.imread(str(tmp_path / "large.jpg")).shape == (200, 1600, 3)


def test_a_cut_out_has_something_solid_and_something_empty(sources):
    square = np.zeros((60, 60), bool)
    square[10:50, 10:50] = True
    assert sources.solid_cutout(cutout(square)) is not None
    assert sources.solid_cutout(cutout(np.ones((60, 60), bool))) is None
    assert sources.solid_cutout(cutout(np.zeros((60, 60), bool))) is None
    assert sources.solid_cutout(cutout(square)[..., :3]) is None


def test_cut_outs_are_written_as_a_file_that_the_bank_reads(sources, tmp_path):
    square = np.zeros((60, 60), bool)
    square[10:50, 20:50] = True
    sources.write_objects([("first", cutout(square)), ("second", cutout(square.T))], tmp_path)
    bank = load_bank(tmp_path / "instances.json", tmp_path / "images", least_area_px=100)
    assert [each.category for each in bank.objects] == ["first", "second"]
    assert bank.objects[0].alpha.shape == (40, 30) and bank.objects[0].alpha.all()
    content = json.loads((tmp_path / "instances.json").read_text())
    assert content["annotations"][0]["area"] == 1200


def test_a_gathering_that_breaks_off_leaves_nothing(sources, tmp_path, monkeypatch):
    def half(target, packages):
        (target / "backgrounds").mkdir()
        raise OSError("dpkg-deb: no space left on device")

    monkeypatch.setattr(sources, "gather", half)
    monkeypatch.setattr(sys, "argv", ["sources.py", str(tmp_path / "data")])
    with pytest.raises(OSError, match="no space"):
        sources.main()
    assert list(tmp_path.iterdir()) == []


def test_a_machine_that_has_no_packages_of_debian_is_told_so(sources, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "argv", ["sources.py", str(tmp_path / "data")])
    with pytest.raises(SystemExit, match="apt-get: is not here; packages of Debian are needed"):
        sources.main()
    assert list(tmp_path.iterdir()) == []


def test_things_without_a_name_are_drawn_the_same_for_the_same_seed(sources):
    surfaces = [textured(0), textured(1)]
    drawn = [list(sources.draw_things(surfaces, 40, seed)) for seed in (0, 0, 1)]
    assert len(drawn[0]) > 30
    assert all(np.array_equal(a, b) for a, b in zip(*drawn[:2], strict=True))
    assert not np.array_equal(drawn[0][0], drawn[2][0])
    assert all(sources.solid_cutout(thing) is not None for thing in drawn[0])
