"""Ground truth is append-only, and a stale save changes nothing."""

import sqlite3

import numpy as np
import pytest

from reviewer.errors import Conflict, InvalidInput, Locked, NotFound
from reviewer.masks import decode_rle, empty_rle, encode_rle
from reviewer.store.reviews import annotator_id, review_state, set_review_state
from reviewer.store.revisions import NewRevision, add_revision, list_revisions, newest_revision


def some_mask(pair, rows=5):
    mask = np.zeros((pair.live.height, pair.live.width), bool)
    mask[:rows] = True
    return encode_rle(mask)


def save(db, pair, parent, *, who="Ada", rle=None, **more):
    person = annotator_id(db, who)
    new = NewRevision(
        pair.id, rle or some_mask(pair), parent, annotator_id=person, source="edit", **more
    )
    return add_revision(db, new)


def test_a_save_on_the_newest_revision_is_appended(db, tiny_split):
    pair = tiny_split[0]
    assert save(db, pair, 1, active_seconds=2.5, tool_log=[{"tool": "brush"}]) == 2
    newest = newest_revision(db, pair.id)
    assert (newest.number, newest.annotator, newest.active_seconds) == (2, "Ada", 2.5)
    assert decode_rle(newest.mask).sum() == 5 * pair.live.width
    assert [r.number for r in list_revisions(db, pair.id)] == [1, 2]


def test_a_stale_save_is_refused_and_nothing_is_lost(db, tiny_split):
    pair = tiny_split[0]
    save(db, pair, 1)
    with pytest.raises(Conflict, match="made from revision 1, but the newest is 2"):
        save(db, pair, 1, who="Bob", rle=some_mask(pair, 9))
    assert newest_revision(db, pair.id).annotator == "Ada"


def test_a_mask_of_another_size_is_refused(db, tiny_split):
    with pytest.raises(InvalidInput, match="pair cs1/0000: the mask is 4x4, but the live image"):
        save(db, tiny_split[0], 1, rle=empty_rle(4, 4))


def test_a_pair_that_does_not_exist_is_named(db, tiny_split):
    with pytest.raises(NotFound, match="pair 999"):
        add_revision(
            db,
            NewRevision(999, some_mask(tiny_split[0]), parent=0, annotator_id=None, source="api"),
        )


@pytest.mark.parametrize(
    "statement", ["UPDATE mask_revisions SET rle = ''", "DELETE FROM mask_revisions"]
)
def test_history_cannot_be_changed(db, tiny_split, statement):
    with pytest.raises(sqlite3.IntegrityError, match="append-only"):
        db.write(lambda c: c.execute(statement))


@pytest.mark.parametrize("state", ["submitted", "approved", "confirmed_empty"])
def test_a_finished_pair_is_locked_for_the_one_who_finished_it(db, tiny_split, state):
    pair = tiny_split[0]
    ada = annotator_id(db, "Ada")
    set_review_state(db, pair.id, ada, state)
    parent = newest_revision(db, pair.id).number
    with pytest.raises(Locked, match=f"is {state} and locked"):
        save(db, pair, parent)
    assert save(db, pair, parent, who="Bob", rle=some_mask(pair, 7)) == parent + 1
    set_review_state(db, pair.id, ada, "in_progress")
    assert save(db, pair, parent + 1) == parent + 2


def test_confirming_empty_writes_an_all_zero_mask(db, tiny_split):
    pair = tiny_split[0]
    set_review_state(db, pair.id, annotator_id(db, "Ada"), "confirmed_empty")
    newest = newest_revision(db, pair.id)
    assert (newest.number, newest.mask.area, newest.source) == (2, 0, "confirmed_empty")


def test_confirming_a_pair_that_is_empty_already_adds_no_revision(db, tiny_split):
    pair = tiny_split[2]
    set_review_state(db, pair.id, annotator_id(db, "Ada"), "confirmed_empty")
    assert newest_revision(db, pair.id).number == 1


def test_states_are_each_persons_own(db, tiny_split):
    ada, bob = annotator_id(db, "Ada"), annotator_id(db, "Bob")
    set_review_state(db, tiny_split[0].id, ada, "submitted")
    assert review_state(db, tiny_split[0].id, ada) == "submitted"
    assert review_state(db, tiny_split[0].id, bob) == "todo"
    set_review_state(db, tiny_split[0].id, ada, "todo")
    assert review_state(db, tiny_split[0].id, ada) == "todo"


def test_an_unknown_state_is_refused(db, tiny_split):
    with pytest.raises(InvalidInput, match="'done' is not one of"):
        set_review_state(db, tiny_split[0].id, annotator_id(db, "Ada"), "done")


@pytest.mark.parametrize("name", ["", "   ", "x" * 81])
def test_a_name_must_be_a_name(db, name):
    with pytest.raises(InvalidInput, match="1 to 80 characters"):
        annotator_id(db, name)
