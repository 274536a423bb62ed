"""Flows, as a notebook calls them: no command line, and nobody listening or somebody who is."""

from contextlib import contextmanager

from scenes import write_split

from reviewer.dataset.settings import ImportSettings
from reviewer.flows.importing import import_splits
from reviewer.flows.running import RunOrder, run_stages
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.database import Store
from reviewer.store.results import finished_pairs
from reviewer.store.runs import run_of_name


class Hearing:
    def __init__(self):
        self.said, self.titles, self.steps = [], [], []

    def say(self, sentence):
        self.said.append(sentence)

    @contextmanager
    def progress(self, title):
        self.titles.append(title)
        yield lambda done, total, what: self.steps.append((done, total))


def test_a_notebook_imports_splits_and_runs_the_pipeline(tmp_path):
    for name in ("cs1", "cs2"):
        write_split(tmp_path / "data" / name)
    heard = Hearing()
    with Store(tmp_path / "reviewer.db", create=True) as store:
        reports = import_splits(store, tmp_path / "data", ImportSettings())
        assert [(r.split, r.pairs) for r in reports] == [("cs1", 3), ("cs2", 3)]
        order = RunOrder(
            PipelineSettings(segmenter="oversegment", detector="difference"),
            "first",
            splits=("cs2",),
        )
        done = run_stages(store, order, heard)
        assert (done.run, done.done, done.failures) == ("first", 3, [])
        assert len(finished_pairs(store, run_of_name(store, "first").id, "integrate")) == 3
        assert run_stages(store, order).already_done == 3
    assert heard.titles == ["first"] and heard.steps[-1] == (3, 3)


def test_stages_of_a_run_are_done_one_after_the_other(tmp_path):
    write_split(tmp_path / "cs1")
    with Store(tmp_path / "reviewer.db", create=True) as store:
        import_splits(store, tmp_path / "cs1", ImportSettings())
        run_stages(
            store,
            RunOrder(
                PipelineSettings(segmenter="oversegment", detector="difference"), "first", "align"
            ),
        )
        run = run_of_name(store, "first")
        assert len(finished_pairs(store, run.id, "align")) == 3
        assert not finished_pairs(store, run.id, "detect")
