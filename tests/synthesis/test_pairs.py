"""A synthetic pair: the mask is where the pictures differ, and the seed decides all of it."""

import json

import cv2
import numpy as np
import pytest
from scenes import textured

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.errors import Conflict, InvalidInput
from reviewer.masks import dilate
from reviewer.store.pairs import list_pairs
from reviewer.store.revisions import newest_revision
from reviewer.synthesis.bank import Bank, Cutout
from reviewer.synthesis.folder import contact_sheet, write_folder
from reviewer.synthesis.jitter import displacement, moved_mask
from reviewer.synthesis.pairs import crop, make_pair, numbered_pair, pair_rng
from reviewer.synthesis.settings import SynthesisSettings
from reviewer.synthesis.shelf import Shelf

STILL = SynthesisSettings(
    unchanged=0,
    feather_px=(0, 0),
    colour_match=(0, 0),
    shadow=0,
    homography_px=0,
    flow_px=0,
    exposure=1,
    colour_cast=1,
    shade=0,
    noise=0,
    blur_px=0,
    size_px=(12, 40),
)


def only(**changes):
    """The settings that change nothing but the objects, with these of the usual ones."""
    values = {f: getattr(STILL, f) for f in STILL.record()}
    return SynthesisSettings(**{**values, **changes})


@pytest.fixture
def bank():
    """A bright disc and a bright bar."""
    disc = np.zeros((40, 40), np.uint8)
    cv2.circle(disc, (20, 20), 19, 255, -1)
    bar = np.full((12, 48), 255, np.uint8)
    cutouts = [
        Cutout(np.full((*alpha.shape, 3), (250, 250, 10), np.uint8), alpha, "thing")
        for alpha in (disc, bar)
    ]
    return Bank(tuple(cutouts), {}, "hash")


def differs(pair, by=6):
    return (np.abs(pair.reference.astype(int) - pair.live) > by).any(axis=2)


@pytest.mark.parametrize("removal", [0.0, 1.0])
def test_without_jitter_the_pictures_differ_exactly_under_the_mask(bank, removal):
    for number in range(20):
        background = textured(number)
        pair = make_pair(background, bank, only(removal=removal), pair_rng(0, 0, number))
        rim = dilate(pair.mask, size_px=5)
        assert pair.mask.any() and differs(pair)[pair.mask].mean() > 0.98
        assert not differs(pair)[~rim].any()
        untouched = pair.live if removal else pair.reference
        np.testing.assert_array_equal(untouched, background)


def test_objects_that_both_pictures_have_are_no_change(bank):
    pair = make_pair(textured(1), bank, only(changes=(0, 0), unchanged=3), pair_rng(0, 0, 5))
    assert not pair.mask.any()
    np.testing.assert_array_equal(pair.reference, pair.live)
    assert (pair.live != textured(1)).any()


def test_a_shadow_is_seen_but_not_marked(bank):
    settings = only(shadow=1.0, size_px=(30, 50))
    shaded = [make_pair(textured(2), bank, settings, pair_rng(0, 0, k)) for k in range(8)]
    beside = [(differs(pair, 2) & ~dilate(pair.mask, size_px=5)).sum() for pair in shaded]
    assert min(beside) > 50


@pytest.mark.parametrize(
    "jitter",
    [
        {"exposure": 1.5},
        {"colour_cast": 1.3},
        {"shade": 0.5},
        {"noise": 20.0},
        {"blur_px": 8.0},
        {"homography_px": 6.0},
        {"flow_px": 6.0},
    ],
)
def test_each_jitter_changes_the_pictures_and_not_the_mask(bank, jitter):
    changed = 0
    for number in range(6):
        still = make_pair(textured(3), bank, only(removal=0), pair_rng(1, 0, number))
        pair = make_pair(textured(3), bank, only(removal=0, **jitter), pair_rng(1, 0, number))
        np.testing.assert_array_equal(pair.mask, still.mask)
        changed += differs(pair)[~dilate(pair.mask, size_px=9)].mean() > 0.02
    assert changed >= 3


def test_the_mask_of_a_removed_object_moves_with_the_reference(bank):
    settings = only(removal=1.0, homography_px=8.0, changes=(1, 1))
    for number in range(8):
        pair = make_pair(
            np.full((120, 160, 3), 60, np.uint8), bank, settings, pair_rng(2, 0, number)
        )
        found = pair.reference[..., 0] > 150
        assert (found & pair.mask).sum() > 0.75 * (found | pair.mask).sum()


def test_masks_stay_masks_under_any_flow():
    mask = np.zeros((64, 96), bool)
    mask[20:30, 40:60] = True
    flow = displacement(64, 96, SynthesisSettings(), np.random.default_rng(0))
    assert flow.shape == (64, 96, 2) and moved_mask(mask, flow).dtype == np.bool_
    assert displacement(64, 96, STILL, np.random.default_rng(0)) is None


