"""Agreement of people: hand-made cases and a published one."""

import math

import pytest

from reviewer.evaluation.agreement import agreement


def test_krippendorffs_own_example():
    # Content Analysis, nominal data: four observers, twelve units, * = not judged; alpha = 0.743.
    observers = ["123321412***", "1233224125*3", "*3332342251*", "12332441251*"]
    opinions = [[v for v in unit if v != "*"] for unit in zip(*observers, strict=True)]
    assert agreement(opinions).alpha == pytest.approx(0.743, abs=5e-4)


def test_two_people_who_always_agree_or_never():
    assert agreement([["adopt", "adopt"], ["keep", "keep"]]).alpha == 1.0
    never = agreement([["adopt", "keep"], ["keep", "adopt"]])
    assert never.share == 0.0 and never.alpha < 0
    assert agreement([["adopt"], []]).things == 0


def test_where_all_said_the_same_alpha_is_not_defined():
    found = agreement([["keep", "keep"], ["keep", "keep", "keep"]])
    assert found.share == 1.0 and math.isnan(found.alpha)
