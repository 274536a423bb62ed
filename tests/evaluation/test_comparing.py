"""Two runs held against each other: by the pairs that both have counts of."""

import pytest

from reviewer.evaluation.comparing import compare_runs, mean_lines
from reviewer.evaluation.counting import refresh_counts
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings


def test_splits_and_their_mean_are_over_the_pairs_that_both_runs_have(db, run):
    other = prepare_run(
        db, "other", PipelineSettings(segmenter="oversegment", detector="difference", high=0.5)
    )
    run_pipeline(db, other, [1])
    refresh_counts(db)
    assert (mean_lines(db, run.name)["doi"].pairs, mean_lines(db, "other")["doi"].pairs) == (3, 1)
    found = compare_runs(db, run.name, "other", "doi")
    assert [(row["split"], row["pairs"]) for row in found.splits] == [("cs1", 1), ("mean", 1)]
    mean = found.splits[-1]
    assert mean["change"] == pytest.approx(found.change.value)
    assert mean["change"] == pytest.approx(sum(row["change"] for row in found.pairs))


def test_runs_without_a_pair_in_common_have_no_splits_to_compare(db, run):
    prepare_run(
        db, "other", PipelineSettings(segmenter="oversegment", detector="difference", high=0.5)
    )
    refresh_counts(db)
    assert compare_runs(db, run.name, "other", "doi").splits == []
