"""What a run has not seen is left out of its scores, wherever something is held to the truth."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from people import draw
from seeing import hide
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.editing.commit import MaskEdit
from reviewer.evaluation.comparing import compare_runs, mean_lines
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import f_by_outcome, refresh_terms, run_terms
from reviewer.evaluation.protocols import Protocol
from reviewer.evaluation.rule_scores import rule_scores
from reviewer.evaluation.rules import rule_of_run
from reviewer.evaluation.shapes import shape_rows
from reviewer.evaluation.table_a import table_a_rows
from reviewer.evaluation.tables import table_lines
from reviewer.masks import decode_rle, encode_rle
from reviewer.metrics import Counts, count, f_score
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.reports.page import report_page
from reviewer.reports.table_a_text import scope_rows, table_a_cells, table_a_text
from reviewer.store.pairs import pair_ids
from reviewer.store.regions import load_prediction, load_regions, put_prediction
from reviewer.store.revisions import newest_revision
from reviewer.store.scores import pair_counts, pair_scores, split_scores

SHAPE = (120, 160)
PIXELS = 120 * 160
LEFT = np.arange(160)[None, :].repeat(120, axis=0) < 60
"""Holds columns 50 to 59 of the object of the first pair (50 to 74), nothing of the second's."""
ABOVE = np.arange(120)[:, None].repeat(160, axis=1) < 80
"""Holds both objects (rows 40 to 59)."""


def evaluate(db, *given):
    done = CliRunner().invoke(app, ["evaluate", *given, "--db", str(db.path)])
    assert done.exit_code == 0, done.output
    return done.stdout


@pytest.fixture
def seen(db, run, tiny_split):
    """The run, which sees everything: what the aligner says of the borders is left aside."""
    for pair in tiny_split:
        hide(db, run.id, pair.id, np.zeros(SHAPE, bool))
    return run


@pytest.mark.parametrize("method", ["base", "doi"])
def test_unseen_pixels_are_in_no_count(db, seen, tiny_split, method):
    pair = tiny_split[0]
    refresh_counts(db)
    before = pair_counts(db, seen.id, pair.id)[method]
    assert before.unseen_px == 0 and before.tp > 0
    hide(db, seen.id, pair.id, LEFT)
    assert pair_counts(db, seen.id, pair.id) == {}, "counts of another alignment were kept"
    assert refresh_counts(db) == 2
    counts = pair_counts(db, seen.id, pair.id)[method]
    masks = [load_prediction(db, seen.id, pair.id, method), newest_revision(db, pair.id).mask]
    predicted, truth = (decode_rle(mask)[~LEFT] for mask in masks)
    assert counts == replace(count(predicted, truth), unseen_px=120 * 60)
    assert counts.tp < before.tp


def test_an_object_that_is_unseen_as_a_whole_is_not_missed(db, seen, tiny_split):
    hide(db, seen.id, tiny_split[0].id, ABOVE)
    refresh_counts(db)
    counts = pair_counts(db, seen.id, tiny_split[0].id)["doi"]
    assert counts == Counts(tn=40 * 160, unseen_px=80 * 160, unseen_objects=1)
    assert pair_counts(db, seen.id, tiny_split[1].id)["doi"].unseen_objects == 0
    line = next(line for line in table_lines(split_scores(db)) if line.method == "doi")
    assert line.f_score == f_score(pair_counts(db, seen.id, tiny_split[1].id)["doi"])
    assert line.unseen == pytest.approx(80 * 160 / (3 * PIXELS))


def test_the_view_and_the_code_agree_on_the_share(db, seen, tiny_split):
    hide(db, seen.id, tiny_split[0].id, ABOVE)
    refresh_counts(db)
    lines = {(line.method, line.split): line for line in table_lines(split_scores(db))}
    for row in db.read().execute("SELECT * FROM split_scores"):
        line = lines[row["method"], row["split"]]
        assert row["unseen"] == pytest.approx(line.unseen) and row["unseen"] > 0.2
        assert row["unseen_objects"] == 1
    shares = [row["unseen"] for row in db.read().execute("SELECT unseen FROM pair_scores")]
    assert sorted({round(share, 4) for share in shares}) == [0, round(80 / 120, 4)]


