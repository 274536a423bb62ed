"""From a sentence to a name, and the labellers that need no weights."""

import numpy as np
import pytest

from reviewer.errors import InvalidInput
from reviewer.models.labellers.phrases import check_label, parse_label
from reviewer.models.registry import build_labeller


@pytest.mark.parametrize(
    ("raw", "label"),
    [("This object is a pen.", "pen"),
     ("This object is a black leather wallet.", "black leather wallet"),
     ("The object is the USB cable. It lies on a table.", "usb cable"),
     ("This object in the image is an IC card", "ic card"),
     ("  'Notebook'  ", "notebook"),
     ("It appears to be a screw!", "screw"),
     ("this is some paper clips", "paper clips"),
     ("Battery", "battery")],
)  # fmt: skip
def test_the_name_is_what_remains_of_a_sentence(raw, label):
    assert parse_label(raw) == (label, "")


@pytest.mark.parametrize(
    ("raw", "note"),
    [("", "nothing was said"),
     (" . ", "nothing was said"),
     ("This object is a wooden floor.", "in the stop list: floor"),
     ("x" * 4000, "too long for a name: 4000 characters, at most 80")],
)  # fmt: skip
def test_what_is_no_name_says_why(raw, note):
    assert parse_label(raw) == ("", note)


def test_the_stop_list_is_a_setting():
    assert parse_label("a wooden floor", ()) == ("wooden floor", "")
    assert parse_label("a chair leg", ["Chair"])[0] == ""


def test_a_persons_label_is_put_into_the_same_form():
    assert check_label("  Red  Pen. ") == "red pen"
    with pytest.raises(InvalidInput, match="has 81 characters"):
        check_label("x" * 81)


LIVE = np.zeros((4, 4, 3), np.uint8)


@pytest.mark.parametrize(
    ("split", "labels"),
    [("cs1", ["pen"]), ("cs2", ["wallet"]), ("hw3", ["screw"]), ("elsewhere", ["thing"])],
)
def test_the_words_of_the_split_the_group_the_workspace_or_all(split, labels):
    words = {"cs1": ["Pen"], "2": ["wallet"], "hw": ["screw"], "*": ["thing"]}
    labeller = build_labeller("vocabulary", {"words": words})
    said = labeller.name(LIVE, np.ones((4, 4), bool), split)
    assert [s.label for s in said] == labels
    assert labeller.name(LIVE, np.zeros((4, 4), bool), split) == ()


@pytest.mark.parametrize("words", [{}, {"1": "pen"}, {"1": [""]}, {"1": ["x" * 100]}])
def test_words_that_are_no_names_are_refused(words):
    with pytest.raises(InvalidInput):
        build_labeller("vocabulary", {"words": words})


def test_none_says_nothing():
    assert build_labeller("none").name(LIVE, np.ones((4, 4), bool), "cs1") == ()
