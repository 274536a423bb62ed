"""Decision rules: the one of a run, and others near it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from reviewer.doi import HIGH, LOW
from reviewer.errors import InvalidInput
from reviewer.words import Overlaps, Scope, Seen


@dataclass(frozen=True, slots=True)
class Rule:
    """A decision rule; see `doi.integrate`."""

    low: float = LOW
    high: float = HIGH
    max_overlap_px: int = 0
    scope: Scope = "component"
    overlaps: Overlaps = "best"
    seen: Seen = "keep"


def rule_of_run(settings: Mapping[str, Any]) -> Rule:
    """Return the DoI rule that a run was made with."""
    return Rule(
        settings["low"],
        settings["high"],
        settings["max_overlap_px"],
        settings["scope"],
        settings["overlaps"],
        settings["seen"],
    )


def vary_rule(rule: Rule, name: str, value: float) -> Rule:
    """Return a copy of a rule with one number changed.

    Raises:
        InvalidInput: when the rule has no such number.
    """
    if name == "high":
        return replace(rule, high=value)
    if name == "low":
        return replace(rule, low=value)
    if name == "max_overlap_px":
        return replace(rule, max_overlap_px=int(value))
    raise InvalidInput(f"DoI rule: has no {name!r}; there are high, low and max_overlap_px")
