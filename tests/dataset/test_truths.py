"""Mask files: what levels mean is told, known or seen; strays are counted, not refused."""

import cv2
import numpy as np
import pytest
from PIL import Image as PillowImage
from scenes import HEIGHT, WIDTH, textured

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.dataset.truths import find_rule
from reviewer.errors import InvalidInput
from reviewer.masks import decode_rle
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import newest_revision


def levels(**areas):
    """A mask with a rectangle of 20x30 pixels a level; `v255=10` begins at row 10."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    for name, row in areas.items():
        mask[row : row + 20, 10:40] = int(name[1:])
    return mask


def write(folder, *masks):
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{k}.png" for k in range(len(masks))]
    for path, mask in zip(paths, masks, strict=True):
        PillowImage.fromarray(mask).save(path)
    return paths


def rule_of(paths, **settings):
    return find_rule(paths, ImportSettings("t0t1", **settings))


def meaning(truth):
    """Rows on which something is changed, and rows on which something is ignored."""
    rows = np.zeros(HEIGHT, bool) if truth.ignored is None else truth.ignored.any(axis=1)
    return set(np.flatnonzero(truth.changed.any(axis=1))), set(np.flatnonzero(rows))


def block(row):
    return set(range(row, row + 20))


def test_told_levels_mean_changed_and_not_scored(tmp_path):
    (path,) = write(tmp_path / "m", levels(v255=0, v170=30, v85=60, v7=90))
    rule = rule_of([path], changed=(255,), ignore=(85, 170))
    assert rule.says == ("255 = changed, 85 and 170 = not scored, all else unchanged (as told)")
    assert meaning(rule.read(path)) == (block(0), block(30) | block(60))
    several = rule_of([path], changed=(255, 7))
    assert meaning(several.read(path)) == (block(0) | block(90), set())


def test_the_levels_of_cdnet_are_seen(tmp_path):
    paths = write(tmp_path / "m", levels(v255=0, v170=30), levels(v85=60, v50=90), levels())
    rule = rule_of(paths)
    assert "255 = changed, 85 and 170 = not scored" in rule.says and "guessed" in rule.says
    assert [meaning(rule.read(path)) for path in paths] == [
        (block(0), block(30)), (set(), block(60)), (set(), set())
    ]  # fmt: skip


def test_two_levels_with_a_void_band_are_seen(tmp_path):
    paths = write(tmp_path / "m", levels(v255=0, v170=30))
    assert meaning(rule_of(paths).read(paths[0])) == (block(0), block(30))


def test_class_numbers_with_255_around_them_are_seen(tmp_path):
    paths = write(tmp_path / "m", levels(v1=0, v15=30, v255=60), levels(v255=0), levels(v7=5))
    rule = rule_of(paths)
    assert rule.says == ("1 to 254 = changed, 255 = not scored (guessed: class numbers, as in VOC)")
    assert [meaning(rule.read(path)) for path in paths] == [
        (block(0) | block(30), block(60)), (set(), block(0)), (block(5), set())
    ]  # fmt: skip


def test_0_1_and_0_255_masks_in_one_set_are_no_class_numbers(tmp_path):
    paths = write(tmp_path / "m", levels(v1=0), levels(v255=30))
    rule = rule_of(paths)
    assert rule.says.startswith("white = changed (guessed")
    assert [meaning(rule.read(path)) for path in paths] == [(block(0), set()), (block(30), set())]


def test_stray_pixels_beside_0_and_255_count_as_the_nearer_one(tmp_path):
    drawn = levels(v255=10)
    drawn[9, 10:40] = 60
    drawn[30, 10:40] = np.arange(128, 158)
    empty = levels()
    empty[0, :3] = (1, 9, 3)
    paths = write(tmp_path / "m", drawn, empty)
    rule = rule_of(paths)
    first, second = map(rule.read, paths)
    assert first.stray_px == 60 and meaning(first)[0] == block(10) | {30}
    assert second.stray_px == 3 and not second.changed.any()
    black = rule_of(paths, polarity="black").read(paths[0])
    assert black.stray_px == 60 and not black.changed[10:31, 10:40].any()


def test_a_mask_that_was_made_smaller_keeps_its_shape(tmp_path):
    large = cv2.resize(levels(v255=10), (WIDTH * 4, HEIGHT * 4), interpolation=cv2.INTER_NEAREST)
    small = cv2.resize(large, (WIDTH - 9, HEIGHT - 7), interpolation=cv2.INTER_AREA)
    (path,) = write(tmp_path / "m", small)
    truth = rule_of([path]).read(path)
    assert truth.stray_px > 50 and (truth.changed == (small > 127)).all()


def test_stray_pixels_among_the_levels_of_cdnet_count_as_the_nearest(tmp_path):
    mask = levels(v255=10, v170=50)
    mask[0, :4] = (250, 172, 80, 3)
    (path,) = write(tmp_path / "m", mask)
    truth = rule_of([path]).read(path)
    assert truth.stray_px == 4
    assert truth.changed[0, :4].tolist() == [True, False, False, False]
    assert truth.ignored[0, :4].tolist() == [False, True, True, False]


def test_an_area_of_a_third_level_is_no_stray_and_is_refused_with_the_way_out(tmp_path):
    paths = write(tmp_path / "m", levels(v255=10), levels(v255=10, v128=50))
    with pytest.raises(InvalidInput, match=r"1\.png: .* 3 values from 0 to 255; .*--changed LEVEL"):
        rule_of(paths).read(paths[1])


def test_ignored_levels_are_taken_out_before_the_rest_is_looked_at(tmp_path):
    (path,) = write(tmp_path / "m", levels(v90=10, v170=50))
    rule = rule_of([path], ignore=(170,))
    assert "white = changed, 170 = not scored (guessed" in rule.says
    assert meaning(rule.read(path)) == (block(10), block(50))


def test_a_threshold_says_what_grey_masks_mean(tmp_path):
    (path,) = write(tmp_path / "m", levels(v100=0, v101=30, v255=60, v200=90))
    rule = rule_of([path], mask_threshold=100, ignore=(255,))
    assert rule.says == "above 100 = changed, 255 = not scored (as told)"
    assert meaning(rule.read(path)) == (block(30) | block(90), block(60))


def test_a_colour_says_what_coloured_masks_mean(tmp_path):
    coloured = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    coloured[0:20, 10:40], coloured[30:50, 10:40] = (255, 0, 0), (0, 255, 0)
    (path,) = write(tmp_path / "m", coloured)
    with pytest.raises(InvalidInput, match=r"0\.png: should be grey.*--changed-colour RRGGBB"):
        rule_of([path])
    rule = rule_of([path], changed_colour=(255, 0, 0))
    assert rule.says == "colour ff0000 = changed (as told)"
    assert meaning(rule.read(path)) == (block(0), set())


@pytest.mark.parametrize("dtype", [bool, np.uint16])
def test_masks_of_1_and_of_16_bits_are_two_levels(tmp_path, dtype):
    wide = (levels(v255=10) > 0) * (1 if dtype is bool else 65535)
    (path,) = write(tmp_path / "m", wide.astype(dtype))
    assert meaning(rule_of([path]).read(path)) == (block(10), set())


def test_16_bit_masks_of_several_levels_are_refused_unless_all_mean_changed(tmp_path):
    wide = levels(v255=10).astype(np.uint16) * 256
    wide[50:70, 10:40] = 300
    (path,) = write(tmp_path / "m", wide)
    with pytest.raises(InvalidInput, match="levels up to 65280; say what they mean"):
        rule_of([path])
    nonzero = rule_of([path], polarity="nonzero")
    assert meaning(nonzero.read(path)) == (block(10) | block(50), set())


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"changed": (256,)}, "--changed 256: grey levels go from 0 to 255"),
        ({"changed": (1,), "ignore": (1,)}, "--changed 1: is named by --ignore, too"),
        ({"mask_threshold": 255}, "--mask-threshold 255: goes from 0 to 254"),
        ({"changed": (1,), "polarity": "white"}, "polarity white and --changed: say one"),
        ({"mask_threshold": 9, "changed_colour": (0, 0, 9)}, "--mask-threshold and --changed-colo"),
        ({"ignore": (9,), "changed_colour": (0, 0, 9)}, "a mask is of levels or of colours"),
        ({"layout": "changesim", "ignore": (9,)}, "--ignore: masks of layout changesim have their"),
    ],
)
def test_what_contradicts_itself_is_refused_before_a_file_is_read(settings, message):
    with pytest.raises(InvalidInput, match=message):
        ImportSettings(**settings)


def test_ignored_levels_become_the_ignore_mask_of_the_first_revision(db, tmp_path):
    for name in ("t0", "t1"):
        write(tmp_path / "set" / name, textured(1), textured(2))
    stray = levels(v255=10)
    stray[0, 0] = 240
    write(tmp_path / "set" / "mask", levels(v255=10, v170=50), stray)
    report = import_split(db, "set", tmp_path / "set", ImportSettings("t0t1"), lambda *_: None)
    assert "1 masks hold pixels that are not scored" in report.notes
    assert any(note.startswith("1 stray pixels in 1 masks") for note in report.notes)
    first, second = (newest_revision(db, pair.id) for pair in list_pairs(db))
    assert decode_rle(first.mask).sum() == 600 and first.ignore().sum() == 600
    assert first.ignore()[50:70, 10:40].all() and second.ignore() is None
