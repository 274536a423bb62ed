"""The audit report: decisions against the oracle's, and DoI as a predictor of errors."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.editing.verdicts import give_verdict
from reviewer.evaluation.audit import audit_report, oracle_choice
from reviewer.evaluation.outcomes import refresh_terms
from reviewer.evaluation.predicting import (
    area_under_risk_coverage,
    auroc,
    average_precision,
    bootstrap,
    calibration_error,
    reliability,
    risk_coverage,
)
from reviewer.metrics import Counts
from reviewer.store.audit_rows import AuditRow, audit_rows
from reviewer.store.reviews import annotator_id


def test_auroc_is_the_share_of_pairs_in_the_right_order():
    scores, errors = np.array([0.1, 0.4, 0.35, 0.8]), np.array([False, False, True, True])
    assert auroc(scores, errors) == 0.75
    assert auroc(np.ones(4), errors) == 0.5
    assert np.isnan(auroc(scores, np.ones(4, bool)))


def test_average_precision_of_a_known_ranking():
    scores, errors = np.array([0.1, 0.4, 0.35, 0.8]), np.array([False, False, True, True])
    assert average_precision(scores, errors) == pytest.approx(0.5 * 1 + 0.5 * 2 / 3)
    # All alike: the precision is the share of errors, whatever the order.
    assert average_precision(np.ones(4), errors) == average_precision(np.ones(4), errors[::-1])
    assert average_precision(np.ones(4), errors) == 0.5


def test_risk_and_coverage_of_a_perfect_and_a_useless_order():
    risks = np.array([0.0, 0.0, 1.0, 1.0])
    coverage, risk = risk_coverage(risks, risks)
    assert coverage.tolist() == [0.25, 0.5, 0.75, 1.0]
    assert risk.tolist() == pytest.approx([0, 0, 1 / 3, 0.5])
    assert area_under_risk_coverage(np.ones(4), risks) == pytest.approx(0.5)


def test_reliability_bins_hold_means_and_counts():
    scores, errors = np.array([0.05, 0.95, 0.97, 1.0]), np.array([False, True, True, False])
    rows = reliability(scores, errors)
    assert [(round(s, 3), round(e, 3), n) for s, e, n in rows] == [(0.05, 0, 1), (0.973, 0.667, 3)]
    assert calibration_error(np.array([0.0, 1.0]), np.array([False, True])) == 0.0


def test_the_bootstrap_resamples_whole_pairs():
    pairs = np.repeat(np.arange(40), 3)
    values = np.repeat(np.random.default_rng(1).random(40), 3)
    found = bootstrap(lambda k: float(values[k].mean()), pairs, resamples=400)
    alone = bootstrap(lambda k: float(values[k].mean()), np.arange(120), resamples=400)
    assert found.low < found.value < found.high
    # Three copies of a value are one observation, not three.
    assert found.high - found.low > 1.4 * (alone.high - alone.low)


def row(region, choice, adopt, keep, **more):
    given = {"doi": 0.5, "f_b": 1, "verdict": None, "labels": "pen", "split": "cs1", **more}
    outcomes = {"keep": Counts(*keep), "reject": Counts(0, 0, keep[0] + keep[2])}
    if adopt:
        outcomes["adopt"] = Counts(*adopt)
    return AuditRow(region, region, given["split"], given["labels"], "reason", choice,
                    given["doi"], given["f_b"], given["verdict"], outcomes)  # fmt: skip


ROWS = [
    row(1, "adopt", (90, 5, 10), (50, 5, 50), doi=0.55),
    row(2, "adopt", (20, 80, 0), (20, 5, 0), doi=0.6, verdict="keep"),
    row(3, "keep", (90, 0, 10), (95, 0, 5), doi=0.05),
    row(4, "keep", (50, 0, 50), (50, 0, 50), split="hw3"),
    row(5, "keep", None, (0, 30, 0), doi=1.0),
]


def test_decisions_are_held_against_those_with_fewer_wrong_pixels():
    assert [oracle_choice(r) for r in ROWS[:4]] == ["adopt", "keep", "keep", "either"]
    found = audit_report(ROWS)
    assert (found.regions, found.counted) == (5, 4)
    table = {(r["decision"], r["oracle"]): r["regions"] for r in found.confusion}
    assert table == {("adopt", "adopt"): 1, ("adopt", "keep"): 1, ("keep", "keep"): 1,
                     ("keep", "either"): 1}  # fmt: skip
    by_split = {g["group"]: g for g in found.groups if g["by"] == "split"}
    assert by_split["cs1"]["right"] == 2 and by_split["cs1"]["pixels lost"] == 75
    assert by_split["hw3"]["share"] == 1.0
    assert [g["group"] for g in found.groups if g["by"] == "size"] == ["< 8²", "< 16²"]
    (said,) = found.verdicts
    assert said == {"verdict": "keep", "decision": "adopt", "reason": "-", "regions": 1}
    assert found.people.things == 0


def test_the_detector_is_wrong_where_its_pixels_miss_the_truth():
    found = audit_report(ROWS).predictors[0]
    # IoU of keep: .476, .8, .95, .5 and 0; the detector said something in all five.
    assert (found.regions, found.errors) == (5, 2)
    assert found.auroc.value == pytest.approx(5 / 6)
    assert found.aurc_best <= found.aurc.value


SEEN = [
    row(6, "keep", (0, 50, 40), (5, 60, 35), doi=0.0, f_b=0),
    row(7, "keep", (30, 0, 0), (28, 0, 2), doi=0.0, f_b=0),
    row(8, "keep", (90, 0, 10), (80, 0, 20), doi=0.2),
    row(9, "keep", None, (60, 10, 10), doi=1.0),
]


def test_doi_is_judged_apart_where_the_zero_over_zero_rule_does_not_speak():
    everything, with_object, unseen, baseline = audit_report([*ROWS, *SEEN]).predictors
    assert [p.title for p in (everything, with_object, unseen, baseline)] == [
        "DoI, all regions",
        "DoI, regions with an object",
        "DoI, with an object and f_b = 1",
        "no object touches it, all regions",
    ]
    assert [(p.regions, p.errors) for p in (everything, with_object, unseen)] == [
        (9, 3),
        (7, 2),
        (5, 1),
    ]
    # Errors 1, 5 and 6 of IoU .476, 0 and .05; DoI .55 (rank 2nd), 1 (tied), 0 (tied lowest).
    assert everything.auroc.value == pytest.approx((4 + 5.5 + 0.5) / (3 * 6))
    assert with_object.auroc.value == pytest.approx((4 + 0.5) / (2 * 5))
    # Of 1 (.55), 2 (.6), 3 (.05), 4 (.5) and 8 (.2) the first is the only error.
    assert unseen.auroc.value == pytest.approx(3 / 4)


def test_the_trivial_baseline_is_whether_an_object_touches_the_region():
    baseline = audit_report([*ROWS, *SEEN]).predictors[3]
    # Two of nine have no object: one of three errors, one of six others; ties count half.
    assert (baseline.regions, baseline.errors) == (9, 3)
    assert baseline.auroc.value == pytest.approx((5.5 + 2 * 2.5) / (3 * 6))


def test_where_a_rule_rejects_the_best_decision_may_reject_too():
    seen = [replace(r, reason="seen_in_reference") for r in SEEN[:2]]
    kept, rejected = (audit_report([*ROWS, *seen], way) for way in ("keep", "reject"))
    table = {(r["decision"], r["oracle"]): r["regions"] for r in rejected.confusion}
    # 6: 75 wrong pixels when kept, 90 adopted, 40 rejected; 7: 2, 0 and 30.
    assert table["reject", "reject"] == 1 and table["reject", "adopt"] == 1
    assert {r["decision"] for r in kept.confusion} == {"adopt", "keep"}
    lost = [
        sum(g["pixels lost"] for g in found.groups if g["group"] == "seen_in_reference")
        for found in (kept, rejected)
    ]
    assert lost == [5 + 2, 30]


def test_regions_seen_in_the_reference_stand_on_a_line_of_their_own():
    found = audit_report([*ROWS, *SEEN])
    assert (found.seen.regions, found.seen.errors, found.seen.share) == (2, 1, 0.5)
    assert audit_report(ROWS).record()["seen"] == {"regions": 0, "errors": 0, "share": None}


def test_a_region_of_which_nothing_can_be_compared_predicts_nothing():
    unseen = replace(SEEN[0], reason="outside_warp")
    with_it, without = audit_report([*ROWS, unseen]), audit_report(ROWS)
    assert with_it.seen.regions == 0
    assert [p.regions for p in with_it.predictors] == [p.regions for p in without.predictors]


def test_the_report_of_a_run_and_its_figure(db, run, tiny_split, tmp_path):
    refresh_terms(db, run)
    region = audit_rows(db, run.id)[0]
    give_verdict(db, region.region_id, annotator_id(db, "Ada"), "agree", reason="glass")
    give_verdict(db, region.region_id, annotator_id(db, "Bob"), "reject")
    place = ["--db", str(db.path)]
    figure = tmp_path / "audit.png"
    done = CliRunner().invoke(app, ["audit", "report", "--figure", str(figure), *place])
    assert done.exit_code == 0, done.output
    assert "DoI as a predictor" in done.output and figure.stat().st_size > 5000
    for line in ("regions with an object", "with an object and f_b = 1", "no object touches it"):
        assert line in done.output
    assert "0 regions were seen in the reference (f_b = 0, so DoI is 0)" in done.output
    assert "scope component, f_b = 0: keep" in done.output
    record = json.loads(CliRunner().invoke(app, ["audit", "report", "--json", *place]).output)
    assert record["regions"] == len(audit_rows(db, run.id))
    assert record["verdicts"][0]["verdict"] == "reject"
    assert record["predictors"][0]["title"] == "DoI, all regions"
    assert record["people"]["things"] == 1 and record["people"]["share"] == 0.0
    assert "judged by two or more: 0.0% of opinions agree" in done.output
