"""A pair that cannot be compared is skipped, with all its regions rejected; and taken up again."""

import json

import pytest

from reviewer.editing.skipping import lift_skip, skip_pair
from reviewer.editing.verdicts import give_verdict
from reviewer.errors import InvalidInput, NotFound
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import refresh_terms
from reviewer.export.formats import Options, export_as
from reviewer.export.selection import Selection, select_labelled
from reviewer.export.skipped import leave_out_skipped
from reviewer.store.audit_queue import list_doubtful
from reviewer.store.audit_rows import audit_rows
from reviewer.store.finds import find_of_region, finds_version, list_finds
from reviewer.store.queue import list_progress, list_queue
from reviewer.store.regions import load_prediction, load_regions
from reviewer.store.regions_to_inspect import inspect_regions
from reviewer.store.reviews import annotator_id
from reviewer.store.runs import delete_run
from reviewer.store.scores import (
    mask_pair_keys,
    pair_counts,
    pair_scores,
    split_scores,
)
from reviewer.store.skips import count_skips, skip_of_pair
from reviewer.store.terms import load_terms


@pytest.fixture
def ada(db, run):
    return annotator_id(db, "Ada")


def verdicts(db, run, pair=1):
    return [region.verdict for region in load_regions(db, run.id, pair)]


def audits(db):
    return db.read().execute("SELECT count(*) FROM standing_audits").fetchone()[0]


def test_skipping_rejects_every_region_of_the_run_and_lifting_gives_back_what_stood(db, run, ada):
    region = load_regions(db, run.id, 1)[0].id
    give_verdict(db, region, annotator_id(db, "Bob"), "keep")
    before = load_prediction(db, run.id, 1, "audited")
    skip_pair(db, 1, ada, run, "a wall moved")
    assert set(verdicts(db, run)) == {"reject"}
    assert load_prediction(db, run.id, 1, "audited").area == 0
    found = skip_of_pair(db, 1)
    assert (found.annotator, found.reason) == ("Ada", "a wall moved")
    lift_skip(db, 1, annotator_id(db, "Bob"))
    assert verdicts(db, run) == ["keep"] and skip_of_pair(db, 1) is None
    assert load_prediction(db, run.id, 1, "audited") == before


def test_skipping_twice_is_skipping_once(db, run, ada):
    skip_pair(db, 1, ada, run, "badly aligned")
    count = audits(db)
    skip_pair(db, 1, annotator_id(db, "Bob"), run, "too dark")
    assert skip_of_pair(db, 1).annotator == "Ada" and audits(db) == count
    lift_skip(db, 1, ada)
    lift_skip(db, 1, ada)
    assert audits(db) == 0 and load_prediction(db, run.id, 1, "audited") is None


def test_a_pair_without_a_run_can_be_skipped_and_a_run_that_is_gone_is_no_hindrance(db, run, ada):
    skip_pair(db, 1, ada, None, "badly aligned")
    skip_pair(db, 2, ada, run, "badly aligned")
    delete_run(db, run.name, with_verdicts=True)
    for pair in (1, 2):
        lift_skip(db, pair, ada)
    assert count_skips(db) == 0


def test_a_skip_needs_a_pair_and_a_reason(db, run, ada):
    with pytest.raises(NotFound, match="pair 99"):
        skip_pair(db, 99, ada, None, "badly aligned")
    with pytest.raises(InvalidInput, match="skip of pair 1: the reason"):
        skip_pair(db, 1, ada, run, "  ")


def test_a_skipped_pair_is_a_state_of_its_own_in_the_queue_for_everybody(db, run, ada):
    bob = annotator_id(db, "Bob")
    skip_pair(db, 2, ada, run, "badly aligned")
    for person in (ada, bob):
        rows, total = list_queue(db, person, run_id=run.id, state="skipped")
        assert total == 1 and (rows[0].id, rows[0].state) == (2, "skipped")
        assert 2 not in {row.id for row in list_queue(db, person, state="todo")[0]}
        assert [split.finished for split in list_progress(db, person)] == [1]
    lift_skip(db, 2, bob)
    assert list_queue(db, bob, state="skipped")[1] == 0