@pytest.mark.parametrize("unseen", [LEFT, ABOVE, LEFT | ABOVE])
def test_other_rules_the_oracle_and_outcomes_count_as_the_scores_do(db, seen, tiny_split, unseen):
    for pair in tiny_split[:2]:
        hide(db, seen.id, pair.id, unseen)
    refresh_counts(db)
    assert refresh_terms(db, seen) == 3
    terms = run_terms(db, seen)
    found = terms.whatif.counts_by_pair(rule_of_run(seen.settings))
    for pair_id, counts in zip(terms.pair_ids, found, strict=True):
        kept = pair_counts(db, seen.id, pair_id)["doi"]
        assert (counts.tp, counts.fp, counts.fn) == (kept.tp, kept.fp, kept.fn)
    assert terms.whatif.base().truth_px[0] == sum(
        pair_counts(db, seen.id, pair.id)["base"].tp + pair_counts(db, seen.id, pair.id)["base"].fn
        for pair in tiny_split
    )
    for pair in tiny_split[:2]:
        now = pair_counts(db, seen.id, pair.id)["doi"]
        regions = {region.id: str(region.outcome) for region in load_regions(db, seen.id, pair.id)}
        for region_id, by_outcome in f_by_outcome(db, seen, pair.id, regions, now).items():
            same = None if now.rightly_empty else f_score(now)
            assert by_outcome[regions[region_id]] == same


def test_counts_under_the_runs_own_rule_are_the_stored_ones_whole(db, seen, tiny_split):
    pair = tiny_split[1]
    truth = newest_revision(db, pair.id).mask
    draw(db, pair.id, "Ada", MaskEdit(truth, 1, ignore=encode_rle(~LEFT & ~ABOVE)))
    hide(db, seen.id, tiny_split[0].id, ABOVE)
    hide(db, seen.id, pair.id, LEFT)
    refresh_counts(db)
    refresh_terms(db, seen)
    stored = [score for score in pair_scores(db, seen.name) if score.method == "doi"]
    assert rule_scores(db, seen, rule_of_run(seen.settings)) == stored
    assert [score.counts.unseen_objects for score in stored] == [1, 0, 0]


def test_outcomes_of_one_answer_leave_unseen_pixels_out_too(db, seen, tiny_split):
    pair = tiny_split[0]
    hide(db, seen.id, pair.id, LEFT)
    refresh_counts(db)
    now = pair_counts(db, seen.id, pair.id)["doi"]
    regions = {region.id: str(region.outcome) for region in load_regions(db, seen.id, pair.id)}
    unsaved = f_by_outcome(db, seen, pair.id, regions, now)
    refresh_terms(db, seen)
    assert f_by_outcome(db, seen, pair.id, regions, now) == unsaved
    (best,) = (found for found in unsaved.values() if len(found) == 3)
    assert best["reject"] == 0.0 and best["adopt"] > 0.8


def test_objects_and_borders_are_those_that_are_seen(db, seen, tiny_split):
    hide(db, seen.id, tiny_split[0].id, ABOVE)
    rows = {row["method"]: row for row in shape_rows(db)}
    assert rows["with DoI"]["R@0.5"] == 1.0
    assert rows["with DoI"]["unseen"] == pytest.approx(80 * 160 / (3 * PIXELS))
    db.write(lambda c: c.execute("DELETE FROM predictions WHERE method = 'doi'"))
    hide(db, seen.id, tiny_split[0].id, np.zeros(SHAPE, bool))
    before = {row["method"]: row for row in shape_rows(db)}["without DoI"]
    hide(db, seen.id, tiny_split[0].id, LEFT)
    after = {row["method"]: row for row in shape_rows(db)}["without DoI"]
    assert after["border 1 px"] != before["border 1 px"]


def test_the_share_stands_beside_f_in_every_format(db, seen, tiny_split):
    hide(db, seen.id, tiny_split[0].id, ABOVE)
    wanted = 80 * 160 / (3 * PIXELS)
    rows = json.loads(evaluate(db, "--format", "json"))
    assert {row["split"] for row in rows} == {"cs1", "mean"}
    for row in rows:
        assert row["unseen"] == pytest.approx(wanted)
        assert (row["unseen_px"], row["unseen_objects"]) == (80 * 160, 1)
    for row in csv.DictReader(io.StringIO(evaluate(db, "--format", "csv"))):
        assert float(row["unseen"]) == pytest.approx(wanted) and row["unseen_objects"] == "1"
    for form in ("markdown", "latex"):
        text = evaluate(db, "--format", form)
        assert "unseen" in text and f"{wanted:.4f}" in text
    table = evaluate(db)
    assert f"{wanted:.2%} of the pixels are unseen, 1 changed object as a whole" in table
    assert "unseen" in table and f"{wanted:.4f}" in table


