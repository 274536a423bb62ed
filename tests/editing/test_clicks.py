"""Clicks on a pair, with a segmenter that counts."""

import time

import numpy as np
import pytest

from reviewer.dataset.files import read_rgb
from reviewer.editing.clicks import ClickRequest, crop_window, keep_best
from reviewer.editing.pictures import live_point, load_pictures
from reviewer.errors import NotFound
from reviewer.masks import decode_rle
from reviewer.models.interfaces import Candidate, Click, Prompt
from reviewer.pipeline.fields import load_probability, pack_confidence
from reviewer.pipeline.stored import warped_reference, warped_view
from reviewer.store.layers import load_alignment, load_detection


def ask(clicks, pair, run, picture="live", prompt=None, **more):
    prompt = prompt or Prompt((Click(60, 50),))
    request = ClickRequest(pair.id, run, picture, prompt, **more)
    return clicks.find("Ada", request).result(10)


def test_a_picture_is_embedded_for_the_first_click_only(clicks, segmenter, db, run, tiny_split):
    pair = tiny_split[0]
    for _ in range(3):
        ask(clicks, pair, run)
    assert len(segmenter.embedded) == 1 and len(segmenter.prompts) == 3
    warped, _ = warped_reference(db, run, pair)
    live = read_rgb(pair.live.path)
    assert (segmenter.embedded[0][0] == live).all() and (segmenter.embedded[0][1] == warped).all()
    ask(clicks, pair, run, "reference")
    assert (segmenter.embedded[1][0] == warped).all() and (segmenter.embedded[1][1] == live).all()


def test_without_an_alignment_the_live_image_can_still_be_clicked(clicks, segmenter, tiny_split):
    ask(clicks, tiny_split[0], None)
    assert segmenter.embedded[0][1] is None
    with pytest.raises(NotFound, match="no run aligns"):
        ask(clicks, tiny_split[0], None, "reference")


def test_a_segmenter_is_told_how_sure_the_alignment_is(clicks, segmenter, db, run, tiny_split):
    pair = tiny_split[0]
    db.write(lambda c: c.execute("UPDATE alignments SET confidence = NULL"))
    ask(clicks, pair, run)
    assert segmenter.confidences == [None]  # as with an aligner that does not say
    sure = np.tile(np.linspace(0, 1, 160, dtype=np.float32), (120, 1))
    db.write(lambda c: c.execute("UPDATE alignments SET confidence = ?", [pack_confidence(sure)]))
    pair = tiny_split[1]
    for picture in ("live", "reference"):
        ask(clicks, pair, run, picture)
    prompt = Prompt((Click(130, 100),))
    ask(clicks, pair, run, prompt=prompt, crop=True)
    live, reference, crop = segmenter.confidences[1:]
    np.testing.assert_array_equal(live, reference)
    np.testing.assert_array_equal(live, warped_view(db, run, pair)[2])
    np.testing.assert_array_equal(crop, live[24:120, 64:160])


def test_a_segmenter_is_told_what_the_detector_says(clicks, segmenter, db, run, tiny_split):
    pair, prompt = tiny_split[1], Prompt((Click(130, 100),))
    for picture in ("live", "reference"):
        ask(clicks, pair, run, picture)
    ask(clicks, pair, run, prompt=prompt, crop=True)
    live, reference, crop = segmenter.changes
    detection = load_detection(db, run.id, pair.id)
    np.testing.assert_array_equal(live, load_probability(detection))
    np.testing.assert_array_equal(reference, live)
    np.testing.assert_array_equal(crop, live[24:120, 64:160])


def test_a_detection_that_is_made_anew_is_told_again(clicks, segmenter, db, run, tiny_split):
    pair = tiny_split[1]
    ask(clicks, pair, run)
    db.write(lambda c: c.execute("UPDATE detections SET probability = NULL"))
    db.write(lambda c: c.execute("UPDATE results SET key = key || '!' WHERE stage = 'detect'"))
    ask(clicks, pair, run)
    assert len(segmenter.changes) == 2
    mask = decode_rle(load_detection(db, run.id, pair.id).mask)
    np.testing.assert_array_equal(segmenter.changes[1], mask.astype(np.float32))


def test_without_a_run_no_detector_says_anything(clicks, segmenter, tiny_split):
    ask(clicks, tiny_split[0], None)
    assert segmenter.changes == [None]


def test_both_pictures_of_the_next_pairs_are_embedded_ahead(clicks, segmenter, run, tiny_split):
    clicks.embed_ahead("Ada", [pair.id for pair in tiny_split[:2]], run)
    for pair in tiny_split[:2]:
        for picture in ("live", "reference"):
            while len(segmenter.embedded) < 4:
                pass
            ask(clicks, pair, run, picture)
    assert len(segmenter.embedded) == 4


