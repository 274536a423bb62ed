"""Protocols: the same counts, scored pooled, per image, or from mean P and R."""

import json
from dataclasses import replace

import numpy as np
import pytest
from people import draw
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.editing.commit import MaskEdit
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import refresh_terms, run_terms
from reviewer.evaluation.protocols import Protocol, paired_change, protocol_lines
from reviewer.evaluation.tables import format_lines
from reviewer.masks import empty_rle
from reviewer.metrics import Counts
from reviewer.store.scores import PairScore, mask_pair_keys


def score(pair, counts, split="cs1", run="r", method="doi"):
    return PairScore(run, method, split, split[:2], int(split[2]), pair, Counts(*counts))


SCORES = [
    score(1, (10, 0, 0)),
    score(2, (10, 30, 10)),
    score(3, (0, 0, 0)),
    score(4, (5, 5, 0), "hw1"),
]


def mean_of(protocol, scores=SCORES):
    lines = {line.split: line for line in protocol_lines(scores, protocol)}
    return lines["mean"], lines


def test_pooled_sums_pixels_in_a_split_and_weighs_splits_alike():
    mean, lines = mean_of(Protocol())
    assert lines["cs1"].f_score == pytest.approx(40 / (40 + 40))
    assert mean.f_score == pytest.approx((0.5 + 2 / 3) / 2)
    assert (lines["cs1"].pairs, mean.pairs) == (3, 4)


def test_the_mean_may_weigh_images():
    mean, _ = mean_of(Protocol(weight="images"))
    assert mean.f_score == pytest.approx((3 * 0.5 + 2 / 3) / 4)


@pytest.mark.parametrize(("empty", "wanted"), [("skip", 2), ("one", 3), ("zero", 3)])
def test_the_rule_for_images_without_change_is_a_choice(empty, wanted):
    _, lines = mean_of(Protocol(kind="image_mean", empty=empty))
    second = 20 / (20 + 40)
    given = 1.0 if empty == "one" else 0.0
    total = 1.0 + second + (given if empty != "skip" else 0.0)
    assert lines["cs1"].f_score == pytest.approx(total / wanted)


@pytest.mark.parametrize("empty", ["skip", "one", "zero"])
def test_an_image_whose_changes_are_all_unseen_is_no_image_without_change(empty):
    hidden = replace(score(5, (0, 0, 0)), counts=Counts(tn=9, unseen_px=9, unseen_objects=1))
    nothing = replace(score(6, (0, 0, 0)), counts=Counts(unseen_px=18))
    protocol = Protocol(kind="image_mean", empty=empty)
    plain = [replace(s, counts=replace(s.counts, tn=9)) for s in SCORES]
    before, _ = mean_of(protocol, plain)
    after, _ = mean_of(protocol, [*plain, hidden, nothing])
    assert after.f_score == before.f_score


def test_mean_pr_takes_f_of_the_means():
    _, lines = mean_of(Protocol(kind="mean_pr"))
    p, r = (1 + 0.25) / 2, (1 + 0.5) / 2
    assert lines["cs1"].precision == pytest.approx(p)
    assert lines["cs1"].f_score == pytest.approx(2 * p * r / (p + r))


def test_lines_may_be_workspaces_or_object_groups():
    scores = [*SCORES, score(5, (1, 1, 1), "cs2")]
    assert set(mean_of(Protocol(group="workspace"), scores)[1]) == {"cs", "hw", "mean"}
    assert set(mean_of(Protocol(group="group"), scores)[1]) == {"group 1", "group 2", "mean"}


def test_latex_is_escaped():
    lines = protocol_lines([score(1, (1, 1, 1), run="a_b 50%")], Protocol())
    text = format_lines(lines, "latex")
    assert r"a\_b 50\%" in text and text.startswith(r"\begin{tabular}{lllrrrrr}")


def test_the_paired_bootstrap_knows_no_change_and_a_sure_one():
    rng = np.random.default_rng(0)
    first = [score(k, rng.integers(1, 50, 3), f"cs{k % 3 + 1}") for k in range(60)]
    same = paired_change(first, first)
    assert (same.value, same.low, same.high) == (0, 0, 0)
    better = [score(s.pair_id, (s.counts.tp + 30, s.counts.fp, 0), s.split) for s in first]
    change = paired_change(first, better)
    assert 0 < change.low < change.value < change.high
    assert np.isnan(paired_change(first, []).value)


