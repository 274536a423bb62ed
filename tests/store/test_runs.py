"""Runs by id and by name."""

import pytest

from reviewer.errors import NotFound
from reviewer.store.runs import list_runs, run_of_id, run_of_name


def test_a_run_is_found_by_its_id_and_by_its_name(db, run):
    assert run_of_id(db, run.id) == run_of_name(db, run.name) == list_runs(db)[0] == run


def test_a_run_that_does_not_exist_is_told_with_those_that_do(db, run):
    with pytest.raises(NotFound, match="run 99: does not exist"):
        run_of_id(db, 99)
    with pytest.raises(NotFound, match=f"run paper: does not exist; there are {run.name}"):
        run_of_name(db, "paper")
