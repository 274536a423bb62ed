"""Importing: whole or not at all, and every refusal names the file."""

import math
import os
import shutil
import struct
import tracemalloc
import zlib

import cv2
import numpy as np
import pytest
from PIL import Image as PillowImage
from scenes import textured, write_split

from reviewer.dataset.files import read_rgb
from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.dataset.layouts import find_splits
from reviewer.errors import InvalidInput, NotFound
from reviewer.masks import decode_rle, encode_png
from reviewer.store.pairs import list_maps, list_pairs, list_splits
from reviewer.store.revisions import newest_revision


def bring_in(db, folder, name="cs1", **settings):
    return import_split(db, name, folder, ImportSettings(**settings), lambda *_: None)


def rewrite_poses(folder, change):
    path = folder / "poses.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join(change(lines)) + "\n")


def test_live_images_are_paired_with_the_closest_viewpoint(db, split_folder):
    report = bring_in(db, split_folder)
    pairs = list_pairs(db)
    assert report.pairs == 3
    expected = [(n, n) for n in ("0000", "0001", "0002")]
    assert [(p.reference.name, p.live.name) for p in pairs] == expected
    assert pairs[0].viewpoint_distance == pytest.approx(math.sqrt(0.03**2 + 0.02**2 + 0.01**2))
    assert (list_splits(db)[0].workspace, list_splits(db)[0].object_group) == ("cs", 1)


def test_masks_become_the_first_revision(db, split_folder):
    bring_in(db, split_folder)
    newest = newest_revision(db, list_pairs(db)[0].id)
    assert (newest.number, newest.source, newest.annotator) == (1, "import", None)
    assert decode_rle(newest.mask)[40:60, 50:75].all() and newest.mask.area == 500


def test_paths_are_kept_relative_to_the_database(db, split_folder):
    bring_in(db, split_folder)
    row = db.read().execute("SELECT path FROM images").fetchone()
    assert row["path"].startswith("cs1/")
    assert list_pairs(db)[0].live.path.exists()


def test_the_map_is_read(db, split_folder):
    bring_in(db, split_folder)
    (occupancy,) = list_maps(db)
    grid = occupancy.grid
    assert (grid.resolution, grid.width, grid.origin.y) == (0.1, 80, -2)


def test_a_split_that_is_there_is_left_alone(db, split_folder):
    bring_in(db, split_folder)
    assert bring_in(db, split_folder).already_there
    assert len(list_pairs(db)) == 3


def test_a_live_image_without_a_reference_nearby_is_skipped_with_the_reason(db, split_folder):
    rewrite_poses(split_folder, lambda lines: [
        line.replace("live,0002,102,2.03", "live,0002,102,9.0") for line in lines
    ])  # fmt: skip
    report = bring_in(db, split_folder)
    assert report.pairs == 2
    assert "0002.png" in str(report.skipped[0][0])
    assert "closest reference is 7.00 m away" in report.skipped[0][1]


def test_files_that_are_no_images_are_skipped_with_the_reason(db, split_folder):
    (split_folder / "live" / "Thumbs.db").write_text("x")
    (path, reason) = bring_in(db, split_folder).skipped[0]
    assert (path.name, reason) == ("Thumbs.db", "not an image")


def huge_png():
    """A PNG header that promises 60000x60000 pixels."""
    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    chunk = b"IHDR" + header
    body = struct.pack(">I", len(header)) + chunk + struct.pack(">I", zlib.crc32(chunk))
    return b"\x89PNG\r\n\x1a\n" + body + struct.pack(">I", 0) + b"IDAT" + b"\0" * 4


