"""What people type is text that can be read, and one text is one text."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reviewer.errors import InvalidInput
from reviewer.texts import as_cell, as_latex, as_markdown, clean_text


@pytest.mark.parametrize(
    ("typed", "kept"),
    [("Ada", "Ada"), ("  Ada ", "Ada"), ("Jürgen", "Jürgen"), ("Ｊ①", "J1"), ("田中", "田中"),
     ("e\u0301", "é"), ("a\u00a0b", "a b")],
)  # fmt: skip
def test_a_text_is_kept_in_one_form(typed, kept):
    assert clean_text(typed, "name", longest=10) == kept


@pytest.mark.parametrize(
    "typed",
    [
        "a\x00b",
        "a\x1b[31m",
        "a\x7f",
        "\ud800",
        "a\u202egnp",
        "a\u200bb",
        "a\nb",
        "a\u2028b",
        "\ue000",
    ],
)
def test_what_cannot_be_read_is_refused_by_its_code(typed):
    with pytest.raises(InvalidInput, match=r"reason: holds U\+[0-9A-F]{4}, .*position \d"):
        clean_text(typed, "reason", longest=80)


def test_lines_are_kept_where_they_may_be():
    assert clean_text("a\r\nb\tc\rd", "comment", longest=80, lines=True) == "a\nb\tc\nd"
    with pytest.raises(InvalidInput, match=r"U\+0000"):
        clean_text("a\n\0", "comment", longest=80, lines=True)


def test_length_is_that_of_what_is_kept():
    assert clean_text("", "reason", longest=3) == ""
    with pytest.raises(InvalidInput, match="name: must have 1 to 3 characters, but has 0"):
        clean_text(" ", "name", longest=3, least=1)
    with pytest.raises(InvalidInput, match="must have 0 to 3 characters, but has 4"):
        clean_text("abcd", "name", longest=3)
    # One character that is eighteen in the form that is kept.
    with pytest.raises(InvalidInput, match="but has 18"):
        clean_text("\ufdfa", "name", longest=3)


@given(st.text())
def test_what_is_kept_is_kept_as_it_is(typed):
    try:
        kept = clean_text(typed, "text", longest=100, lines=True)
    except InvalidInput:
        return
    assert clean_text(kept, "text", longest=100, lines=True) == kept
    kept.encode()


@pytest.mark.parametrize("typed", ["=1+1", "+1", "-1", "@SUM(A1)", "\tx", "\rx"])
def test_a_typed_cell_is_no_formula(typed):
    assert as_cell(typed) == f"'{typed}"


def test_numbers_and_other_texts_are_cells_as_they_are():
    for value in (-0.5, 3, None, "a=b", "", "cs1/0000", True):
        assert as_cell(value) is value


def test_latex_and_markdown_show_what_was_typed():
    assert as_latex("a_b & 5% #1 {x} $y$") == r"a\_b \& 5\% \#1 \{x\} \$y\$"
    assert as_latex("\\input{a}~^") == (
        r"\textbackslash{}input\{a\}\textasciitilde{}\textasciicircum{}"
    )
    assert as_markdown("a|b <i>*x*</i> [l](u) `c` _d_\\") == (
        r"a\|b \<i\>\*x\*\</i\> \[l\](u) \`c\` \_d\_\\"
    )
    assert as_markdown("two\nlines") == "two lines"
