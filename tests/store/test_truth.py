"""What counts as ground truth is what somebody looked at and stood for, and no later revision."""

import numpy as np
import pytest
from people import draw

from reviewer.editing.commit import MaskEdit, change_state
from reviewer.errors import InvalidInput, NotFound
from reviewer.export.selection import Selection, select_labelled
from reviewer.masks import decode_rle, encode_rle
from reviewer.store.pairs import list_pairs
from reviewer.store.queue import list_queue
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import NewRevision, add_revision, newest_revision
from reviewer.store.truth import (
    check_standings,
    count_standings,
    count_unfinished,
    drawn_since,
    list_statements,
    standing_of_pair,
    truth_of_pair,
)


def block(width):
    mask = np.zeros((120, 160), bool)
    mask[:10, :width] = True
    return encode_rle(mask)


@pytest.fixture
def pair(db, tiny_split):
    """A pair with an imported mask, revision 1."""
    return tiny_split[0]


def standing(db, pair):
    return standing_of_pair(db, pair.id)


def exported(db, **selection):
    return {i.pair.id: i for i in select_labelled(db, Selection(**selection))[0]}


def test_an_approval_speaks_of_its_revision_and_of_no_later_one(db, pair):
    draw(db, pair.id, "Ada", MaskEdit(block(10), 1), "approved")
    draw(db, pair.id, "Bob", MaskEdit(block(50), 2), "in_progress")
    assert newest_revision(db, pair.id).number == 3
    assert standing(db, pair) == (2, "approved")
    assert truth_of_pair(db, pair.id).mask == block(10)
    for selection in ({}, {"states": ("approved",)}):
        item = exported(db, **selection)[pair.id]
        assert item.mask == block(10) and item.origin == {"revision": 2, "annotator": "Ada"}
    assert [s.annotator for s in list_statements(db, pair.id)] == ["Ada", "Bob"]
    assert drawn_since(db, pair.id, 2) == ["Bob"]


def test_what_is_submitted_later_waits_behind_what_is_approved(db, pair):
    draw(db, pair.id, "Ada", MaskEdit(block(10), 1), "approved")
    draw(db, pair.id, "Bob", MaskEdit(block(50), 2), "submitted")
    assert standing(db, pair) == (2, "approved")
    assert exported(db, states=("submitted",))[pair.id].mask == block(50)
    change_state(db, pair.id, annotator_id(db, "Ada"), "approved", 3)
    assert standing(db, pair) == (3, "approved") and drawn_since(db, pair.id, 3) == []


def test_an_unfinished_scribble_counts_for_nothing(db, pair, tiny_split):
    imported = truth_of_pair(db, pair.id)
    assert standing(db, pair) == (1, "imported")
    draw(db, pair.id, "Ada", MaskEdit(block(10), 1), "in_progress")
    assert truth_of_pair(db, pair.id) == imported
    assert exported(db)[pair.id].mask == imported.mask
    assert exported(db, states=("in_progress",))[pair.id].mask == block(10)


def test_who_takes_a_submission_back_takes_the_mask_out(db, pair):
    draw(db, pair.id, "Ada", MaskEdit(block(10), 1), "submitted")
    assert standing(db, pair) == (2, "submitted")
    change_state(db, pair.id, annotator_id(db, "Ada"), "in_progress", None)
    assert standing(db, pair) == (1, "imported")


def test_an_import_does_not_push_out_what_people_stand_for(db, pair):
    draw(db, pair.id, "Ada", MaskEdit(block(10), 1), "submitted")
    add_revision(db, NewRevision(pair.id, block(70), parent=2, annotator_id=None, source="import"))
    assert standing(db, pair) == (2, "submitted") and drawn_since(db, pair.id, 2) == ["import"]


def test_confirmed_empty_is_a_truth_of_its_own(db, pair):
    change_state(db, pair.id, annotator_id(db, "Ada"), "confirmed_empty", 1)
    assert standing(db, pair) == (2, "confirmed_empty")
    assert not decode_rle(truth_of_pair(db, pair.id).mask).any()


def test_pairs_are_counted_by_what_they_stand_on(db, tiny_split):
    assert count_standings(db) == {
        "approved": 0, "submitted": 0, "confirmed_empty": 0, "imported": 3
    }  # fmt: skip
    draw(db, tiny_split[0].id, "Ada", MaskEdit(block(10), 1), "approved")
    draw(db, tiny_split[1].id, "Ada", MaskEdit(block(10), 1), "in_progress")
    counted = count_standings(db)
    assert (counted["approved"], counted["imported"], count_unfinished(db)) == (1, 2, 0)


def test_a_standing_that_is_none_is_refused():
    assert check_standings(["imported", "approved"], "--state") == ("approved", "imported")
    with pytest.raises(InvalidInput, match="--state todo: ground truth is never that; there are"):
        check_standings(["todo"], "--state")


def test_a_consensus_is_of_people_who_have_finished(db, pair):
    draw(db, pair.id, "Ada", MaskEdit(block(40), 1))
    draw(db, pair.id, "Bob", MaskEdit(block(40), 2))
    draw(db, pair.id, "Cy", MaskEdit(block(90), 3), "in_progress")
    agreed = exported(db, consensus=2)[pair.id]
    assert agreed.origin["annotators"] == ["Ada", "Bob"] and agreed.mask.area == 400


def test_who_approves_another_s_mask_does_not_stand_for_an_earlier_scribble(db, pair):
    draw(db, pair.id, "Ada", MaskEdit(block(90), 1), "in_progress")
    draw(db, pair.id, "Bob", MaskEdit(block(40), 2), "submitted")
    change_state(db, pair.id, annotator_id(db, "Ada"), "approved", 3)
    with pytest.raises(NotFound, match="of 2 people"):
        exported(db, consensus=2)
    assert exported(db, consensus=1)[pair.id].origin["annotators"] == ["Bob"]


def test_the_team_s_state_of_a_pair_is_told_to_everybody(db, tiny_split):
    first, second, third = tiny_split
    draw(db, first.id, "Ada", MaskEdit(block(10), 1), "submitted")
    draw(db, second.id, "Ada", MaskEdit(block(10), 1), "in_progress")
    bob = annotator_id(db, "Bob")

    def team():
        return {entry.id: entry.team for entry in list_queue(db, bob)[0]}

    def waiting(state):
        return [entry.id for entry in list_queue(db, bob, team=state)[0]]

    assert team() == {first.id: "waiting", second.id: "in_progress", third.id: "todo"}
    assert waiting("waiting") == [first.id]
    change_state(db, first.id, bob, "approved", 2)
    assert team()[first.id] == "approved" and waiting("waiting") == []
    draw(db, first.id, "Cy", MaskEdit(block(20), 2), "in_progress")
    assert team()[first.id] == "changed" and waiting("changed") == [first.id]
    assert len(list_pairs(db)) == 3
