"""What a table of scores is based on: how many pairs, which masks, and what is left out."""

from __future__ import annotations

from collections.abc import Sequence

from reviewer.store.database import Store
from reviewer.store.truth import count_standings, count_unfinished
from reviewer.words import STANDINGS, Standing

TITLES: dict[Standing, str] = {
    "approved": "approved",
    "submitted": "submitted",
    "confirmed_empty": "confirmed empty",
    "imported": "imported",
}


def truth_basis(store: Store, standings: Sequence[Standing] = ()) -> str:
    """Return one sentence that belongs above every table of scores.

    Args:
        standings: what the table is narrowed to; all where empty.
    """
    counted = count_standings(store)
    taken = {s: counted[s] for s in standings or STANDINGS if counted[s]}
    number = sum(taken.values())
    parts = ", ".join(f"{many} {TITLES[standing]}" for standing, many in taken.items())
    text = f"ground truth of {number} pair{'s' * (number != 1)}" + (f": {parts}" if parts else "")
    unfinished = count_unfinished(store)
    left = [f"{unfinished} unfinished"] if unfinished else []
    other = sum(counted.values()) - number
    left += [f"{other} of another state"] if other else []
    return text + (f"; left out: {', '.join(left)}" if left else "")