def test_the_tables_of_runs_have_the_share(db, seen, tiny_split):
    hide(db, seen.id, tiny_split[0].id, ABOVE)
    wanted = 80 * 160 / (3 * PIXELS)
    refresh_counts(db)
    rows = table_a_rows(db, pair_scores(db), Protocol())
    assert [row.variant for row in rows] == ["", "component", "image"]
    assert [row.unseen for row in rows] == [pytest.approx(wanted)] * 3
    assert {row["unseen"] for row in scope_rows(rows)} == {rows[0].unseen}
    assert all(f"{wanted:.4f}" in cells for cells in table_a_cells(rows))
    assert json.loads(table_a_text(rows, "json"))[0]["unseen"] == pytest.approx(wanted)
    listed = CliRunner().invoke(app, ["runs", "list", "--json", "--db", str(db.path)])
    assert json.loads(listed.stdout)[0]["unseen"] == pytest.approx(wanted)


def test_the_report_says_what_was_not_seen(db, seen, tiny_split):
    hide(db, seen.id, tiny_split[0].id, ABOVE)
    page = report_page(db, None, Protocol(), lambda step: None)
    share = 80 * 160 / (3 * PIXELS)
    assert "<th>unseen</th>" in page and f"{share:.4f}" in page
    assert f"{share:.2%} of the pixels are unseen, 1 changed object as a whole" in page


def compare(db, *runs):
    done = CliRunner().invoke(app, ["runs", "compare", *runs, "--db", str(db.path)])
    assert done.exit_code == 0, done.output
    return done.output


def test_two_runs_are_compared_over_what_both_have_seen(db, seen, tiny_split):
    other = prepare_run(
        db, "other", PipelineSettings(segmenter="oversegment", detector="difference")
    )
    run_pipeline(db, other, pair_ids(db))
    for pair in tiny_split[1:]:
        hide(db, other.id, pair.id, np.zeros(SHAPE, bool))
    hide(db, other.id, tiny_split[0].id, ABOVE)
    # Both are wrong in the pixels that the other run says it has not seen.
    worse = encode_rle(ABOVE)
    for run in (seen, other):
        db.write(lambda c, run=run: put_prediction(c, run.id, tiny_split[0].id, "doi", worse))
    refresh_counts(db)
    means = [mean_lines(db, run.name)["doi"].f_score for run in (seen, other)]
    assert means[1] > means[0] + 0.3, "what is not seen is not charged"
    found = compare_runs(db, seen.name, "other", "doi")
    mean = found.splits[-1]
    assert (mean["pairs"], mean[seen.name], mean["change"]) == (3, mean["other"], 0)
    assert (found.change.value, found.pairs) == (0, [])
    share = 80 * 160 / (3 * PIXELS)
    assert mean["unseen"] == pytest.approx(share)
    assert found.unseen == {seen.name: 0.0, "other": pytest.approx(share)}
    told = compare(db, seen.name, "other")
    assert f"other has not seen {share:.1%} of the pixels, {seen.name} 0.0%" in told
    assert "F is over the pixels that both have seen" in told


def test_a_run_without_an_alignment_is_compared_over_what_the_other_has_seen(db, seen, tiny_split):
    other = prepare_run(
        db, "other", PipelineSettings(segmenter="oversegment", detector="difference")
    )
    run_pipeline(db, other, pair_ids(db))
    hide(db, seen.id, tiny_split[0].id, LEFT)
    db.write(lambda c: c.execute("DELETE FROM alignments WHERE run_id = ?", [other.id]))
    refresh_counts(db)
    found = compare_runs(db, seen.name, "other", "doi")
    assert found.splits[-1]["change"] == 0 and found.splits[-1]["unseen"] > 0
    assert found.unseen["other"] == 0


def test_runs_that_have_seen_the_same_are_not_counted_anew(db, seen, tiny_split, monkeypatch):
    other = prepare_run(
        db, "other", PipelineSettings(segmenter="oversegment", detector="difference", high=0.5)
    )
    run_pipeline(db, other, pair_ids(db))
    for run in (seen, other):
        hide(db, run.id, tiny_split[0].id, LEFT)
        for pair in tiny_split[1:]:
            hide(db, run.id, pair.id, np.zeros(SHAPE, bool))
    refresh_counts(db)
    monkeypatch.delattr("reviewer.evaluation.seen_by_both.count")
    found = compare_runs(db, seen.name, "other", "doi")
    lines = [mean_lines(db, run.name)["doi"] for run in (seen, other)]
    assert [found.splits[-1][run.name] for run in (seen, other)] == [line.f_score for line in lines]
    assert "both have seen" not in compare(db, seen.name, "other")


def test_a_run_without_an_alignment_has_seen_everything(db, seen, tiny_split):
    db.write(lambda c: [c.execute("DELETE FROM alignments"), c.execute("DELETE FROM scores")])
    refresh_counts(db)
    assert pair_ids(db)
    assert {score.counts.unseen_px for score in pair_scores(db)} == {0}
