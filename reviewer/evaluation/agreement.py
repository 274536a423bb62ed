"""How far people agree on regions that they both judged.

Krippendorff's alpha for nominal values (Content Analysis, 2004, ch. 11): 1 - D_o / D_e, where D_o
is the share of disagreeing pairs of opinions on one thing, D_e the share among all opinions mixed.
It takes any number of people, and things that only some of them judged.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement on things that two or more people judged.

    Attributes:
        things: how many such things.
        share: mean share of agreeing pairs of people, in [0, 1]; NaN without any.
        alpha: Krippendorff's alpha, at most 1; NaN without any, or where all said the same.
    """

    things: int
    share: float
    alpha: float


def agreement(opinions: Sequence[Sequence[str]]) -> Agreement:
    """Return how far people agree.

    Args:
        opinions: what was said of each thing, an entry a person.
    """
    shared = [said for said in opinions if len(said) > 1]
    if not shared:
        return Agreement(0, float("nan"), float("nan"))
    shares = [_agreeing(Counter(said)) / (len(said) * (len(said) - 1)) for said in shared]
    weights = [len(said) for said in shared]
    whole = sum(weights)
    observed = 1 - sum(w * share for w, share in zip(weights, shares, strict=True)) / whole
    mixed: Counter[str] = Counter()
    for said in shared:
        mixed.update(said)
    expected = 1 - _agreeing(mixed) / (whole * (whole - 1))
    alpha = 1 - observed / expected if expected else float("nan")
    return Agreement(len(shared), sum(shares) / len(shares), alpha)


def _agreeing(said: Counter[str]) -> int:
    """Ordered pairs of opinions that are the same."""
    return sum(count * (count - 1) for count in said.values())