def truncated_jpeg():
    data = cv2.imencode(".jpg", textured(0))[1].tobytes()
    return data[: len(data) // 2]


def truncated_png():
    data = cv2.imencode(".png", textured(0))[1].tobytes()
    return data[: len(data) // 2]


def other_size():
    return cv2.imencode(".png", np.zeros((60, 80, 3), np.uint8))[1].tobytes()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [("0001.png", huge_png, r"0001\.png: 60000x60000 is more than 64 million pixels"),
     ("0001.png", truncated_png, r"0001\.png: damaged image"),
     ("0001.jpg", truncated_jpeg, r"0001\.jpg: damaged image"),
     ("0001.png", lambda: b"hello", r"0001\.png: not a readable image"),
     ("0001.png", other_size, r"pair cs1/0001: live .* is 80x60 but reference .* is 160x120")],
)  # fmt: skip
def test_a_bad_live_image_is_named_and_nothing_is_stored(db, split_folder, name, content, message):
    (split_folder / "live" / "0001.png").unlink()
    (split_folder / "live" / name).write_bytes(content())
    with pytest.raises(InvalidInput, match=message):
        bring_in(db, split_folder)
    assert list_splits(db) == [] and list_pairs(db) == []


@pytest.mark.parametrize(
    ("change", "message"),
    [(lambda lines: [line.replace("1.03", "nan") for line in lines], "line 5: .*must be finite"),
     (lambda lines: [line.replace("1.03", "left") for line in lines], "line 5: could not convert"),
     (lambda lines: lines[:-1], r"0002\.png: has no row in poses\.csv"),
     (lambda lines: [*lines, lines[-1]], "line 8: live image '0002' has a pose already"),
     (lambda lines: [lines[0].replace("theta", "yaw"), *lines[1:]], "has no column theta"),
     (lambda lines: [line.replace("live", "now") for line in lines], "must be reference or live")],
)  # fmt: skip
def test_bad_poses_are_named_by_line(db, split_folder, change, message):
    rewrite_poses(split_folder, change)
    with pytest.raises(InvalidInput, match=message):
        bring_in(db, split_folder)
    assert list_splits(db) == []


def test_two_images_of_one_name_are_refused(db, split_folder):
    shutil.copy(split_folder / "live" / "0001.png", split_folder / "live" / "0001.bmp")
    with pytest.raises(InvalidInput, match="the name '0001' is taken"):
        bring_in(db, split_folder)


def test_a_link_that_leaves_the_folder_is_refused(db, split_folder, tmp_path):
    outside = tmp_path / "secret.png"
    shutil.copy(split_folder / "live" / "0001.png", outside)
    (split_folder / "live" / "0001.png").unlink()
    os.symlink(outside, split_folder / "live" / "0001.png")
    with pytest.raises(InvalidInput, match="is a link that leads out of"):
        bring_in(db, split_folder)


def test_a_mask_with_grey_values_is_refused(db, split_folder):
    cv2.imwrite(str(split_folder / "mask" / "0000.png"), textured(1)[..., 0])
    with pytest.raises(InvalidInput, match=r"0000\.png: a mask holds 0 and one other value"):
        bring_in(db, split_folder)


def test_a_mask_of_another_size_is_refused(db, split_folder):
    (split_folder / "mask" / "0000.png").write_bytes(encode_png(np.zeros((5, 5), bool)))
    with pytest.raises(InvalidInput, match="is 5x5 but its live image is 160x120"):
        bring_in(db, split_folder)


@pytest.mark.parametrize(
    ("yaml", "message"),
    [("image: map.pgm", "needs image, resolution and origin"),
     ("image: map.pgm\nresolution: -1\norigin: [0, 0, 0]", "must be positive"),
     ("image: /etc/hostname\nresolution: 1\norigin: [0, 0, 0]", "lies outside")],
)  # fmt: skip
def test_a_bad_map_is_refused(db, split_folder, yaml, message):
    (split_folder / "map.yaml").write_text(yaml)
    with pytest.raises(InvalidInput, match=message):
        bring_in(db, split_folder)


def write_t0t1(folder, names=("t0", "t1", "mask"), *, invert=False):
    for name in names:
        (folder / name).mkdir(parents=True)
    mask = np.zeros((120, 160), bool)
    mask[10:20, 10:30] = True
    for k in range(2):
        cv2.imwrite(str(folder / names[0] / f"{k}.jpg"), textured(k))
        cv2.imwrite(str(folder / names[1] / f"{k}.png"), textured(k))
        (folder / names[2] / f"{k}.png").write_bytes(encode_png(~mask if invert else mask))
    return folder


@pytest.mark.parametrize("names", [("t0", "t1", "mask"), ("A", "B", "label"), ("t0", "t1", "gt")])
def test_pairs_by_file_name_are_read(db, tmp_path, names):
    report = bring_in(db, write_t0t1(tmp_path / "tsunami", names), "tsunami", layout="t0t1")
    assert report.pairs == 2
    assert newest_revision(db, list_pairs(db)[0].id).mask.area == 200


def test_inverted_masks_are_noticed_and_told(db, tmp_path):
    folder = write_t0t1(tmp_path / "gsv", invert=True)
    report = bring_in(db, folder, "gsv", layout="t0t1")
    assert "black = changed (guessed" in report.polarity
    assert newest_revision(db, list_pairs(db)[0].id).mask.area == 200


def test_the_polarity_can_be_told(db, tmp_path):
    folder = write_t0t1(tmp_path / "gsv", invert=True)
    report = bring_in(db, folder, "gsv", layout="t0t1", polarity="white")
    assert report.polarity == "white = changed (as told)"
    assert newest_revision(db, list_pairs(db)[0].id).mask.area == 120 * 160 - 200


def test_splits_are_found_in_a_folder_or_one_below(tmp_path):
    write_split(tmp_path / "world" / "cs1", 1)
    write_split(tmp_path / "world" / "cs2", 1)
    assert [n for n, _ in find_splits(tmp_path / "world", "sequence")] == ["cs1", "cs2"]
    assert [n for n, _ in find_splits(tmp_path / "world" / "cs2", "sequence")] == ["cs2"]
    with pytest.raises(NotFound, match="no reference/ live/"):
        find_splits(tmp_path, "sequence")


def test_a_picture_that_lies_on_its_side_is_measured_as_it_is_shown(db, split_folder):
    exif = PillowImage.Exif()
    exif[0x0112] = 6
    lying = PillowImage.fromarray(np.ascontiguousarray(np.rot90(textured(1))))
    lying.save(split_folder / "live" / "0001.png", exif=exif)
    report = bring_in(db, split_folder)
    pair = list_pairs(db)[1]
    assert (pair.live.height, pair.live.width) == (120, 160)
    assert (read_rgb(pair.live.path) == textured(1)).all()
    assert "1 images are turned as their EXIF orientation says" in report.notes


def test_transparency_is_left_out_with_a_word(db, split_folder):
    clear = np.dstack([textured(1), np.zeros((120, 160), np.uint8)])
    PillowImage.fromarray(clear).save(split_folder / "live" / "0001.png")
    assert "1 images have transparency, which is left out" in bring_in(db, split_folder).notes


def test_a_huge_mask_is_refused_by_its_header(db, split_folder):
    (split_folder / "mask" / "0000.png").write_bytes(
        cv2.imencode(".png", np.zeros((7000, 9000), np.uint8))[1].tobytes()
    )
    tracemalloc.start()
    with pytest.raises(InvalidInput, match="is 9000x7000 but its live image is 160x120"):
        bring_in(db, split_folder)
    assert tracemalloc.get_traced_memory()[1] < 20_000_000
    tracemalloc.stop()


def test_bad_pairs_are_left_out_when_that_is_said(db, tmp_path):
    folder = write_t0t1(tmp_path / "set")
    for k in range(2, 7):
        cv2.imwrite(str(folder / "t0" / f"{k}.jpg"), textured(k))
        cv2.imwrite(str(folder / "t1" / f"{k}.png"), textured(k))
    (folder / "t1" / "2.png").write_bytes(other_size())
    (folder / "t0" / "3.jpg").write_bytes(truncated_jpeg())
    cv2.imwrite(str(folder / "t1" / "4.png"), textured(4).astype(np.uint16))
    (folder / "mask" / "5.png").write_bytes(encode_png(np.zeros((5, 5), bool)))
    (folder / "mask" / "6.png").write_bytes(truncated_png())
    with pytest.raises(InvalidInput, match=r"2: live .* is 80x60 .*\(--skip-bad leaves such pairs"):
        bring_in(db, folder, "set", layout="t0t1")
    report = bring_in(db, folder, "set", layout="t0t1", skip_bad=True)
    assert (report.pairs, report.masks) == (2, 2)
    reasons = {path.stem: reason for path, reason in report.skipped}
    assert sorted(reasons) == ["2", "3", "4", "5", "6"]
    assert all(reason.startswith("bad pair, ") for reason in reasons.values())
    assert "damaged image" in reasons["6"] and "more than 8 bits" in reasons["4"]
    assert [pair.name for pair in list_pairs(db)] == ["0", "1"]


def test_bad_pairs_alone_are_no_split(db, tmp_path):
    folder = write_t0t1(tmp_path / "set")
    for k in range(2):
        (folder / "t1" / f"{k}.png").write_bytes(b"junk")
    with pytest.raises(InvalidInput, match=r"no pairs; 2 files skipped, the first is 0\.png: bad"):
        bring_in(db, folder, "set", layout="t0t1", skip_bad=True)


def turned_by(degrees):
    def change(lines):
        rows = [line.split(",") for line in lines[1:]]
        return [lines[0], *(",".join([*row[:5], str(float(row[5]) + degrees)]) for row in rows)]

    return change


def test_headings_in_degrees_are_not_taken_for_radians(db, split_folder):
    rewrite_poses(split_folder, turned_by(180))
    with pytest.raises(
        InvalidInput, match=r"line 2: heading \(column theta\) is 180.01, more than"
    ):
        bring_in(db, split_folder)
    report = bring_in(db, split_folder, heading="degrees")
    assert report.pairs == 3
    assert "viewpoints are x, y in metres and heading (column theta) in degrees" in report.notes
    assert list_pairs(db)[0].live.pose.theta == pytest.approx(math.pi)


def test_headings_that_count_on_after_a_turn_are_radians_when_that_is_said(db, split_folder):
    rewrite_poses(split_folder, turned_by(20 * math.pi))
    report = bring_in(db, split_folder, heading="radians")
    assert report.pairs == 3 and any("theta) in radians" in note for note in report.notes)
    assert list_pairs(db)[0].viewpoint_distance == pytest.approx(0.0374, abs=1e-4)


def test_the_heading_s_part_in_a_distance_is_named(db, split_folder):
    rewrite_poses(split_folder, lambda lines: [
        line.replace("live,0002,102,2.03,0.0,0.0", "live,0002,102,2.03,0.0,3.0") for line in lines
    ])  # fmt: skip
    (_, reason), *_ = bring_in(db, split_folder).skipped
    assert "is 2.99 m away (limit 0.5), with 2.99 radians of heading between them" in reason


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "has no column session"),
        (b"\xff\xfe\x00", "is no UTF-8 text"),
        (b"session,name,stamp,x,y,theta\nlive,0000,1,1e308,0,0", "go up to 1e.08 at most"),
        (b"session,name,stamp,x,y,theta\nlive,0000,1,inf,0,0", "must be finite numbers"),
        (b"session,name,stamp,x,y,theta\nlive,0000", "could not convert"),
        (b"session,name,stamp,x,y,theta\nlive,\x00,1,0,0,0", "has no row in poses.csv"),
        (b"session,name,stamp,x,y,theta\nlive," + b"a" * 200_000 + b",1,0,0,0", "poses.csv, line"),
    ],
)
def test_broken_poses_are_one_sentence(db, split_folder, content, message):
    (split_folder / "poses.csv").write_bytes(content)
    with pytest.raises(InvalidInput, match=message) as caught:
        bring_in(db, split_folder)
    assert "poses.csv" in str(caught.value) and "\n" not in str(caught.value)