def test_the_change_is_that_of_the_table():
    first = [score(k, (10 + k, 5, 5), f"cs{k % 2 + 1}") for k in range(8)]
    second = [score(k, (10, 5 + k, 5), f"cs{k % 2 + 1}") for k in range(8)]
    means = [mean_of(Protocol(), scores)[0].f_score for scores in (first, second)]
    assert paired_change(first, second).value == pytest.approx(means[1] - means[0])


def test_the_command_takes_a_protocol(db, run, tiny_split):
    def call(*given):
        done = CliRunner().invoke(app, ["evaluate", *given, "--db", str(db.path)])
        assert done.exit_code == 0, done.output
        return done.stdout

    pooled = json.loads(call("--format", "json"))
    means = json.loads(call("--format", "json", "--protocol", "image_mean", "--empty", "one"))
    assert {line["split"] for line in pooled} == {"cs1", "mean"}
    assert [line["f_score"] for line in pooled] != [line["f_score"] for line in means]
    tables = json.loads(call("--table-a", "--format", "json"))
    assert tables[0]["run"] == run.name and tables[0]["mean"] == pooled[-3]["f_score"]
    assert "pooled by workspace" in call("--by", "workspace")
    call("--figure-e", str(db.path.with_name("bars.svg")))
    drawn = db.path.with_name("bars.svg").read_text()
    assert drawn.count("<svg") == 1 and len(drawn) > 5000


def test_after_an_audit_a_pair_without_verdicts_is_scored_with_doi():
    found = protocol_lines([*SCORES, score(2, (10, 0, 0), method="audited")], Protocol())
    pairs = {(line.method, line.split): line.pairs for line in found}
    assert pairs["audited", "mean"] == pairs["doi", "mean"] == 4
    lines = {(line.method, line.split): line for line in found}
    assert lines["audited", "hw1"] == replace(lines["doi", "hw1"], method="audited")
    assert lines["audited", "cs1"].counts == Counts(20, 0, 0)


def test_runs_without_verdicts_have_no_line_after_an_audit():
    assert {line.method for line in protocol_lines(SCORES, Protocol())} == {"doi"}


def test_scores_say_what_they_rest_on_and_are_narrowed_by_it(db, run, tiny_split):
    def call(*given):
        return CliRunner().invoke(app, ["evaluate", *given, "--db", str(db.path)])

    everything = call("--format", "json")
    assert "ground truth of 3 pairs: 3 imported\n" in everything.stderr
    empty = MaskEdit(empty_rle(120, 160), 1)
    draw(db, tiny_split[0].id, "Ada", empty, "in_progress")
    assert call("--format", "json").stdout == everything.stdout, "a scribble was scored"
    draw(db, tiny_split[0].id, "Ada", MaskEdit(empty_rle(120, 160), 2), "approved")
    assert "ground truth of 3 pairs: 1 approved, 2 imported\n" in call().stdout
    approved = call("--state", "approved", "--format", "json")
    assert "ground truth of 1 pair: 1 approved; left out: 2 of another state" in approved.stderr
    assert {line["pairs"] for line in json.loads(approved.stdout)} == {1}
    refused = call("--state", "in_progress")
    assert "ground truth is never that" in str(refused.exception)


def test_shapes_and_the_report_stand_on_the_pairs_that_were_chosen(db, run, tiny_split):
    refresh_counts(db)
    draw(db, tiny_split[0].id, "Ada", MaskEdit(empty_rle(120, 160), 1), "approved")
    given = ["evaluate", "--shapes", "--state", "approved", "--format", "json"]
    done = CliRunner().invoke(app, [*given, "--db", str(db.path)])
    assert "ground truth of 1 pair: 1 approved" in done.stderr
    assert {row["R@0.5"] for row in json.loads(done.stdout)} == {0.0}
    whole = CliRunner().invoke(
        app, ["evaluate", "--shapes", "--format", "json", "--db", str(db.path)]
    )
    assert {row["R@0.5"] for row in json.loads(whole.stdout)} != {0.0}
    keys = mask_pair_keys(db, None, ["approved"])
    assert {pair for _, pair, _ in keys} == {tiny_split[0].id}
    counted = {tiny_split[0].id}
    refresh_terms(db, run)
    assert set(run_terms(db, run, counted).pair_ids) == counted
