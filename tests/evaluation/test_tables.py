"""From predictions to the table: pooled inside a split, unweighted over splits."""

import csv
import io
import json

import numpy as np
import pytest
from people import draw
from scenes import write_split

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.editing.commit import MaskEdit
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.tables import (
    csv_text,
    format_lines,
    format_rows,
    short_row,
    table_lines,
)
from reviewer.masks import encode_rle
from reviewer.metrics import Counts
from reviewer.pipeline.runner import prepare_run
from reviewer.pipeline.settings import PipelineSettings
from reviewer.records import Score
from reviewer.store.pairs import list_pairs
from reviewer.store.regions import StoredIntegration
from reviewer.store.results import StageResult, save_results
from reviewer.store.scores import pair_counts, split_scores


def rle(pair, area):
    mask = np.zeros((pair.live.height, pair.live.width), bool)
    mask.ravel()[:area] = True
    return encode_rle(mask)


@pytest.fixture
def scored(db, tmp_path):
    """Two splits with truths and predictions whose counts are known."""
    for name, pairs in (("cs1", 2), ("hw3", 1)):
        folder = write_split(tmp_path / name, pairs)
        import_split(db, name, folder, ImportSettings(), lambda *_: None)
    run = prepare_run(db, "r", PipelineSettings(segmenter="oversegment", detector="difference"))
    for pair, truth, base, final in zip(
        list_pairs(db), (100, 0, 50), (50, 0, 100), (100, 10, 50), strict=True
    ):
        draw(db, pair.id, "Ada", MaskEdit(rle(pair, truth), 1))
        made = StoredIntegration((), rle(pair, base), rle(pair, final))
        save_results(db, run.id, pair.id, [StageResult("integrate", "made up", 0.0, made)])
    return run


def test_scores_follow_the_newest_revision(db, scored):
    assert refresh_counts(db) == 6
    assert refresh_counts(db) == 0
    pair = list_pairs(db)[0]
    assert pair_counts(db, scored.id, pair.id)["base"] == Counts(50, 0, 50, 120 * 160 - 100)
    draw(db, pair.id, "Ada", MaskEdit(rle(pair, 50), 2))
    assert pair_counts(db, scored.id, pair.id)["base"].fn == 0


def test_ignored_pixels_are_left_out(db, scored):
    pair = list_pairs(db)[0]
    edit = MaskEdit(rle(pair, 100), 2, ignore=rle(pair, 60))
    draw(db, pair.id, "Ada", edit)
    counts = pair_counts(db, scored.id, pair.id)["doi"]
    assert (counts.tp, counts.ignored) == (40, 60)


def test_pixels_are_pooled_in_a_split_and_splits_weigh_alike(db, scored):
    refresh_counts(db)
    lines = {(line.method, line.split): line for line in table_lines(split_scores(db))}
    assert lines["base", "cs1"].f_score == pytest.approx(2 * 50 / (2 * 50 + 50))
    assert lines["base", "hw3"].f_score == pytest.approx(2 * 50 / (2 * 50 + 50))
    assert lines["doi", "cs1"].f_score == pytest.approx(200 / 210)
    assert lines["doi", "hw3"].f_score == 1.0
    assert lines["doi", "mean"].f_score == pytest.approx((200 / 210 + 1) / 2)
    assert lines["doi", "mean"].pairs == 3


def test_the_view_and_the_code_agree(db, scored):
    refresh_counts(db)
    lines = {(line.method, line.split): line for line in table_lines(split_scores(db))}
    for row in db.read().execute("SELECT * FROM split_scores"):
        line = lines[row["method"], row["split"]]
        for name in ("precision", "recall", "f_score"):
            assert row[name] == pytest.approx(getattr(line, name))


def test_the_table_is_written_in_every_format(db, scored):
    refresh_counts(db)
    lines = table_lines(split_scores(db, "r"))
    rows = json.loads(format_lines(lines, "json"))
    assert rows[-1]["split"] == "mean" and rows[0]["tp"] == 50
    again = list(csv.DictReader(io.StringIO(format_lines(lines, "csv"))))
    assert [float(r["f_score"]) for r in again] == [r["f_score"] for r in rows]
    assert "| r | with DoI | **mean** | 3 |" in format_lines(lines, "markdown")


def test_a_split_that_is_rightly_empty_has_a_dash_for_its_scores():
    empty = Score("r", "doi", "cs1", 2, Counts(tn=900))
    wrong = Score("r", "doi", "cs2", 2, Counts(fp=3, tn=900))
    lines = table_lines([empty, wrong])
    assert [short_row(line)["F"] for line in lines] == [None, 0.0, 0.0]
    markdown = format_lines(lines, "markdown")
    assert "| cs1 | 2 | – | – | – |" in markdown and "| cs2 | 2 | 0.0000 |" in markdown
    assert "cs1 & 2 & – & – & –" in format_lines(lines, "latex")
    assert r"\begin{tabular}{lllrrrrr}" in format_lines(lines, "latex")
    assert json.loads(format_lines(lines, "json"))[0]["f_score"] == 0.0


def test_what_people_typed_stays_text_in_every_format():
    scores = [Score("=HYPERLINK(1)", "doi", "a|b_%", 1, Counts(tp=1, fp=0, fn=0, tn=1))]
    lines = table_lines(scores)
    row = next(csv.DictReader(io.StringIO(format_lines(lines, "csv"))))
    assert (row["run"], row["tp"]) == ("'=HYPERLINK(1)", "1")
    assert csv_text([{"f": -0.5}], ["f"]) == "f\n-0.5"
    assert r"| =HYPERLINK(1) | with DoI | a\|b\_% |" in format_lines(lines, "markdown")
    assert r"a|b\_\%" in format_lines(lines, "latex")
    assert r"| a\|b | 1 |" in format_rows([{"run": "a|b", "n": 1}], "markdown")
