"""What is done again and what is not: keys, results of other runs, edited labels, verdicts."""

import sqlite3
from dataclasses import replace

import pytest
from fakes import NamedObjects

from reviewer.editing.verdicts import give_verdict
from reviewer.errors import Conflict, NotFound
from reviewer.models.labellers.plain import VocabularyLabeller
from reviewer.models.registry import SEGMENTER_READS, SEGMENTERS
from reviewer.pipeline.members import Members, build_members
from reviewer.pipeline.plan import Plan, _own_settings
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.layers import load_labels, load_objects
from reviewer.store.pairs import pair_ids
from reviewer.store.regions import load_regions
from reviewer.store.results import edit_label, stage_keys
from reviewer.store.reviews import annotator_id
from reviewer.store.runs import delete_run, list_runs, run_summary
from reviewer.words import STAGES


class Counting:
    """A member that counts how often it is asked."""

    def __init__(self, real):
        self.real = real
        self.calls = 0

    def __getattr__(self, name):
        found = getattr(self.real, name)
        if name not in ("align", "detect", "name", "segment"):
            return found

        def counted(*given):
            self.calls += 1
            return found(*given)

        return counted


def counting(members: Members) -> Members:
    return Members(
        Counting(members.aligner),
        Counting(members.detector),
        Counting(members.labeller),
        Counting(members.segmenter),
    )


def calls(members):
    parts = (members.aligner, members.detector, members.labeller, members.segmenter)
    return [part.calls for part in parts]


def do(db, settings, name=None, members=None):
    built = members or build_members(settings)
    run = prepare_run(db, name, settings, built)
    counted = counting(built)
    report = run_pipeline(db, run, pair_ids(db), members=counted)
    return run, report, calls(counted)


@pytest.fixture
def named(monkeypatch):
    """Settings and members of a run whose segmenter reads labels."""
    monkeypatch.setitem(SEGMENTERS, "named", NamedObjects)
    monkeypatch.setitem(SEGMENTER_READS, "named", frozenset({"labels"}))
    settings = PipelineSettings(
        detector="difference",
        labeller="vocabulary",
        segmenter="named",
        model_settings={"label": {"words": {"cs1": ["pen", "cup"]}}},
    )
    members = replace(
        build_members(PipelineSettings(segmenter="oversegment", detector="difference")),
        labeller=VocabularyLabeller({"cs1": ["pen", "cup"]}),
        segmenter=NamedObjects(),
    )
    monkeypatch.setattr("reviewer.pipeline.members.settings_of", lambda member: {})
    return settings, members


def test_another_doi_threshold_asks_no_model_again(db, tiny_split):
    _, _, first = do(db, PipelineSettings(segmenter="oversegment", detector="difference"))
    assert first == [3, 3, 3, 3]
    _, report, second = do(
        db, PipelineSettings(segmenter="oversegment", detector="difference", high=0.7), "lower"
    )
    assert second == [0, 0, 0, 0]
    assert (report.done, report.failures) == (3, [])


def test_rejecting_what_was_seen_decides_anew_and_asks_no_model(db, tiny_split):
    do(db, PipelineSettings(segmenter="oversegment", detector="difference"))
    run, report, called = do(
        db, PipelineSettings(segmenter="oversegment", detector="difference", seen="reject")
    )
    assert (report.done, called) == (3, [0, 0, 0, 0])
    assert run.name.endswith("component-reject") and run.settings["seen"] == "reject"


def test_results_of_before_there_was_a_choice_of_seen_keep_their_key(tiny_split):
    def integrate_key(**given):
        return (
            Plan(
                PipelineSettings(segmenter="oversegment", detector="difference", **given),
                frozenset(),
            )
            .of_pair(tiny_split[0], {})
            .keys["integrate"]
        )

    record = {**PipelineSettings(segmenter="oversegment", detector="difference").doi_rule()}
    assert record.pop("seen") == "keep"
    assert integrate_key() == integrate_key(seen="keep") != integrate_key(seen="reject")
    assert (
        _own_settings(PipelineSettings(segmenter="oversegment", detector="difference"), "integrate")
        == record
    )


def test_another_detector_threshold_shares_the_alignment(db, tiny_split):
    do(db, PipelineSettings(segmenter="oversegment", detector="difference"))
    run, _, counted = do(
        db,
        PipelineSettings(segmenter="oversegment", detector="difference", threshold=0.7),
        "strict",
    )
    assert counted == [0, 3, 3, 3]
    assert [stage.done for stage in run_summary(db, run.id)] == [3] * 5


def test_a_run_whose_stages_are_all_known_is_taken_over_whole(db, tiny_split):
    first, _, _ = do(db, PipelineSettings(segmenter="oversegment", detector="difference"))
    second, report, counted = do(
        db, PipelineSettings(segmenter="oversegment", detector="difference"), "again"
    )
    assert (counted, report.done) == ([0, 0, 0, 0], 3)
    for pair in tiny_split:
        assert load_objects(db, first.id, pair.id) == load_objects(db, second.id, pair.id)
        ours, theirs = (load_regions(db, run.id, pair.id) for run in (first, second))
        assert [r.region for r in ours] == [r.region for r in theirs]


def test_keys_speak_of_images_settings_and_what_is_read():
    plan = Plan(
        PipelineSettings(segmenter="oversegment", detector="difference", threshold=0.5),
        frozenset({"change"}),
    )
    assert plan.inputs["search"] == ("align", "detect")
    assert Plan(
        PipelineSettings(segmenter="oversegment", detector="difference", threshold=0.5), frozenset()
    ).inputs["search"] == ("align",)


