"""Read access for notebooks; and every block of docs/scripting.md, run as it stands."""

import re
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from scenes import write_split
from typer.testing import CliRunner

import reviewer
from reviewer.cli import app
from reviewer.editing.verdicts import give_verdict
from reviewer.errors import NotFound
from reviewer.evaluation.counting import refresh_counts
from reviewer.masks import decode_rle
from reviewer.store.regions import load_prediction, load_regions
from reviewer.store.reviews import annotator_id
from reviewer.store.revisions import newest_revision

PAGE = (Path(__file__).parents[1] / "docs" / "scripting.md").read_text()


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_masks_and_pictures_are_those_of_the_store(db, run, tiny_split):
    with reviewer.open(db.path) as project:
        pair = project.pair("cs1/0000")
        assert [p.title for p in project.pairs()] == ["cs1/0000", "cs1/0001", "cs1/0002"]
        np.testing.assert_array_equal(
            pair.truth(), decode_rle(newest_revision(db, tiny_split[0].id).mask)
        )
        base = decode_rle(load_prediction(db, run.id, tiny_split[0].id, "base"))
        np.testing.assert_array_equal(pair.prediction(run.name, "base"), base)
        assert pair.live().shape == pair.reference().shape == (120, 160, 3)
        warped, valid = pair.warped(run.name)
        assert warped.shape == (120, 160, 3) and valid.dtype == bool
        assert pair.flow(run.name).shape == (120, 160, 2)
        assert 0.9 < pair.confidence(run.name).max() <= 1
        assert 0.9 < pair.probability(run.name).max() <= 1
        assert pair.objects(run.name)[0].side == "live" and pair.labels(run.name) == []
        assert pair.ignore() is None and pair.prediction(run.name, "audited") is None
        assert [r.name for r in project.runs()] == [run.name]


def test_the_final_mask_follows_verdicts(db, run, tiny_split):
    region = load_regions(db, run.id, tiny_split[0].id)[0]
    give_verdict(db, region.id, annotator_id(db, "Ada"), "reject")
    with reviewer.open(db.path) as project:
        pair = project.pair("cs1/0000")
        assert not pair.prediction(run.name).any() and pair.prediction(run.name, "doi").any()


def test_what_is_not_there_is_named_and_nothing_can_be_written(db, run):
    with reviewer.open(db.path) as project:
        with pytest.raises(NotFound, match="pair cs1/9999: does not exist"):
            project.pair("cs1/9999")
        with pytest.raises(NotFound, match="split zz"):
            project.pairs("zz")
        with pytest.raises(NotFound, match="run nothing"):
            project.pair("cs1/0000").prediction("nothing")
        with pytest.raises(sqlite3.OperationalError, match="readonly"):
            project.query("DELETE FROM runs")
    with pytest.raises(NotFound, match="does not exist"):
        reviewer.open(db.path.with_name("none.db"))


def test_the_pairs_that_a_run_does_worst_are_none_that_are_rightly_empty(db, run):
    refresh_counts(db)
    db.write(lambda sql: sql.execute("UPDATE runs SET name = 'first'"))
    (query,) = [text for text in blocks("sql") if "order by f_score" in text]
    rows = db.read().execute(query).fetchall()
    assert [row["pair"] for row in rows] and "0002" not in {row["pair"] for row in rows}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A database as the page has it: reviewer.db with a run named first."""
    folder = tmp_path_factory.mktemp("scripting")
    write_split(folder / "data" / "cs1")
    db = str(folder / "reviewer.db")
    for given in (
        ["import", str(folder / "data")],
        ["run", "--name", "first", "--workers", "1"],
        ["evaluate"],
        ["audit", "report"],
    ):
        done = CliRunner().invoke(app, [*given, "--db", db])
        assert done.exit_code == 0, done.output
    return folder


@pytest.mark.parametrize("code", blocks("python"))
def test_the_pages_scripts_run(folder, monkeypatch, capsys, code):
    monkeypatch.chdir(folder)
    exec(code, {})
    assert capsys.readouterr().out


def test_the_page_has_thirteen_queries():
    assert len(blocks("sql")) == 13


@pytest.mark.parametrize("query", blocks("sql"))
def test_the_pages_queries_run(folder, query):
    with reviewer.open(folder / "reviewer.db") as project:
        rows = project.query(query)
        # Nobody has judged or drawn anything in this database.
        if not any(word in query for word in ("verdict is not null", "pair_effort", "opinions")):
            assert rows or "adopted_wrong" in query
