"""The queue: filters, orders, pages."""

import pytest
from scenes import write_split

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.editing.skipping import skip_pair
from reviewer.errors import InvalidInput
from reviewer.masks import empty_rle
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.pairs import pair_ids
from reviewer.store.queue import list_progress, list_queue
from reviewer.store.reviews import annotator_id, set_review_state
from reviewer.store.revisions import NewRevision, add_revision


def names(entries):
    return [entry.name for entry in entries]


def test_pages_follow_one_another(db, tiny_split):
    ada = annotator_id(db, "Ada")
    first, total = list_queue(db, ada, limit=2)
    second, _ = list_queue(db, ada, limit=2, offset=2)
    assert (names(first), names(second), total) == (["0000", "0001"], ["0002"], 3)


def test_a_state_filters_by_the_persons_own_state(db, tiny_split):
    ada, bob = annotator_id(db, "Ada"), annotator_id(db, "Bob")
    set_review_state(db, tiny_split[1].id, ada, "submitted")
    assert names(list_queue(db, ada, state="submitted")[0]) == ["0001"]
    assert names(list_queue(db, bob, state="submitted")[0]) == []
    assert names(list_queue(db, bob, order="unreviewed")[0]) == ["0000", "0002", "0001"]


def test_doi_and_change_size_come_from_the_run(db, tiny_split):
    run = prepare_run(
        db, None, PipelineSettings(segmenter="oversegment", detector="difference", aligner="dis")
    )
    run_pipeline(db, run, pair_ids(db))
    entries, _ = list_queue(db, annotator_id(db, "Ada"), run_id=run.id, order="size")
    sizes = [entry.change_px for entry in entries]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > 100 and entries[-1].name == "0002"


def test_an_unknown_order_is_refused(db):
    with pytest.raises(InvalidInput, match="'colour' is not one of"):
        list_queue(db, 1, order="colour")


def test_progress_counts_what_a_person_finished(db, tiny_split):
    ada = annotator_id(db, "Ada")
    set_review_state(db, tiny_split[0].id, ada, "approved")
    set_review_state(db, tiny_split[1].id, ada, "in_progress")
    (progress,) = list_progress(db, ada)
    assert (progress.split, progress.pairs, progress.finished) == ("cs1", 3, 1)


def test_effort_adds_drawing_and_looking(db, tiny_split):
    ada, pair = annotator_id(db, "Ada"), tiny_split[0]
    mask = empty_rle(120, 160)
    add_revision(
        db,
        NewRevision(pair.id, mask, parent=1, annotator_id=ada, source="edit", active_seconds=12.5),
    )
    for state in ("submitted", "in_progress"):
        set_review_state(db, pair.id, ada, state, active_seconds=2.0)
    (row,) = db.read().execute("SELECT * FROM pair_effort WHERE annotator = 'Ada'")
    assert (row["pair_id"], row["active_seconds"]) == (pair.id, 16.5)


def test_what_the_team_has_to_do_leaves_skipped_pairs_out(db, tiny_split):
    ada = annotator_id(db, "Ada")
    skip_pair(db, tiny_split[1].id, ada, None, "badly aligned")
    found, total = list_queue(db, ada, team="todo")
    assert (names(found), total) == (["0000", "0002"], 2)
    assert names(list_queue(db, ada)[0]) == ["0000", "0001", "0002"]


def test_past_the_last_page_the_total_is_still_that_of_the_pairs_asked_for(db, tiny_split):
    ada = annotator_id(db, "Ada")
    assert list_queue(db, ada, pair_ids=[tiny_split[0].id], offset=5) == ([], 1)


def test_words_find_pairs_by_name_number_and_objects(db, tiny_split, make_named_run):
    run, ada = make_named_run(db, "red pen"), annotator_id(db, "Ada")

    def found(search, run_id=None):
        return names(list_queue(db, ada, search=search, run_id=run_id)[0])

    assert found("CS1 000") == ["0000", "0001", "0002"]
    assert found("cs1/0001") == found("cs1/1") == found("0001") == ["0001"]
    assert found("cs1/3") == found("pen") == []
    assert found("pen cs1/1", run.id) == ["0001"]
    assert found("wallet", run.id) == []


def test_the_pair_that_is_named_exactly_comes_first(db, split_folder):
    for name, pairs in (("as", 2), ("s", 2)):
        folder = write_split(split_folder.parent / f"more {name}", pairs)
        import_split(db, name, folder, ImportSettings(), lambda *_: None)
    entries, _ = list_queue(db, annotator_id(db, "Ada"), search="s/1")
    assert [entry.split for entry in entries] == ["s"]
    entries, _ = list_queue(db, annotator_id(db, "Ada"), search="s/0001")
    assert [entry.split for entry in entries] == ["s", "as"]
