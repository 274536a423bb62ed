"""Figure F and the report: what is shown, and that the page needs nothing beside it."""

import re

import cv2
import numpy as np
import pytest
from people import draw
from seeing import hide
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.editing.commit import MaskEdit
from reviewer.editing.skipping import skip_pair
from reviewer.editing.verdicts import give_verdict
from reviewer.errors import NotFound
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.protocols import Protocol
from reviewer.masks import encode_rle
from reviewer.reports.page import report_page
from reviewer.reports.rows_figure import (
    IGNORED,
    MISSED,
    RIGHT,
    WRONG,
    cells_of,
    draw_rows,
    overlaid,
    telling_pairs,
    telling_window,
)
from reviewer.store.regions import load_regions
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import newest_revision


def test_pixels_are_coloured_by_what_became_of_them():
    live = np.full((20, 20, 3), 100, np.uint8)
    found, truth, ignore = (np.zeros((20, 20), bool) for _ in range(3))
    found[:10], truth[5:15], ignore[:, :4] = True, True, True
    picture = overlaid(live, found, truth, ignore)
    for row, colour in ((7, RIGHT), (2, WRONG), (12, MISSED)):
        assert np.abs(picture[row, 10].astype(int) - colour).max() < 40
    assert np.abs(picture[18, 1].astype(int) - IGNORED).max() < 40
    assert len(set(picture[18, 10].tolist())) == 1, "what is right and empty stays grey"


def test_the_window_lies_around_the_changes_and_keeps_the_proportions():
    truth, found, nothing = (np.zeros((480, 640), bool) for _ in range(3))
    truth[400:410, 600:630], found[10:20, 10:20] = True, True
    rows, columns = telling_window(truth, [found])
    assert (rows.stop - rows.start, columns.stop - columns.start) == (106, 141)
    assert columns.stop == 640 and rows.start < 400 and rows.stop > 410
    rows, columns = telling_window(nothing, [found])
    assert (rows.start, columns.start) == (0, 0) and rows.stop == 106
    assert telling_window(nothing, [nothing]) == (slice(0, 480), slice(0, 640))
    truth[0, 0] = True
    assert telling_window(truth, []) == (slice(0, 480), slice(0, 640))


def test_telling_pairs_are_gains_then_losses_and_never_the_rightly_empty(db, run):
    refresh_counts(db)
    titles = telling_pairs(db, run, 6)
    assert set(titles) == {"cs1/0000", "cs1/0001"}


def test_figure_f_is_a_row_a_pair(db, run, tiny_split, tmp_path):
    refresh_counts(db)
    for pairs, name in ((tiny_split[:1], "one.png"), (tiny_split, "three.png")):
        draw_rows(db, [run], pairs, tmp_path / name)
    one, three = (cv2.imread(str(tmp_path / name)) for name in ("one.png", "three.png"))
    assert one.shape[1] == three.shape[1] and three.shape[0] > 1.6 * one.shape[0]
    with pytest.raises(NotFound, match="no pair has both"):
        draw_rows(db, [run], [], tmp_path / "none.png")


def test_unseen_pixels_are_shown_as_not_scored_and_never_as_missed(db, run, tiny_split, tmp_path):
    refresh_counts(db)
    pair = tiny_split[0]
    before = cells_of(db, [run], ["doi"], pair)
    assert re.fullmatch(r"F [01]\.\d\d", before[-1][1])
    hide(db, run.id, pair.id, np.ones((120, 160), bool))
    refresh_counts(db)
    picture, note = cells_of(db, [run], ["doi"], pair)[-1]
    assert note == "unseen"
    assert np.abs(picture.astype(int) - IGNORED).max() < 60
    assert cells_of(db, [run], ["doi"], tiny_split[2])[-1][1] == "correctly empty"


def test_the_report_holds_tables_plots_and_what_was_left_out(db, run, tiny_split):
    ignored = np.zeros((120, 160), bool)
    ignored[:30, :40] = True
    pair = tiny_split[0]
    edit = MaskEdit(newest_revision(db, pair.id).mask, 1, ignore=encode_rle(ignored))
    ada = annotator_id(db, "Ada")
    draw(db, pair.id, "Ada", edit)
    give_verdict(db, load_regions(db, run.id, pair.id)[0].id, ada, "keep", reason="<glass>")
    steps = []
    page = report_page(db, None, Protocol(), steps.append)
    assert "1,200 of 57,600 pixels are ill-posed and were left out (2.08%)" in page
    assert run.name in page and "<h2>Mean F</h2>" in page and "&lt;glass&gt;" in page
    assert "no object touches it, all regions" in page and "seen in the reference" in page
    assert len(re.findall('src="data:image/png;base64,', page)) == 4
    assert not re.search(r'(src|href)="(?!data:)', page) and "<script" not in page
    assert steps == ["counts", "objects and borders", run.name, "pictures"]


def test_the_report_counts_the_pairs_that_were_skipped(db, run, tiny_split):
    skip_pair(db, 1, annotator_id(db, "Ada"), run, "badly aligned")
    page = report_page(db, None, Protocol(), lambda step: None)
    assert (
        "Left out: 1 pair skipped as badly aligned." in page and "ground truth of 2 pairs" in page
    )


def test_the_commands_write_both(db, run, tmp_path):
    place = ["--db", str(db.path)]
    runner = CliRunner()
    report = tmp_path / "report.html"
    done = runner.invoke(app, ["evaluate", "--report", str(report), *place], catch_exceptions=False)
    assert done.exit_code == 0 and report.read_text().startswith("<!doctype html>")
    figure = tmp_path / "f.svg"
    command = ["evaluate", "--figure-f", str(figure), "--pairs", "cs1/0001", *place]
    assert "wrote" in runner.invoke(app, command, catch_exceptions=False).output
    assert figure.read_text().count("<image") == 5
    wrong = runner.invoke(app, [*command[:-4], "--pairs", "cs1/9", *place])
    assert "--pairs cs1/9: there is no such pair" in str(wrong.exception)


def test_without_ground_truth_there_is_nothing_to_report(db):
    with pytest.raises(NotFound, match="no run has a prediction of a pair with ground truth"):
        report_page(db, None, Protocol(), lambda step: None)


def test_a_dollar_in_a_name_is_a_dollar(db, run):
    db.write(lambda c: c.execute(r"UPDATE runs SET name = 'r$x_1$ and $\bad$'"))
    assert "r$x_1$ and" in report_page(db, None, Protocol(), lambda step: None)
