"""The runner: results, resuming, failures, settings."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import torch

from reviewer.errors import Conflict, InvalidInput, NotFound
from reviewer.masks import decode_rle, intersection_over_union
from reviewer.models.interfaces import Alignment, Instance, ModelFailed, Objects
from reviewer.models.nets.build import build_net
from reviewer.models.nets.checkpoints import NetRecord, save_checkpoint
from reviewer.pipeline.members import build_members
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.layers import load_detection
from reviewer.store.pairs import pair_ids
from reviewer.store.regions import load_prediction, load_regions
from reviewer.store.results import finished_pairs
from reviewer.store.revisions import newest_revision
from reviewer.store.runs import complete_settings, run_failures, run_of_name


@pytest.fixture
def run(db, tiny_split):
    return prepare_run(db, None, PipelineSettings(segmenter="oversegment", detector="difference"))


def everything(db, run):
    """All that a run left in the store, without times."""
    return {
        table: [
            tuple(v for k, v in zip(row.keys(), row, strict=True) if k not in ("seconds", "id"))
            for row in db.read().execute(f"SELECT * FROM {table} ORDER BY pair_id, 1, 2, 3")
        ]
        for table in ("alignments", "detections", "objects", "regions", "predictions")
    }


def test_all_stages_find_the_new_object(db, tiny_split, run):
    report = run_pipeline(db, run, pair_ids(db))
    assert (report.done, report.failures) == (3, [])
    truth = decode_rle(newest_revision(db, tiny_split[0].id).mask)
    final = decode_rle(load_prediction(db, run.id, tiny_split[0].id, "doi"))
    assert intersection_over_union(final, truth) > 0.8
    unchanged = load_prediction(db, run.id, tiny_split[2].id, "doi")
    assert unchanged.area == 0


def test_a_second_run_does_nothing_again(db, tiny_split, run):
    run_pipeline(db, run, pair_ids(db))
    before = everything(db, run)
    report = run_pipeline(db, run, pair_ids(db))
    assert (report.done, report.already_done) == (0, 3)
    assert everything(db, run) == before


def test_a_run_in_steps_equals_a_run_at_once(db, tiny_split, run):
    other = prepare_run(
        db, "in steps", PipelineSettings(segmenter="oversegment", detector="difference")
    )
    run_pipeline(db, run, pair_ids(db))
    for stage in ("align", "detect", "search", "integrate"):
        run_pipeline(db, other, pair_ids(db)[:2], stages=[stage])
        run_pipeline(db, other, pair_ids(db), stages=[stage], workers=2)
    for method in ("base", "doi"):
        for pair in tiny_split:
            masks = [load_prediction(db, r.id, pair.id, method) for r in (run, other)]
            assert masks[0] == masks[1]


def test_a_stage_without_the_one_before_says_so(db, tiny_split, run):
    report = run_pipeline(db, run, pair_ids(db)[:1], stages=["detect"])
    assert "is not aligned; do the stage align first" in report.failures[0]
    assert finished_pairs(db, run.id, "detect") == set()


def test_a_failing_pair_is_recorded_and_the_others_go_on(db, tiny_split, run):
    calls = []

    class Moody:
        def align(self, reference, live):
            calls.append(1)
            if len(calls) == 2:
                raise ModelFailed("aligner moody: not today")
            return real.align(reference, live)

    members = build_members(PipelineSettings(segmenter="oversegment", detector="difference"))
    real = members.aligner
    moody = replace(members, aligner=Moody())
    report = run_pipeline(db, run, pair_ids(db), members=moody)
    assert (report.done, len(calls)) == (2, 3)
    assert report.failures == ["pair cs1/0001, stage align: aligner moody: not today"]
    (row,) = db.read().execute("SELECT * FROM failures").fetchall()
    assert (row["stage"], row["message"]) == ("align", "aligner moody: not today")
    assert run_pipeline(db, run, pair_ids(db)).done == 1
    assert db.read().execute("SELECT count(*) FROM failures").fetchone()[0] == 0


class Bad:
    """A member that gives what no model should give, for one pair."""

    def __init__(self, real, answer, victim):
        self.real, self.answer, self.victim, self.calls = real, answer, victim, 0

    def _now(self, *given):
        self.calls += 1
        if self.calls == self.victim:
            return self.answer()
        return given[0](*given[1:])

    def align(self, *given):
        return self._now(self.real.align, *given)

    def detect(self, *given):
        return self._now(self.real.detect, *given)

    def segment(self, *given):
        return self._now(self.real.segment, *given)


SHAPE = (120, 160)


def divide():
    return 1 / 0


def nan_flow():
    return Alignment(np.full((*SHAPE, 2), np.nan, np.float32), np.ones(SHAPE, bool))


def nan_map():
    return np.full(SHAPE, np.nan, np.float32)


def one_object(mask, score):
    return lambda: Objects((Instance(mask, "", score),), ())


@pytest.mark.parametrize(
    ("member", "answer", "message"),
    [("aligner", divide, r"ZeroDivisionError: division by zero \(test_runner\.py:\d+\)"),
     ("aligner", nan_flow, "gave a flow that is not finite"),
     ("detector", nan_map, "gave probabilities that are not finite"),
     ("segmenter", one_object(np.full(SHAPE, np.nan), 0.5), "live object 0 is float64"),
     ("segmenter", one_object(np.ones((3, 4), bool), 0.5), r"is bool \(3, 4\), but a mask here"),
     ("segmenter", one_object(np.ones(SHAPE, bool), np.nan), "live object 0 has the score nan")],
)  # fmt: skip
def test_what_no_model_should_give_is_recorded_and_the_run_goes_on(
    db, tiny_split, run, member, answer, message
):
    members = build_members(PipelineSettings(segmenter="oversegment", detector="difference"))
    bad = Bad(getattr(members, member), answer, victim=2)
    report = run_pipeline(db, run, pair_ids(db), members=replace(members, **{member: bad}))
    assert report.done == 2 and re.search(message, report.failures[0])
    assert run_failures(db, run.id)[0].pair == "cs1/0001"
    assert run_pipeline(db, run, pair_ids(db), members=members).done == 1
    assert run_failures(db, run.id) == []


def test_an_image_that_vanished_is_a_failure_of_its_pair(db, tiny_split, run):
    tiny_split[1].live.path.unlink()
    report = run_pipeline(db, run, pair_ids(db))
    assert report.done == 2 and "0001.png" in report.failures[0]


def test_runs_of_other_settings_live_side_by_side(db, tiny_split, run):
    image = prepare_run(
        db, None, PipelineSettings(segmenter="oversegment", detector="difference", scope="image")
    )
    assert image.id != run.id
    run_pipeline(db, run, pair_ids(db))
    run_pipeline(db, image, pair_ids(db))
    assert len(load_regions(db, image.id, tiny_split[0].id)) == 1
    assert run_of_name(db, image.name).settings["scope"] == "image"


def test_a_run_records_every_setting_in_force(db, run):
    recorded = run_of_name(db, run.name).settings
    assert recorded["model_settings"]["detect"]["middle"] == 5.0
    assert recorded["model_settings"]["align"]["disagreement_px"] == 1.5
    assert set(recorded["model_settings"]["search"]) >= {"scale", "vote", "present"}
    assert recorded["high"] == 0.9


def test_without_a_name_other_settings_get_a_number(db, run):
    other = prepare_run(
        db, None, PipelineSettings(segmenter="oversegment", detector="difference", high=0.8)
    )
    assert other.name == f"{run.name}-2"
    assert (
        prepare_run(
            db, None, PipelineSettings(segmenter="oversegment", detector="difference", high=0.8)
        ).id
        == other.id
    )
    assert (
        prepare_run(db, None, PipelineSettings(segmenter="oversegment", detector="difference")).id
        == run.id
    )


def test_a_conflict_names_a_member_s_setting_with_both_values(db, run):
    other = PipelineSettings(
        segmenter="oversegment", detector="difference", model_settings={"detect": {"middle": 6.0}}
    )
    with pytest.raises(Conflict, match=r"another model_settings detect middle \(5.0, not 6.0\)"):
        prepare_run(db, run.name, other)


def test_a_run_of_an_earlier_version_goes_on_with_what_it_left_open(db, tiny_split, run):
    early = json.loads(json.dumps(run.settings))
    del early["touching_only"], early["model_settings"]["detect"]["middle"]
    complete_settings(db, run.id, early)
    assert (
        prepare_run(
            db, run.name, PipelineSettings(segmenter="oversegment", detector="difference")
        ).id
        == run.id
    )
    assert run_of_name(db, run.name).settings == run.settings
    complete_settings(db, run.id, early)
    with pytest.raises(Conflict, match="exists with another"):
        prepare_run(
            db,
            run.name,
            PipelineSettings(segmenter="oversegment", detector="difference", touching_only=True),
        )
    assert run_of_name(db, run.name).settings == early


@pytest.mark.parametrize("name", ["a\x00b", "a\nb", "\u202eb", "a\udc80", " ", "x" * 401])
def test_a_new_run_needs_a_name_that_can_be_read(db, name):
    with pytest.raises(InvalidInput, match="run name: "):
        prepare_run(db, name, PipelineSettings(segmenter="oversegment", detector="difference"))
    assert (
        prepare_run(
            db, " first ", PipelineSettings(segmenter="oversegment", detector="difference")
        ).name
        == "first"
    )


def test_a_run_of_an_earlier_version_is_found_by_the_name_it_has(db, run):
    db.write(lambda sql: sql.execute("UPDATE runs SET name = ' a\tb'"))
    assert (
        prepare_run(
            db, " a\tb", PipelineSettings(segmenter="oversegment", detector="difference")
        ).id
        == run.id
    )


def test_a_name_with_other_settings_is_a_conflict(db, run):
    with pytest.raises(Conflict, match="exists with another high"):
        prepare_run(
            db, run.name, PipelineSettings(segmenter="oversegment", detector="difference", high=0.8)
        )


@pytest.mark.parametrize(
    ("settings", "message"),
    [({"threshold": 1.0}, r"threshold: must lie in \[0, 1\)"),
     ({"low": 0.6, "high": 0.5}, "need 0 <= low <= high"),
     ({"max_overlap_px": -1}, "must be >= 0")],
)  # fmt: skip
def test_settings_are_checked(settings, message):
    with pytest.raises(InvalidInput, match=message):
        PipelineSettings(segmenter="oversegment", detector="difference", **settings)


def test_settings_of_a_newer_version_are_refused():
    with pytest.raises(InvalidInput, match="magic unknown"):
        PipelineSettings.of_record({"magic": 1})


def test_the_mask_is_the_probability_map_above_the_threshold(db, tiny_split):
    run = prepare_run(
        db,
        "strict",
        PipelineSettings(segmenter="oversegment", detector="difference", threshold=0.8),
    )
    run_pipeline(db, run, pair_ids(db)[:1])
    detection = load_detection(db, run.id, tiny_split[0].id)
    from reviewer.pipeline.fields import load_probability

    assert (decode_rle(detection.mask) == (load_probability(detection) > 0.8)).all()


def test_verdicts_change_the_final_mask(db, tiny_split, run):
    run_pipeline(db, run, pair_ids(db))
    from reviewer.editing.verdicts import give_verdict
    from reviewer.store.reviews import annotator_id

    pair = tiny_split[0]
    region = load_regions(db, run.id, pair.id)[0]
    ada = annotator_id(db, "Ada")
    for verdict, method in (("keep", "base"), ("agree", "doi")):
        give_verdict(db, region.id, ada, verdict)
        audited = load_prediction(db, run.id, pair.id, "audited")
        assert audited == load_prediction(db, run.id, pair.id, method)
    give_verdict(db, region.id, ada, "reject", comment="a shadow")
    assert load_prediction(db, run.id, pair.id, "audited").area == 0
    row = db.read().execute("SELECT * FROM doi_decisions WHERE verdict IS NOT NULL").fetchone()
    assert (row["verdict"], row["annotator"], row["comment"]) == ("reject", "Ada", "a shadow")
    assert db.read().execute("SELECT count(*) FROM audits").fetchone()[0] == 3


def test_a_verdict_on_a_region_that_does_not_exist_is_refused(db):
    from reviewer.editing.verdicts import give_verdict
    from reviewer.store.reviews import annotator_id

    with pytest.raises(NotFound, match="region 99"):
        give_verdict(db, 99, annotator_id(db, "Ada"), "keep")


def test_flow_survives_packing_to_a_32nd_of_a_pixel():
    from reviewer.pipeline.fields import pack_flow, unpack_flow

    y, x = np.mgrid[0:121, 0:163].astype(np.float32)
    flow = np.stack([3 + x / 40, -2 - y / 50], axis=2)
    back = unpack_flow(pack_flow(flow), 121, 163)
    inner = np.abs(back - flow)[:117, :159]
    assert inner.max() <= 1 / 32
    with pytest.raises(InvalidInput, match="does not fit an image of 50x50"):
        unpack_flow(pack_flow(flow), 50, 50)


def test_a_pair_whose_image_was_replaced_fails_by_name(db, tiny_split, run):
    path = tiny_split[1].live.path
    path.write_bytes(tiny_split[0].live.path.read_bytes())
    report = run_pipeline(db, run, pair_ids(db))
    assert report.done == 2
    assert re.search(r"pair cs1/0001, stage align: .*0001\.png: is not the", report.failures[0])
    assert load_detection(db, run.id, tiny_split[1].id) is None


def early_run(db, name, net, path):
    """A run whose record was written before `arithmetic` was noted."""
    made = prepare_run(db, name, net_settings(net, path))
    record = json.loads(json.dumps(made.settings))
    del record["model_settings"]["detect"]["arithmetic"]
    complete_settings(db, made.id, record)
    return made


def net_settings(net, path):
    return PipelineSettings(
        segmenter="oversegment", detector=net, model_settings={"detect": {"checkpoint": str(path)}}
    )


def test_results_of_nets_that_compute_what_they_did_keep_their_keys(db, tiny_split, tmp_path):
    path = tmp_path / "cdnet.pt"
    save_checkpoint(path, build_net("cdnet", 0.125), NetRecord("cdnet", 0.125))
    run = early_run(db, "early", "cdnet", path)
    early = run_of_name(db, "early")
    assert run_pipeline(db, early, pair_ids(db)).done == 3
    again = prepare_run(db, "early", net_settings("cdnet", path))
    assert again.id == run.id and again.settings["model_settings"]["detect"]["arithmetic"] == {}
    assert run_pipeline(db, again, pair_ids(db)).already_done == 3


def test_a_run_of_an_early_tanet_does_not_go_on_with_the_public_one(db, tiny_split, tmp_path):
    path = tmp_path / "public.pth"
    torch.save(build_net("tanet", 0.125).state_dict(), path)
    early_run(db, "early", "tanet", path)
    with pytest.raises(Conflict, match=r"run early: began when tanet was computed with one ReLU"):
        prepare_run(db, "early", net_settings("tanet", path))
