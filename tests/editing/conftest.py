"""A finished run of the tiny split."""

import pytest

from reviewer.pipeline.runner import prepare_run, run_pipeline
from reviewer.pipeline.settings import PipelineSettings


@pytest.fixture
def run(db, tiny_split):
    run = prepare_run(db, None, PipelineSettings())
    run_pipeline(db, run, tiny_split)
    return run