def test_a_picture_that_cannot_be_had_does_not_keep_the_next_pairs_back(
    db, clicks, segmenter, run, tiny_split
):
    first, second = tiny_split[:2]
    db.write(lambda c: c.execute("DELETE FROM alignments WHERE pair_id = ?", [first.id]))
    clicks.embed_ahead("Ada", [first.id, second.id], run)
    for _ in range(500):
        if len(segmenter.embedded) == 3:
            break
        time.sleep(0.01)
    assert len(segmenter.embedded) == 3
    ask(clicks, second, run, "live")
    ask(clicks, second, run, "reference")
    assert len(segmenter.embedded) == 3


def test_a_crop_is_segmented_by_itself_and_pasted_back(clicks, segmenter, run, tiny_split):
    answer = ask(clicks, tiny_split[0], run, prompt=Prompt((Click(130, 100),)), crop=True)
    assert segmenter.embedded[0][0].shape == (96, 96, 3)
    assert segmenter.prompts[0].clicks[0] == Click(130 - 64, 100 - 24)
    mask = answer.candidates[0].mask
    assert mask.shape == (120, 160) and mask[100, 130] and not mask[:90].any()


def test_a_crop_holds_everything_the_prompt_names():
    held = np.zeros((480, 640), bool)
    held[200:210, 300:400] = True
    rows, columns = crop_window(Prompt((Click(290, 250),), None, held), held.shape)
    assert rows.start <= 200 and rows.stop > 250 and columns.start <= 290 and columns.stop >= 400
    assert rows.stop - rows.start == columns.stop - columns.start


def test_the_best_so_far_stays_first_while_it_obeys_the_clicks():
    held = np.zeros((10, 10), bool)
    held[2:6, 2:6] = True
    best, worse = Candidate(held, 0.8), Candidate(~held, 0.3)
    assert keep_best(best, [worse], [Click(3, 3)]) == [best, worse]
    assert keep_best(best, [worse], [Click(3, 3), Click(4, 4, False)]) == [worse]
    assert keep_best(best, [Candidate(held, 0.9)], [Click(3, 3)])[0].score == 0.9
    assert keep_best(None, [worse], []) == [worse]


def test_a_point_of_the_reference_is_found_in_the_live_image(db, run, tiny_split):
    pair = tiny_split[0]
    alignment = load_alignment(db, run.id, pair.id)
    assert alignment is not None
    x, y = live_point(db, pair, run, 80.5, 60.5)
    assert abs(x - 80.5) < 3 and abs(y - 60.5) < 3
    with pytest.raises(NotFound, match="no run aligns"):
        live_point(db, pair, None, 1, 1)


def test_a_large_picture_is_looked_at_in_a_window_that_near_clicks_share(
    clicks, segmenter, run, tiny_split, monkeypatch
):
    monkeypatch.setattr("reviewer.editing.clicks.LARGEST_WHOLE_PX", 100)
    monkeypatch.setattr("reviewer.editing.clicks.LARGE_CROP_PX", 60)
    segmenter.keeps_embeddings = False
    pair = tiny_split[0]
    clicks.embed_ahead("Ada", [pair.id], run)
    first = ask(clicks, pair, run, prompt=Prompt((Click(62, 50),)))
    second = ask(clicks, pair, run, prompt=Prompt((Click(64, 51),)))
    assert [image.shape for image, _ in segmenter.embedded] == [(60, 60, 3)]
    live = read_rgb(pair.live.path)
    assert (segmenter.embedded[0][0] == live[20:80, 20:80]).all()
    assert first.candidates[0].mask.shape == (120, 160)
    assert first.candidates[0].mask[50, 62] and second.candidates[0].mask[51, 64]
    ask(clicks, pair, run, prompt=Prompt((Click(150, 110),)))
    assert (segmenter.embedded[1][0] == live[60:120, 100:160]).all()


def test_a_costly_embedding_of_a_large_picture_is_made_once_of_the_whole(
    clicks, segmenter, run, tiny_split, monkeypatch
):
    monkeypatch.setattr("reviewer.editing.clicks.LARGEST_WHOLE_PX", 100)
    for x in (20, 150):
        ask(clicks, tiny_split[0], run, prompt=Prompt((Click(x, 50),)))
    assert [image.shape for image, _ in segmenter.embedded] == [(120, 160, 3)]


def test_a_part_of_the_pictures_is_that_part_of_the_whole(db, run, tiny_split):
    part = (slice(30, 90), slice(41, 101))
    for picture in ("live", "reference"):
        whole = load_pictures(db, tiny_split[0], run, picture)
        some = load_pictures(db, tiny_split[0], run, picture, part)
        for name in ("image", "other", "confidence", "change"):
            np.testing.assert_array_equal(getattr(some, name), getattr(whole, name)[part])
