"""The rule of a run, and others near it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from reviewer.doi import Scope
from reviewer.errors import InvalidInput
from reviewer.evaluation.whatif import Rule


def rule_of_run(settings: Mapping[str, Any]) -> Rule:
    """Return the DoI rule that a run was made with."""
    return Rule(
        settings["low"],
        settings["high"],
        settings["max_overlap_px"],
        settings["scope"],
        settings["overlaps"],
    )


def vary_rule(rule: Rule, name: str, value: float, scope: Scope | None = None) -> Rule:
    """Return a rule with one other number, and perhaps another scope.

    Raises:
        InvalidInput: when the rule has no such number.
    """
    if scope is not None:
        rule = replace(rule, scope=scope)
    if name == "high":
        return replace(rule, high=value)
    if name == "low":
        return replace(rule, low=value)
    if name == "max_overlap_px":
        return replace(rule, max_overlap_px=int(value))
    raise InvalidInput(f"DoI rule: has no {name!r}; there are high, low and max_overlap_px")