def test_the_key_of_a_stage_changes_with_what_it_reads(tiny_split):
    def keys(**changes):
        settings = PipelineSettings(
            **{
                "detector": "difference",
                "segmenter": "oversegment",
                "threshold": 0.5,
                **changes,
            }
        )
        return Plan(settings, frozenset({"change"})).of_pair(tiny_split[0], {}).keys

    def differing(**changes):
        return [stage for stage in STAGES if keys(**changes)[stage] != keys()[stage]]

    assert differing(high=0.8) == ["integrate"]
    assert differing(threshold=0.6) == ["detect", "label", "search", "integrate"]
    assert differing(aligner="homography") == list(STAGES)
    assert differing(segmenter="imported") == ["search", "integrate"]
    other = replace(tiny_split[0], live=replace(tiny_split[0].live, sha256="f" * 64))
    plan = Plan(
        PipelineSettings(segmenter="oversegment", detector="difference", threshold=0.5),
        frozenset({"change"}),
    )
    assert set(plan.of_pair(other, {}).keys.values()).isdisjoint(keys().values())


def test_where_a_checkpoint_lies_does_not_matter(tiny_split):
    def key(path):
        own = {"detect": {"checkpoint": path, "weights": "abc"}}
        settings = PipelineSettings(
            segmenter="oversegment", detector="cscdnet", threshold=0.5, model_settings=own
        )
        return Plan(settings, frozenset()).of_pair(tiny_split[0], {}).keys["detect"]

    assert key("/a.pt") == key("/b.pt")


def test_an_edited_label_is_searched_again_for_that_pair_only(db, tiny_split, named):
    settings, members = named
    run, _, counted = do(db, settings, "r", members)
    assert counted == [3, 3, 3, 3]
    pair = tiny_split[0]
    assert [o.label for o in load_objects(db, run.id, pair.id)] == ["pen", "cup"]
    edit_label(db, run.id, pair.id, 1, "wallet", annotator_id(db, "Ada"))
    assert load_labels(db, run.id, pair.id)[1].edited_by == "Ada"
    assert load_labels(db, run.id, pair.id)[1].raw == "cup"
    _, report, counted = do(db, settings, "r", members)
    assert (report.done, report.already_done, counted) == (1, 2, [0, 0, 0, 1])
    assert [o.label for o in load_objects(db, run.id, pair.id)] == ["pen", "wallet"]
    # The edit stays when the run is resumed once more.
    assert do(db, settings, "r", members)[2] == [0, 0, 0, 0]


def test_an_empty_label_searches_nothing_and_keeps_the_detection(db, tiny_split, named):
    settings, members = named
    run, _, _ = do(db, settings, "r", members)
    pair, ada = tiny_split[0], annotator_id(db, "Ada")
    for number in (0, 1):
        edit_label(db, run.id, pair.id, number, "", ada)
    do(db, settings, "r", members)
    assert {r.region.reason for r in load_regions(db, run.id, pair.id)} == {"no_object"}


def test_a_label_can_be_added_but_none_left_out(db, tiny_split, named):
    settings, members = named
    run, _, _ = do(db, settings, "r", members)
    edit_label(db, run.id, tiny_split[0].id, 2, "key", annotator_id(db, "Ada"))
    assert [label.label for label in load_labels(db, run.id, tiny_split[0].id)][2] == "key"
    with pytest.raises(NotFound, match="has 3 labels in this run"):
        edit_label(db, run.id, tiny_split[0].id, 4, "key", annotator_id(db, "Ada"))


def test_verdicts_are_not_lost_to_another_search(db, tiny_split, named):
    settings, members = named
    run, _, _ = do(db, settings, "r", members)
    pair, ada = tiny_split[0], annotator_id(db, "Ada")
    region = load_regions(db, run.id, pair.id)[0]
    give_verdict(db, region.id, ada, "reject", comment="a shadow")
    edit_label(db, run.id, pair.id, 0, "", ada)
    _, report, _ = do(db, settings, "r", members)
    assert "people gave 1 verdicts or names to its regions" in report.failures[0]
    assert load_regions(db, run.id, pair.id)[0].verdict == "reject"
    with pytest.raises(Conflict, match="holds 1 verdicts"):
        delete_run(db, "r")
    delete_run(db, "r", with_verdicts=True)
    assert list_runs(db) == []
    assert stage_keys(db, run.id, [pair.id]) == {pair.id: {}}
    assert db.read().execute("SELECT count(*) FROM audits").fetchone()[0] == 0
    # Single verdicts are guarded as before.
    again, _, _ = do(db, settings, "again", members)
    give_verdict(db, load_regions(db, again.id, pair.id)[0].id, ada, "keep")
    with pytest.raises(sqlite3.IntegrityError, match="append-only"):
        db.write(lambda c: c.execute("DELETE FROM audits"))


def test_deleting_a_run_leaves_what_another_took_over(db, tiny_split):
    do(db, PipelineSettings(segmenter="oversegment", detector="difference"))
    second, _, _ = do(
        db, PipelineSettings(segmenter="oversegment", detector="difference", high=0.7), "lower"
    )
    delete_run(db, list_runs(db)[0].name)
    assert len(load_objects(db, second.id, tiny_split[0].id)) > 0
    assert [run.name for run in list_runs(db)] == ["lower"]
