"""Fixtures shared by all tests: a database and a small split."""

import os

# Before torch is imported: tiny tensors are slower on many threads, and sums are the same on one.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from fakes import FakeClicks, NamedObjects
from scenes import write_split

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.editing.clicks import Clicks
from reviewer.models.clicks.embeddings import EmbeddingCache
from reviewer.models.registry import SEGMENTER_READS, SEGMENTERS
from reviewer.pipeline.members import build_members
from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs, pair_ids


@pytest.fixture
def db(tmp_path):
    """An empty database."""
    with Store(tmp_path / "reviewer.db", create=True) as store:
        yield store


@pytest.fixture
def split_folder(tmp_path):
    """A split on disk."""
    return write_split(tmp_path / "cs1")


@pytest.fixture
def tiny_split(db, split_folder):
    """The pairs of an imported split of three pairs."""
    import_split(db, "cs1", split_folder, ImportSettings(), lambda *_: None)
    return list_pairs(db)


@pytest.fixture
def run(db, tiny_split):
    """A finished run of the tiny split."""
    run = prepare_run(db, None, PipelineSettings(segmenter="oversegment", detector="difference"))
    run_pipeline(db, run, pair_ids(db))
    return run


@pytest.fixture
def segmenter():
    """A click segmenter that counts."""
    return FakeClicks()


@pytest.fixture
def clicks(db, segmenter):
    """Clicks answered by the counting segmenter."""
    clicks = Clicks(db, EmbeddingCache(segmenter, None))
    yield clicks
    clicks.stop()


@pytest.fixture
def make_named_run(monkeypatch):
    """Make a finished run whose segmenter reads labels: a vocabulary of words."""
    monkeypatch.setitem(SEGMENTERS, "named", NamedObjects)
    monkeypatch.setitem(SEGMENTER_READS, "named", frozenset({"labels"}))
    monkeypatch.setattr("reviewer.pipeline.members.settings_of", lambda member: {})

    def make(store, *words):
        own = {"label": {"words": {"*": list(words)}}}
        settings = PipelineSettings(
            detector="difference", labeller="vocabulary", segmenter="named", model_settings=own
        )
        members = build_members(settings)
        run = prepare_run(store, "named", settings, members)
        run_pipeline(store, run, pair_ids(store), members=members)
        NamedObjects.built = 0
        return run

    return make
