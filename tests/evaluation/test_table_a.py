"""Table A in the paper's form: methods without and with DoI, both scopes, repetitions, matrix."""

import json

import pytest
from people import draw
from typer.testing import CliRunner

from reviewer.cli import app
from reviewer.editing.commit import MaskEdit
from reviewer.errors import InvalidInput
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.protocols import Protocol
from reviewer.evaluation.table_a import Row, table_a_rows
from reviewer.evaluation.tables import DASH
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.reports.matrix import trained_on
from reviewer.reports.page import report_page
from reviewer.reports.split_figure import draw_splits
from reviewer.reports.table_a_text import scope_rows, table_a_cells, table_a_text
from reviewer.store.pairs import pair_ids
from reviewer.store.reviews import annotator_id
from reviewer.store.scores import pair_scores
from reviewer.store.trainings import StoredTraining, save_training

NETS = ("cscdnet", "dr-tanet", "cscdnet-attention")


def made(db, name, detector="difference", checkpoint="", **given):
    """A finished run that says it had another detector."""
    run = prepare_run(
        db, name, PipelineSettings(segmenter="oversegment", detector="difference", **given)
    )
    run_pipeline(db, run, pair_ids(db))
    db.write(lambda c: c.execute("UPDATE runs SET detector = ? WHERE id = ?", [detector, run.id]))
    if checkpoint:
        db.write(
            lambda c: c.execute(
                "UPDATE runs SET settings = json_set(settings,"
                " '$.model_settings.detect.checkpoint', ?) WHERE id = ?",
                [checkpoint, run.id],
            )
        )
    return run


def rows_of(db, protocol=None, **given):
    refresh_counts(db)
    return table_a_rows(db, pair_scores(db), protocol or Protocol(), **given)


def call(db, *given):
    done = CliRunner().invoke(app, ["evaluate", *given, "--db", str(db.path)])
    assert done.exit_code == 0, done.output or done.exception
    return done.stdout


@pytest.fixture
def three(db, tiny_split):
    """A run of each method of the paper, and one without training."""
    for net in NETS:
        made(db, f"run of {net}", net)
    made(db, "plain", high=0.3)
    return db


def test_methods_stand_in_the_papers_order_first_without_then_with_doi(three):
    rows = rows_of(three)
    methods = ["DR-TANet", "CSCDNet", "CSCDNet + Siamese attention mask", "difference"]
    assert [row.title for row in rows] == methods * 3
    assert [row.variant for row in rows[::4]] == ["", "component", "image"]
    assert [row.text for row in rows[1::4]] == [
        "CSCDNet",
        "CSCDNet w/ DoI (component)",
        "CSCDNet w/ DoI (image)",
    ]
    assert {row.pairs for row in rows} == {3}


@pytest.mark.parametrize("protocol", [Protocol(), Protocol(kind="image_mean", empty="one")])
@pytest.mark.parametrize("seen", ["keep", "reject"])
def test_the_other_scope_from_integers_is_what_a_run_of_that_scope_scores(
    db, tiny_split, protocol, seen
):
    for scope in ("component", "image"):
        made(db, scope, scope=scope, seen=seen)
    rows = rows_of(db, protocol)
    by_variant = {}
    for row in rows[2:]:
        by_variant.setdefault(row.variant, []).append(row)
    assert len(by_variant) == 2
    for first, second in by_variant.values():
        # One is counted from the masks of a run, the other comes from the integers of the other.
        assert first.own != second.own
        assert first.values == pytest.approx(second.values)


def test_a_variant_that_was_asked_for_is_named(db, tiny_split):
    made(db, "r")
    assert [row.variant for row in rows_of(db, seen="reject")] == [
        "",
        "component, f_b = 0: reject",
        "image, f_b = 0: reject",
    ]
    assert [row.own for row in rows_of(db, seen="reject")] == [True, False, False]


def test_runs_of_one_method_are_told_apart_by_name(db, tiny_split):
    for name in ("a", "b"):
        made(db, name, "cscdnet")
    assert [row.title for row in rows_of(db)[:2]] == ["CSCDNet (a)", "CSCDNet (b)"]
    made(db, "my maps", "imported")
    assert rows_of(db)[2].title == "my maps"


def test_repetitions_are_one_row_of_mean_and_spread(db, tiny_split):
    for name, threshold in (("a", 0.5), ("b", 0.9)):
        made(db, name, "cscdnet", threshold=threshold)
    single = {row.runs: row for row in rows_of(db) if row.variant == ""}
    rows = rows_of(db, repeats={"CSCDNet, 2 seeds": ("a", "b")})
    both = rows[0]
    first, second = (single[name,].values["mean"] for name in ("a", "b"))
    assert both.title == "CSCDNet, 2 seeds" and both.runs == ("a", "b")
    assert first != second
    assert both.values["mean"] == pytest.approx((first + second) / 2)
    # The sample standard deviation of two values.
    assert both.spreads["mean"] == pytest.approx(abs(first - second) / 2**0.5)
    assert set(both.values) == set(both.spreads) == {"cs1", "mean"}


