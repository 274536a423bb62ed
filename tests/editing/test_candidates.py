"""Candidates: what looks changed and nothing proposes."""

import cv2
import numpy as np
import pytest
from scenes import HEIGHT, WIDTH, textured

from reviewer.editing.candidates import MOST, find_candidates
from reviewer.editing.proposals import list_proposals
from reviewer.masks import decode_rle, encode_rle, intersection_over_union
from reviewer.store.layers import load_detection

THING = np.s_[80:87, 100:108]
SURE = np.ones((HEIGHT, WIDTH), np.float32)
NOTHING = np.zeros((HEIGHT, WIDTH), bool)


def pair(places=(THING,), colour=(250, 250, 60)):
    warped = textured(4)
    live = warped.copy()
    for place in places:
        live[place] = colour
    return live, warped


def mask_of(place):
    mask = NOTHING.copy()
    mask[place] = True
    return mask


def test_a_small_thing_that_only_one_picture_has_is_the_first_candidate():
    for first, second in (pair(), pair()[::-1]):
        found = find_candidates(first, second, SURE, NOTHING)
        assert intersection_over_union(found[0][1], mask_of(THING)) > 0.45
        assert 0 < found[0][0] < 1


def test_what_is_proposed_already_and_what_is_unseen_is_no_candidate():
    live, warped = pair()
    assert find_candidates(live, warped, SURE, mask_of(THING)) == []
    unseen = np.where(mask_of(np.s_[70:97, 90:118]), 0, SURE).astype(np.float32)
    assert find_candidates(live, warped, unseen, NOTHING) == []


def test_other_light_is_no_candidate():
    warped = textured(4)
    live = np.clip(warped * np.linspace(0.85, 1.1, WIDTH)[None, :, None], 0, 255).astype(np.uint8)
    assert find_candidates(live, warped, SURE, NOTHING) == []


def test_a_place_where_the_alignment_is_unsure_comes_later():
    other = np.s_[20:27, 30:38]
    live, warped = pair((THING, other))
    sure = np.where(mask_of(np.s_[70:97, 90:118]), 0.4, SURE).astype(np.float32)
    strengths = find_candidates(live, warped, sure, NOTHING)
    assert intersection_over_union(strengths[0][1], mask_of(other)) > 0.6
    assert strengths[0][0] > strengths[1][0]


def test_there_are_at_most_five():
    places = [np.s_[20 * k + 5 : 20 * k + 11, x : x + 6] for k in range(5) for x in (30, 90, 130)]
    assert len(find_candidates(*pair(places), SURE, NOTHING)) == MOST == 5


def test_a_large_picture_is_looked_at_scaled_down_and_its_masks_fit_it():
    live, warped = pair()
    size = (WIDTH * 24, HEIGHT * 24)
    large = [cv2.resize(each, size, interpolation=cv2.INTER_NEAREST) for each in (live, warped)]
    shape = size[::-1]
    found = find_candidates(*large, np.ones(shape, np.float32), np.zeros(shape, bool))
    true = np.zeros(shape, bool)
    true[80 * 24 : 87 * 24, 100 * 24 : 108 * 24] = True
    assert found[0][1].shape == shape
    assert max(intersection_over_union(mask, true) for _, mask in found) > 0.3


@pytest.fixture
def missed(db, run, tiny_split):
    """A pair whose run says nothing of what has changed: no detection, no region, no object."""
    empty = encode_rle(NOTHING)

    def forget(connection):
        for table in ("regions", "objects"):
            connection.execute(f"DELETE FROM {table} WHERE pair_id = ?", [tiny_split[0].id])
        for table in ("detections", "predictions"):
            connection.execute(
                f"UPDATE {table} SET rle = ?, area = 0, box_width = 0, box_height = 0"
                " WHERE pair_id = ?",
                [empty.counts, tiny_split[0].id],
            )

    db.write(forget)
    return tiny_split[0]


def test_the_source_candidate_asks_about_what_no_other_source_covers(db, run, missed, tiny_split):
    found = list_proposals(db, missed, run, ["candidate"])
    true = np.zeros((HEIGHT, WIDTH), bool)
    true[40:60, 50:75] = True
    assert any((decode_rle(proposal.mask) & true).any() for proposal in found)
    assert found[0].key == f"{run.id}/candidate/0" and found[0].score > 0
    # On the other pair the detector has it.
    there = decode_rle(load_detection(db, run.id, tiny_split[1].id).mask)
    assert there.any()
    for proposal in list_proposals(db, tiny_split[1], run, ["candidate"]):
        assert not (decode_rle(proposal.mask) & there).any()


def test_candidates_stand_behind_what_a_run_is_sure_of(db, run, tiny_split):
    listed = list_proposals(db, tiny_split[0], run, ["region", "candidate"])
    assert listed[0].source == "region"
