"""Fixtures shared by all tests: a database and a small split."""

import pytest
from scenes import write_split

from reviewer.dataset.importer import ImportSettings, import_split
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs


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
