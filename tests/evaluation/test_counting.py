"""Counts that are out of date are made for one answer, and kept when somebody asks for that."""

from reviewer.evaluation.counting import counts_of_pair, refresh_counts
from reviewer.store.scores import pair_counts


def test_a_pair_has_its_counts_before_anybody_kept_them(db, run, tiny_split):
    assert pair_counts(db, run.id, 1) == {}
    found = counts_of_pair(db, run.id, 1)
    assert set(found) == {"base", "doi"} and found["doi"].tp > 0
    assert pair_counts(db, run.id, 1) == {}, "reading wrote"
    refresh_counts(db)
    assert found == pair_counts(db, run.id, 1) == counts_of_pair(db, run.id, 1)