def test_only_what_shares_all_but_its_training_is_a_repetition(db, tiny_split):
    made(db, "a", "cscdnet")
    made(db, "b", "cscdnet", high=0.5)
    with pytest.raises(InvalidInput, match=r"--repeat x=a,b: b has another high, 0.5, not 0.9"):
        rows_of(db, repeats={"x": ("a", "b")})
    with pytest.raises(InvalidInput, match=r"has another model_settings.detect.middle, 6.0"):
        made(db, "c", "cscdnet", model_settings={"detect": {"middle": 6.0}})
        rows_of(db, repeats={"x": ("a", "c")})
    with pytest.raises(InvalidInput, match="--repeat x=a,none: no run none has scores"):
        rows_of(db, repeats={"x": ("a", "none")})
    with pytest.raises(InvalidInput, match="--repeat y=a,a: run a is named twice"):
        rows_of(db, repeats={"y": ("a", "a")})


def test_repetitions_are_scored_on_the_same_pairs(db, tiny_split):
    made(db, "a", "cscdnet")
    run = prepare_run(db, "b", PipelineSettings(segmenter="oversegment", detector="difference"))
    run_pipeline(db, run, pair_ids(db)[:2])
    db.write(lambda c: c.execute("UPDATE runs SET detector = 'cscdnet'"))
    with pytest.raises(InvalidInput, match="--repeat x=a,b: b is scored on other pairs than a"):
        rows_of(db, repeats={"x": ("a", "b")})


ROWS = [
    Row("A_1", ("a",), "", True, 8, {"mean": 0.5, "cs1": 0.4, "hw1": 0.6}, {}, 0.0),
    Row("A_1", ("a",), "image", True, 8, {"mean": 0.55, "cs1": 0.4, "hw1": 0.7}, {}, 0.0),
    Row("B", ("b", "c"), "image", True, 8, {"mean": 0.54, "cs1": 0.5, "hw1": 0.58},
        {"mean": 0.01, "cs1": 0.02, "hw1": 0.03}, 0.25),
]  # fmt: skip


def test_the_best_of_every_column_is_bold():
    text = table_a_text(ROWS, "markdown").splitlines()
    assert text[0] == "| Method | pairs | unseen | Mean F | cs1 | hw1 |"
    assert text[2:] == [
        r"| A\_1 | 8 | 0.0000 | 0.5000 | 0.4000 | 0.6000 |",
        r"| A\_1 w/ DoI (image) | 8 | 0.0000 | **0.5500** | 0.4000 | **0.7000** |",
        "| B w/ DoI (image) | 8 | 0.2500 | 0.5400 ± 0.0100 | **0.5000 ± 0.0200**"
        " | 0.5800 ± 0.0300 |",
    ]


def test_latex_has_a_rule_between_the_blocks_as_in_the_paper():
    text = table_a_text(ROWS, "latex").splitlines()
    assert text[0] == r"\begin{tabular}{lrrrrr}"
    assert text.count(r"\midrule") == 2
    assert (
        r"A\_1 w/ DoI (image) & 8 & 0.0000 & \textbf{0.5500} & 0.4000 & \textbf{0.7000} \\" in text
    )
    assert r"B w/ DoI (image) & 8 & 0.2500 & 0.5400 $\pm$ 0.0100" in text[-3]


def test_numbers_keep_all_their_digits_in_json():
    rows = json.loads(table_a_text(ROWS, "json"))
    assert rows[0] == {
        "method": "A_1", "DoI": "", "run": "a", "pairs": 8, "unseen": 0.0,
        "mean": 0.5, "mean spread": None, "cs1": 0.4, "cs1 spread": None,
        "hw1": 0.6, "hw1 spread": None,
    }  # fmt: skip
    assert rows[2]["run"] == "b, c" and rows[2]["mean spread"] == 0.01
    assert table_a_text(ROWS[:2], "csv").splitlines()[1] == "A_1,,a,8,0.0,0.5,0.4,0.6"


def test_the_short_table_has_a_row_a_run_and_both_scopes(db, tiny_split):
    made(db, "r")
    (row,) = scope_rows(rows_of(db))
    assert list(row)[:3] == ["run", "pairs", "unseen"]
    assert list(row)[3:] == ["without DoI", "with DoI (component)", "with DoI (image)"]
    assert row["run"] == "r" and row["pairs"] == 3


def test_what_a_run_does_not_have_is_none_and_shown_as_a_dash(db, tiny_split):
    made(db, "paper")
    made(db, "other", seen="reject")
    first, second = scope_rows(rows_of(db))
    assert first["with DoI (image, f_b = 0: reject)"] is None
    assert second["with DoI (image)"] is None
    page = report_page(db, None, Protocol(), lambda step: None)
    assert f'<td class="number">{DASH}</td>' in page
    assert "nan" not in page.lower().split("<h2>by split")[0]
    assert "scope component, f_b = 0: reject" in page