LAUGHS = "a: &a [x, x]\nb: &b [*a, *a]\nimage: map.pgm\nresolution: 1\norigin: [0, 0, 0]\n"


@pytest.mark.parametrize(
    ("yaml", "message"),
    [
        (LAUGHS, "aliases are not read"),
        ("a: " + "[" * 5000, "is no readable YAML"),
        ("# " + "x" * 70_000, "has more than 64 KiB"),
        ("image: !!bool maybe", "is no readable YAML"),
        ("image: !!timestamp x", "is no readable YAML"),
        ("[1", "is no readable YAML"),
        ("hello", "needs image, resolution and origin"),
        ("", "needs image, resolution and origin"),
        ("image: map.pgm\nresolution: .inf\norigin: [0, 0, 0]", "must be positive"),
        ("image: map.pgm\nresolution: 1\norigin: [.nan, 0, 0]", "go up to 1e.08 at most"),
        ("image: map.pgm\nresolution: 1e308\norigin: [0, 0, 0]", "go up to 1e.08 at most"),
        ('image: "a\\0b"\nresolution: 1\norigin: [0, 0, 0]', "needs image"),
        ("image: .\nresolution: 1\norigin: [0, 0, 0]", "is a folder, not a regular file"),
    ],
)
def test_a_broken_map_is_one_sentence_and_found_by_a_dry_run(db, split_folder, yaml, message):
    (split_folder / "map.yaml").write_text(yaml)
    with pytest.raises(InvalidInput, match=message) as caught:
        import_split(db, "cs1", split_folder, ImportSettings(), lambda *_: None, dry_run=True)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("place", ["poses.csv", "map.yaml", "live/0001.png", "mask/0001.png"])
@pytest.mark.parametrize("kind", ["pipe", "loop"])
def test_a_pipe_or_a_loop_of_links_among_the_files_is_named(db, split_folder, place, kind):
    path = split_folder / place
    path.unlink()
    os.mkfifo(path) if kind == "pipe" else path.symlink_to(path)
    with pytest.raises(InvalidInput, match=f"{path.name}: "):
        bring_in(db, split_folder)


@pytest.mark.parametrize("name", ["a\nb", "\udcff", "a\x1b[31m"])
def test_a_split_whose_name_is_no_text_is_refused(db, split_folder, name):
    with pytest.raises(InvalidInput, match=r"split '.*: a name has"):
        bring_in(db, split_folder, name)
