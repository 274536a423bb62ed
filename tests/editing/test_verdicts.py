"""A verdict that is taken back leaves what stood before it, and can be given again."""

import sqlite3

import pytest

from reviewer.editing.verdicts import change_standing, give_verdict
from reviewer.errors import Conflict, NotFound
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import refresh_terms
from reviewer.store.audit_queue import list_doubtful
from reviewer.store.finds import finds_version, list_finds
from reviewer.store.regions import load_prediction, load_regions
from reviewer.store.reviews import annotator_id
from reviewer.store.runs import delete_run
from reviewer.store.scores import pair_counts
from reviewer.store.stages_done import pair_overview


@pytest.fixture
def region(db, run, tiny_split):
    return load_regions(db, run.id, tiny_split[0].id)[0]


def verdict_of(db, run, region):
    regions = load_regions(db, run.id, 1)
    (found,) = [known for known in regions if known.id == region.id]
    return found.verdict, found.audited_by


def test_without_any_verdict_left_the_prediction_is_the_rules_again(db, run, region):
    refresh_counts(db)
    before = pair_counts(db, run.id, 1), pair_overview(db, run.id, 1).version
    ada = annotator_id(db, "Ada")
    given = give_verdict(db, region.id, ada, "reject")
    assert load_prediction(db, run.id, 1, "audited") != load_prediction(db, run.id, 1, "doi")
    change_standing(db, given.audit, ada, stands=False)
    assert verdict_of(db, run, region) == (None, None)
    assert load_prediction(db, run.id, 1, "audited") is None
    assert pair_counts(db, run.id, 1) == before[0]
    assert pair_overview(db, run.id, 1).version != before[1]
    assert db.read().execute("SELECT count(*) FROM audits").fetchone()[0] == 1


def test_the_verdict_before_holds_again_whoever_gave_it(db, run, region):
    ada, bob = annotator_id(db, "Ada"), annotator_id(db, "Bob")
    give_verdict(db, region.id, bob, "keep")
    kept = load_prediction(db, run.id, 1, "audited")
    given = give_verdict(db, region.id, ada, "reject")
    change_standing(db, given.audit, ada, stands=False)
    assert verdict_of(db, run, region) == ("keep", "Bob")
    assert load_prediction(db, run.id, 1, "audited") == kept
    assert list_doubtful(db, run.id, 0.9, 50, opinion="second", annotator_id=ada)[0].id == region.id


def test_it_can_be_given_again_and_saying_so_twice_changes_nothing(db, run, region):
    ada = annotator_id(db, "Ada")
    given = give_verdict(db, region.id, ada, "reject", reason="glass", comment="look")
    rejected = load_prediction(db, run.id, 1, "audited")
    for stands in (False, False, True, True):
        change_standing(db, given.audit, ada, stands=stands)
    assert verdict_of(db, run, region) == ("reject", "Ada")
    assert load_prediction(db, run.id, 1, "audited") == rejected
    said = db.read().execute("SELECT withdrawn FROM withdrawals ORDER BY id").fetchall()
    assert [row["withdrawn"] for row in said] == [1, 0]


def test_a_region_whose_verdict_was_taken_back_waits_and_is_found_again(db, run, region):
    ada = annotator_id(db, "Ada")
    refresh_terms(db, run)
    found = [find.region_id for find in list_finds(db, run.id)]
    given = give_verdict(db, region.id, ada, "reject")
    version = finds_version(db, run.id)
    assert region.id not in {stop.id for stop in list_doubtful(db, run.id, 0.9, 50)}
    change_standing(db, given.audit, ada, stands=False)
    assert region.id in {stop.id for stop in list_doubtful(db, run.id, 0.9, 50)}
    assert [find.region_id for find in list_finds(db, run.id)] == found
    assert finds_version(db, run.id) != version


def test_nobody_takes_back_what_another_person_said(db, run, region):
    given = give_verdict(db, region.id, annotator_id(db, "Ada"), "keep")
    with pytest.raises(Conflict, match="verdict 1: is another person's"):
        change_standing(db, given.audit, annotator_id(db, "Bob"), stands=False)
    with pytest.raises(NotFound, match="verdict 99: does not exist"):
        change_standing(db, 99, annotator_id(db, "Bob"), stands=False)


def test_what_was_taken_back_stays_on_record_until_its_run_goes(db, run, region):
    ada = annotator_id(db, "Ada")
    change_standing(db, give_verdict(db, region.id, ada, "keep").audit, ada, stands=False)
    for change in ("DELETE FROM withdrawals", "UPDATE withdrawals SET withdrawn = 0"):
        with pytest.raises(sqlite3.IntegrityError, match="append-only"):
            db.write(lambda c, change=change: c.execute(change))
    delete_run(db, run.name, with_verdicts=True)
    assert db.read().execute("SELECT count(*) FROM withdrawals").fetchone()[0] == 0
    guards = (
        "SELECT count(*) FROM sqlite_master WHERE type = 'trigger' AND tbl_name = 'withdrawals'"
    )
    assert db.read().execute(guards).fetchone()[0] == 2
