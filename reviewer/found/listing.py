"""The list of what a run found: names merged, searched, and in the order people look for things."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from reviewer.found.names import UNNAMED, merge_name
from reviewer.store.database import Store
from reviewer.store.finds import Find, list_finds

# Stamps below are seconds since the robot started, not since 1970.
FIRST_DATE = 1e8


@dataclass(frozen=True, slots=True)
class NamedFind:
    """A find under its name."""

    name: str
    find: Find

    @property
    def when(self) -> str:
        """When it was seen, UTC, or the seconds of a robot's own clock; "" when nobody knows."""
        stamp = self.find.stamp
        if stamp is None:
            return ""
        if stamp < FIRST_DATE:
            return f"{stamp:.1f} s"
        return datetime.fromtimestamp(stamp, UTC).isoformat(sep=" ", timespec="seconds")[:19]

    @property
    def place(self) -> str:
        """Where it was seen from, metres in the map; "" without a pose."""
        pose = self.find.viewpoint
        return "" if pose is None else f"{pose.x:.2f}, {pose.y:.2f}"

    @property
    def title(self) -> str:
        """The pair, the way messages name it."""
        return f"{self.find.split}/{self.find.pair}"

    @property
    def verdict(self) -> str:
        """What a person said, or what the decision is."""
        find = self.find
        if find.verdict:
            return f"{find.verdict} (a person)"
        return "look again" if find.inspect else find.outcome

    def row(self) -> dict[str, str | float]:
        """Return it as plain values."""
        return {
            "name": self.name,
            "pair": self.title,
            "seen from": self.place,
            "when": self.when,
            "DoI": self.find.doi,
            "verdict": self.verdict,
        }


def list_named_finds(
    store: Store, run_id: int, search: str = "", *, kept: bool = False
) -> list[NamedFind]:
    """Return what was found: the most frequent names first, finds without a name last.

    Args:
        search: words that name, pair, place or verdict must all hold.
        kept: also what the detector says without an object for it.
    """
    items = [
        NamedFind(find.given_name or merge_name(find.labels), find)
        for find in list_finds(store, run_id, kept=kept)
    ]
    words = search.lower().split()
    items = [item for item in items if _holds(item, words)]
    often = Counter(item.name for item in items)
    return sorted(items, key=lambda i: (i.name == UNNAMED, -often[i.name], i.name))


def named_alike(items: Sequence[NamedFind], item: NamedFind) -> list[int]:
    """Return the regions of a list that a new name of an item is for: all of its name, but of
    those that have no name only itself."""
    if item.name == UNNAMED:
        return [item.find.region_id]
    return [other.find.region_id for other in items if other.name == item.name]


def _holds(item: NamedFind, words: Sequence[str]) -> bool:
    text = " ".join(str(value) for value in item.row().values()).lower()
    text = f"{text} {item.find.labels.lower()}"
    return all(word in text for word in words)
