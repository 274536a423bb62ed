"""What a person has looked at from close by."""

import pytest

from reviewer.errors import InvalidInput
from reviewer.store.reviews import annotator_id, set_review_state
from reviewer.store.sweeps import grid_of, note_swept, sweep_of_pair


def test_tiles_are_about_square_and_more_in_a_large_picture():
    assert grid_of(480, 640) == (4, 3)
    assert grid_of(3000, 4000) == (8, 6)
    assert grid_of(1080, 1920) == (6, 3)
    assert grid_of(100, 4000) == (8, 1)


def test_a_tile_counts_once_for_the_person_who_swept_it(db, tiny_split):
    ada, bob = annotator_id(db, "Ada"), annotator_id(db, "Bob")
    first, second = tiny_split[:2]
    for tile in (3, 0, 3):
        note_swept(db, first, ada, tile)
    assert sweep_of_pair(db, first, ada).swept == (0, 3)
    assert sweep_of_pair(db, first, bob).swept == sweep_of_pair(db, second, ada).swept == ()


def test_a_tile_that_the_picture_does_not_have_is_refused(db, tiny_split):
    with pytest.raises(InvalidInput, match=r"cs1/0000: tile 12: it has 12 tiles"):
        note_swept(db, tiny_split[0], annotator_id(db, "Ada"), 12)


def test_effort_tells_the_share_that_was_swept(db, tiny_split):
    ada, bob = annotator_id(db, "Ada"), annotator_id(db, "Bob")
    for tile in range(3):
        note_swept(db, tiny_split[0], ada, tile)
    set_review_state(db, tiny_split[0].id, bob, "submitted", active_seconds=7)
    query = "SELECT annotator, active_seconds, swept FROM pair_effort ORDER BY annotator"
    assert [tuple(row) for row in db.read().execute(query)] == [("Ada", 0, 0.25), ("Bob", 7, 0)]
    (row,) = db.read().execute("SELECT pair, annotator, swept, tiles FROM pair_sweeps")
    assert tuple(row) == ("0000", "Ada", 3, 12)