def test_seed_stream_and_number_decide_a_pair(bank):
    settings = SynthesisSettings()

    def made(seed, stream, number):
        pair = numbered_pair(
            [textured(0), textured(1)], bank, settings, seed=seed, stream=stream, number=number
        )
        return pair.live.tobytes() + pair.mask.tobytes()

    first = made(0, 0, 7)
    assert first == made(0, 0, 7)
    assert len({first, made(1, 0, 7), made(0, 1, 7), made(0, 0, 8)}) == 4


def test_objects_keep_to_their_sizes_and_lie_inside(bank):
    sizes = []
    for number in range(60):
        settings = only(changes=(1, 1), rotation_degrees=0, removal=0, size_px=(10, 30))
        pair = make_pair(textured(0), bank, settings, pair_rng(3, 0, number))
        rows, columns = np.nonzero(pair.mask)
        sizes.append(max(np.ptp(rows), np.ptp(columns)) + 1)
    assert min(sizes) >= 9 and max(sizes) <= 31 and np.ptp(sizes) > 12


def test_objects_lie_between_the_rows_of_the_whole_image(bank):
    settings = only(rows=(0.75, 1.0), changes=(2, 2), size_px=(8, 20))
    middles = []
    for side in (None, 64):
        for number in range(12):
            pair = numbered_pair(
                [textured(0)], bank, settings, seed=0, stream=0, number=number, side=side
            )
            rows = np.nonzero(pair.mask)[0]
            if side is None:
                middles.append(rows.min() > 0.75 * 120 - 14)
            elif len(rows):
                middles.append(rows.max() > 20)
    assert all(middles) and 12 < len(middles) < 24


def test_a_crop_is_a_square_as_it_was():
    image = textured(0)
    cut, top = crop(image, 64, np.random.default_rng(0))
    assert (image[top] == cut[0, 0]).all(axis=1).any()
    windows = np.lib.stride_tricks.sliding_window_view(image, (64, 64, 3))[:, :, 0]
    assert cut.shape == (64, 64, 3) and (windows == cut).all(axis=(2, 3, 4)).any()
    with pytest.raises(
        InvalidInput, match="crop of 130 pixels: the reference image is only 160x120"
    ):
        crop(image, 130, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"changes": (3, 1)}, "changes: need 0 <= low <= high"),
        ({"shadow": 1.2}, r"shadow: must lie in \[0, 1\]"),
        ({"exposure": 0.5}, "exposure: a factor from 1 to 4"),
        ({"noise": -1.0}, "noise: must be >= 0"),
        ({"rows": (0.5, 0.5)}, "rows: need 0 <= top < bottom <= 1"),
        ({"size_px": (1.0, 9.0)}, "size_px: objects have 2 pixels"),
    ],
)
def test_settings_out_of_range_are_refused(values, message):
    with pytest.raises(InvalidInput, match=message):
        SynthesisSettings(**values)


def test_a_folder_of_pairs_is_what_the_importer_reads(db, bank, tmp_path):
    target = tmp_path / "cs1"

    def make(number):
        return make_pair(textured(number), bank, SynthesisSettings(), pair_rng(0, 0, number))

    write_folder(target, 3, make, {"seed": 0}, lambda *_: None)
    assert json.loads((target / "synthesis.json").read_text()) == {"seed": 0}
    import_split(db, "cs1", target, ImportSettings("t0t1", "white"), lambda *_: None)
    pairs = list_pairs(db)
    assert len(pairs) == 3
    assert newest_revision(db, pairs[1].id).mask.area == make(1).mask.sum()
    with pytest.raises(Conflict, match="exists already"):
        write_folder(target, 1, make, {}, lambda *_: None)


def test_a_folder_is_written_whole_or_not_at_all(bank, tmp_path):
    def make(number):
        if number == 1:
            raise InvalidInput("no")
        return make_pair(textured(0), bank, STILL, pair_rng(0, 0, 0))

    with pytest.raises(InvalidInput):
        write_folder(tmp_path / "out", 3, make, {}, lambda *_: None)
    assert list(tmp_path.iterdir()) == []


def test_a_contact_sheet_shows_two_pairs_a_row(bank):
    pairs = [make_pair(textured(k), bank, STILL, pair_rng(0, 0, k)) for k in range(3)]
    sheet = contact_sheet(pairs)
    assert sheet.shape[1] == 2 * (3 * 306 + 12) and sheet.shape[0] == 34 + 2 * (225 + 12)


def test_a_shelf_reads_once_while_there_is_room(split_folder):
    paths = sorted((split_folder / "reference").glob("*.png"))
    shelf = Shelf(paths, room_bytes=2 * 120 * 160 * 3)
    assert len(shelf) == 3 and shelf[0] is shelf[0] and shelf[1] is shelf[1]
    assert shelf[2] is not shelf[2] and np.array_equal(shelf[2], shelf[2])
    assert len(shelf[1:]) == 2
    with pytest.raises(IndexError):
        shelf[3]
