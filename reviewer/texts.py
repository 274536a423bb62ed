"""The one rule for texts that people and programs type: names, reasons, comments, labels.

A text is kept in one form (NFKC), so that what looks alike is alike, and holds nothing that cannot
be read: no control or format characters, no halves of characters. Whoever shows it still escapes.
"""

from __future__ import annotations

import re
import unicodedata
from typing import Any

from reviewer.errors import InvalidInput

UNREADABLE = {
    "Cc": "a control character",
    "Cf": "a format character",
    "Cs": "half a character",
    "Co": "a character of private use",
    "Cn": "not assigned to a character",
    "Zl": "a line separator",
    "Zp": "a paragraph separator",
}


def clean_text(
    text: str, name: str, *, longest: int, least: int = 0, lines: bool = False, fold: bool = True
) -> str:
    """Return a text as it is kept, without blanks around it.

    Args:
        name: what it is, for messages.
        least, longest: bounds of its length in characters.
        lines: whether it may have several lines, and tabs.
        fold: bring it into NFKC; not for names that something else made, which are looked up.

    Raises:
        InvalidInput: when it is too long or too short, or holds what cannot be read.
    """
    if lines:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    text = text.strip()
    # Bounded before it is folded, which may make it eighteen times as long.
    if fold and len(text) <= 2 * longest:
        text = unicodedata.normalize("NFKC", text).strip()
    if not least <= len(text) <= longest:
        raise InvalidInput(
            f"{name}: must have {least} to {longest} characters, but has {len(text)}"
        )
    for place, character in enumerate(text, start=1):
        kind = UNREADABLE.get(unicodedata.category(character))
        if kind and not (lines and character in "\n\t"):
            raise InvalidInput(f"{name}: holds U+{ord(character):04X}, {kind}, at position {place}")
    return text


def as_cell(value: Any) -> Any:
    """Return a value for a cell of CSV; a text that a spreadsheet would compute gets a `'`."""
    computed = isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r"))
    return f"'{value}" if computed else value


def as_latex(text: str) -> str:
    """Return a text that LaTeX prints as it was typed."""
    return "".join(_LATEX.get(character, character) for character in text)


def as_markdown(text: str) -> str:
    """Return a text that shows in a cell of a Markdown table as it was typed, on one line."""
    return re.sub(r"([\\|`*_\[\]<>])", r"\\\1", " ".join(text.split()))


_LATEX = {character: rf"\{character}" for character in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}
