"""From a labeller's sentence to the name of an object.

The paper asks "What is the class name of this object? Please answer like 'This object is ...'" and
drops labels that contain "floor" (section "Object Search"); the rest here is our reading: quotes,
articles and the full stop go, lower case stays.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from reviewer.errors import InvalidInput

PROMPT = (
    "What is the class name of this object? Please answer like 'This object is ...'"  # the paper's
)
STOP_LIST = ("floor",)
LONGEST = 80

_OPENING = re.compile(
    r"^.*?\b(?:this|the|that|it)(?:\s+\w+){0,3}?\s+(?:is|are|appears to be|looks like)\s+",
    re.IGNORECASE | re.DOTALL,
)
_ARTICLE = re.compile(r"^(?:an?|the|some|called|named|most likely|likely|probably)\s+")


def parse_label(raw: str, stop_list: Sequence[str] = STOP_LIST) -> tuple[str, str]:
    """Return (label, note); the label is "" where there is nothing to search for, the note why.

    Only the first sentence counts. A label that contains a word of the stop list is dropped, and so
    is one of more than 80 characters: that is no name.
    """
    text = re.split(r"[.!?\n](?:\s|$)", raw.strip(), maxsplit=1)[0]
    text = _OPENING.sub("", text.strip().strip("'\"“”"), count=1)
    label = " ".join(text.lower().strip(" .,;:'\"“”").split())
    while (shorter := _ARTICLE.sub("", label)) != label:
        label = shorter
    label = label.strip(" .,;:'\"“”")
    if not label:
        return "", "nothing was said"
    if len(label) > LONGEST:
        return "", f"too long for a name: {len(label)} characters, at most {LONGEST}"
    for stopped in stop_list:
        if stopped.lower() in label:
            return "", f"in the stop list: {stopped}"
    return label, ""


def check_label(text: str) -> str:
    """Return a person's label in the form that is searched for; "" searches for nothing.

    Raises:
        InvalidInput: when it is too long for a name.
    """
    label = " ".join(text.lower().strip(" .").split())
    if len(label) > LONGEST:
        raise InvalidInput(f"label: has {len(label)} characters, but a name has at most {LONGEST}")
    return label
