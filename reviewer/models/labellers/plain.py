"""Labellers without weights: a list of names, and none at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from reviewer.errors import InvalidInput
from reviewer.masks import Mask
from reviewer.models.interfaces import Image, Said
from reviewer.models.labellers.phrases import check_label


@dataclass(frozen=True, slots=True)
class NoLabeller:
    """Names nothing: for segmenters that need no name."""

    def name(self, live: Image, change: Mask, split: str) -> tuple[Said, ...]:
        """Return nothing."""
        del live, change, split
        return ()


@dataclass(frozen=True)
class VocabularyLabeller:
    """Gives the same names for every pair of a split: for people who know which objects there are.

    Attributes:
        words: names by split ("cs1"), object group ("1"), workspace ("cs") or "*" for all; the
            first of these that is there counts.
    """

    words: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Raises InvalidInput when there are no words, or what is there are no names."""
        if not self.words:
            raise InvalidInput(
                "labeller vocabulary: needs words, --labeller vocabulary:FILE.json with"
                ' {"1": ["pen", "cable"], "cs2": ["wallet"], "*": ["screw"]}'
            )
        for key, names in self.words.items():
            if isinstance(names, str) or not all(isinstance(n, str) and n.strip() for n in names):
                raise InvalidInput(
                    f"labeller vocabulary: {key!r} must be a list of names, not {names!r}"
                )
            for name in names:
                check_label(name)

    def name(self, live: Image, change: Mask, split: str) -> tuple[Said, ...]:
        """Return the names of the split; nothing where nothing has changed."""
        del live
        if not change.any():
            return ()
        workspace, group = split.rstrip("0123456789"), split[len(split.rstrip("0123456789")) :]
        for key in (split, group, workspace, "*"):
            if key in self.words:
                return tuple(Said(None, name, check_label(name)) for name in self.words[key])
        return ()
