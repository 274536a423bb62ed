"""A notebook trains as `reviewer train` does, without the command line."""

import pytest

from reviewer.errors import NotFound
from reviewer.flows.training import Folding, TrainingOrder, train_on_synthesis, train_on_truth
from reviewer.training.recipes import make_recipe

SMALL = {"width": 0.25, "crop_px": 64, "iterations": 2, "batch": 2, "validate_every": 2,
         "validation_pairs": 2}  # fmt: skip


def order(*splits):
    return TrainingOrder("mine", make_recipe("default", "cdnet", SMALL, {}), splits)


def no_bank():
    raise AssertionError("no synthetic pair is asked for")


def test_a_net_per_fold_is_fitted_and_judges_in_a_run(db, run):
    folding = Folding("same-split", 3, run.name, share=0.0)
    done = train_on_truth(db, order("cs1"), folding, no_bank)
    assert (done.run, done.done, done.failures) == ("mine", 3, [])
    assert len(list((db.folder / "trainings/mine").glob("*/curve.png"))) == 3


def test_splits_that_are_not_there_are_named_before_the_bank_is_opened(db, run):
    with pytest.raises(NotFound, match="zz9"):
        train_on_synthesis(db, order("zz9"), "same_split", no_bank)
