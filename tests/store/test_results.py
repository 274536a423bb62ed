"""What stages made is written by stage, all of it or nothing."""

import pytest

from reviewer.errors import InvalidInput
from reviewer.masks import empty_rle
from reviewer.records import ObjectInstance
from reviewer.store.layers import StoredLabel, load_labels, load_objects
from reviewer.store.results import StageResult, finished_pairs, save_results

LABEL = StoredLabel(0, "a cup", "cup", "")
OBJECT = ObjectInstance("live", 0, "cup", 0.5, empty_rle(120, 160))


@pytest.mark.parametrize(
    ("stage", "content", "told"),
    [
        ("search", [OBJECT, LABEL], "stage search: must be of ObjectInstance, not StoredLabel"),
        ("label", [OBJECT], "stage label: must be of StoredLabel, not ObjectInstance"),
        ("label", OBJECT, "stage label: must be of StoredLabel, not ObjectInstance"),
        ("align", [LABEL], "stage align: must be of StoredAlignment, not list"),
    ],
)
def test_what_a_stage_does_not_make_is_told_and_nothing_is_written(db, run, stage, content, told):
    objects, labels = load_objects(db, run.id, 1), load_labels(db, run.id, 1)
    given = [
        StageResult("label", "first", 0.0, [LABEL]),
        StageResult(stage, "other", 0.0, content),
    ]
    with pytest.raises(InvalidInput, match=told):
        save_results(db, run.id, 1, given)
    assert (load_objects(db, run.id, 1), load_labels(db, run.id, 1)) == (objects, labels)


def test_a_stage_that_found_nothing_is_done(db, run):
    save_results(db, run.id, 1, [StageResult("search", "none", 0.0, [])])
    assert load_objects(db, run.id, 1) == []
    assert 1 in finished_pairs(db, run.id, "search")
