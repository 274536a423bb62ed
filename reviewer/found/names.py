"""One name for what labels call "Pen", "a pen" and "pens"."""

from __future__ import annotations

import re

UNNAMED = "unnamed"
# Names that end in s and are not plurals, or have no singular.
KEPT = {"glasses", "scissors", "headphones", "earphones", "keys", "tongs", "pliers", "tweezers"}
_ARTICLE = re.compile(r"^(?:an?|the|some|one|two|several)\s+")


def merge_name(label: str) -> str:
    """Return the name under which a label is listed: lower case, no article, the last word in the
    singular; "unnamed" for no label."""
    words = re.sub(r"[^\w\s-]", " ", label.lower())
    text = " ".join(words.replace("_", " ").split())
    while (shorter := _ARTICLE.sub("", text)) != text:
        text = shorter
    if not text:
        return UNNAMED
    *before, last = text.split()
    return " ".join([*before, _singular(last)])


def _singular(word: str) -> str:
    if word in KEPT or len(word) < 4 or word.endswith(("ss", "us", "is")):
        return word
    if word.endswith("ies"):
        return f"{word[:-3]}y"
    if word.endswith(("ches", "shes", "xes", "zes", "sses")):
        return word[:-2]
    return word.removesuffix("s")