def test_a_skipped_pair_counts_in_no_score_and_no_audit(db, run, ada):
    refresh_counts(db)
    refresh_terms(db, run)

    def counted():
        return {
            "scores": {score.pair_id for score in pair_scores(db)},
            "masks": {pair for _, pair, _ in mask_pair_keys(db)},
            "terms": {terms.pair_id for terms in load_terms(db, run.id)},
            "audit": {row.pair_id for row in audit_rows(db, run.id)},
        }

    before = counted()
    assert all(1 in pairs for pairs in before.values())
    skip_pair(db, 1, ada, run, "badly aligned")
    refresh_terms(db, run)
    after = counted()
    assert after == {name: pairs - {1} for name, pairs in before.items()}
    assert {score.pairs for score in split_scores(db)} == {len(before["scores"]) - 1}
    assert 1 not in {
        stop.pair_id
        for stop in list_doubtful(
            db, run.id, 0.9, 50, opinion="second", annotator_id=annotator_id(db, "Bob")
        )
    }


def test_the_views_of_scores_leave_skipped_pairs_out_and_the_workbench_still_has_their_counts(
    db, run, ada
):
    refresh_counts(db)
    shown = pair_counts(db, run.id, 1)
    skip_pair(db, 1, ada, None, "badly aligned")
    rows = db.read().execute("SELECT DISTINCT pair_id FROM pair_scores ORDER BY 1").fetchall()
    assert [row["pair_id"] for row in rows] == [2, 3]
    rows = db.read().execute("SELECT DISTINCT pairs FROM split_scores").fetchall()
    assert [row["pairs"] for row in rows] == [2]
    assert shown and pair_counts(db, run.id, 1) == shown


def test_a_skipped_pair_shows_nothing_found_and_asks_for_no_look_in_a_run_that_rejected_nothing(
    db, run, ada
):
    db.write(lambda sql: sql.execute("UPDATE regions SET inspect = 1"))
    before, version = list_finds(db, run.id, kept=True), finds_version(db, run.id)
    first = next(find for find in before if find.pair_id == 1)
    assert 1 in {region.pair_id for region in inspect_regions(db, run.id)}
    skip_pair(db, 1, ada, None, "badly aligned")
    assert list_finds(db, run.id, kept=True) == [find for find in before if find.pair_id != 1]
    assert finds_version(db, run.id) != version
    assert 1 not in {region.pair_id for region in inspect_regions(db, run.id)}
    with pytest.raises(NotFound, match="is not among what was found"):
        find_of_region(db, first.region_id)
    lift_skip(db, 1, ada)
    assert list_finds(db, run.id, kept=True) == before


def test_an_export_leaves_skipped_pairs_out_and_its_record_names_them(db, run, ada, tmp_path):
    skip_pair(db, 2, ada, run, "badly aligned")
    selection = leave_out_skipped(db, Selection())
    labelled, without = select_labelled(db, selection)
    assert [item.pair.id for item in labelled] == [1, 3] and without == []
    assert selection.record()["skipped"] == ["cs1/0001"]
    export_as(db, "coco", labelled, tmp_path / "coco.json", selection, Options())
    document = json.loads((tmp_path / "coco.json").read_text())
    assert document["info"]["skipped"] == ["cs1/0001"] and len(document["images"]) == 2
    everything, _ = select_labelled(db, Selection())
    assert len(everything) == 3
    with pytest.raises(NotFound, match="none of 0 pairs"):
        skip_pair(db, 1, ada, run, "badly aligned")
        skip_pair(db, 3, ada, run, "badly aligned")
        select_labelled(db, leave_out_skipped(db, Selection()))