def test_what_people_audited_stands_on_the_pairs_that_all_rows_stand_on(db, run, tiny_split):
    from reviewer.editing.verdicts import give_verdict
    from reviewer.store.regions import load_regions

    region = load_regions(db, run.id, tiny_split[0].id)[0]
    give_verdict(db, region.id, annotator_id(db, "Ada"), "reject")
    rows = rows_of(db)
    assert (rows[-1].text, rows[-1].pairs) == ("difference, after audit", 3)
    (row,) = scope_rows(rows)
    assert row["after audit"] == rows[-1].values["mean"] and row["pairs"] == 3


def test_bars_of_all_methods_stand_side_by_side(tmp_path):
    draw_splits(ROWS, tmp_path / "bars.svg")
    drawn = (tmp_path / "bars.svg").read_text()
    # Three rows on two splits, and a line from each spread.
    assert drawn.count("A_1") >= 1 and len(drawn) > 5000
    with pytest.raises(Exception, match="nothing to draw"):
        draw_splits([], tmp_path / "none.svg")


def test_the_matrix_says_what_each_detector_was_trained_on(db, tiny_split):
    def training(name, data):
        save_training(
            db,
            StoredTraining(name, "cscdnet", f"trainings/{name}/best.pt", "0", {"data": data}, "0",
                           0, 9, 0.5),
        )  # fmt: skip

    training("own", {"splits": ["cs1"], "train_on": "same_split"})
    training("far", {"splits": ["cs1"], "train_on": "others"})
    training("all", {"splits": [], "train_on": "same_split"})
    training("fold", {"fold": "1"})
    for name in ("own", "far", "all", "fold"):
        made(db, name, "cscdnet", str(db.folder / "trainings" / name / "best.pt"))
    made(db, "public", "cscdnet", "/elsewhere/best.pt")
    made(db, "plain")
    found = {run: trained_on(db, run) for run in ("own", "far", "all", "fold", "public", "plain")}
    assert found == {
        "own": "cs1",
        "far": "others than cs1",
        "all": "all splits",
        "fold": "ground truth, fold 1",
        "public": "/elsewhere/best.pt",
        "plain": "nothing",
    }
    training("crossed/1", {"fold": "1"})
    training("crossed/2", {"fold": "2"})
    for name in ("crossed", "maps"):
        db.write(
            lambda c, name=name: c.execute(
                "INSERT INTO runs (name, aligner, detector, segmenter, settings, versions,"
                " created_at) SELECT ?, aligner, 'imported', segmenter,"
                " json_set(settings, '$.detector', 'imported'), versions, 'now'"
                " FROM runs WHERE name = 'plain'",
                [name],
            )
        )
    assert trained_on(db, "crossed") == "ground truth, 2 folds, never its own"
    assert trained_on(db, "maps") == "unknown (imported)"
    rows = json.loads(call(db, "--matrix", "--format", "json"))
    assert list(rows[0])[:3] == ["trained on", "method", "DoI"]
    assert {row["trained on"] for row in rows} == set(found.values())
    assert "cs" in json.loads(call(db, "--matrix", "--by", "workspace", "--format", "json"))[0]
    assert "trained on" in call(db, "--matrix", "--format", "markdown").splitlines()[0]


def test_the_command_prints_it_in_every_form(db, tiny_split):
    for name in ("a", "b"):
        made(db, name, "cscdnet")
    given = ["--table-a", "--repeat", "two=a,b"]
    rows = json.loads(call(db, *given, "--format", "json"))
    assert [row["DoI"] for row in rows] == ["", "component", "image"]
    assert rows[0]["run"] == "a, b" and rows[0]["mean spread"] == 0.0
    assert "two w/ DoI (image)" in call(db, *given, "--format", "markdown")
    assert r"$\pm$" in call(db, *given, "--format", "latex")
    assert "two w/ DoI (component)" in call(db, *given)
    named = call(db, "--table-a", "--seen", "reject", "--format", "csv")
    assert "image, f_b = 0: reject" in named
    wrong = CliRunner().invoke(app, ["evaluate", *given[:2], "a,b", "--db", str(db.path)])
    assert "--repeat a,b: must be NAME=run1,run2" in str(wrong.exception)


def test_after_another_truth_the_other_scope_follows(db, tiny_split):
    made(db, "r")
    before = rows_of(db)
    empty = before[0].values["mean"]
    from reviewer.masks import empty_rle

    for pair in tiny_split:
        draw(db, pair.id, "Ada", MaskEdit(empty_rle(120, 160), 1))
    after = rows_of(db)
    assert empty > 0 and [row.values["mean"] for row in after] == [0.0] * 3
    assert table_a_cells(after)[0][3] == "0.0000"
