"""The paper's Table A: methods, first without and then with DoI, under both scopes.

One row is one method under one variant. A run was made under one scope; the other one comes from
its stored integers (`rule_scores`), so no mask is made again. Runs that share all but the training
of their detector can be one row, of mean and spread. Every row says on how many pairs it stands.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean, stdev
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.evaluation.comparing import flat_settings
from reviewer.evaluation.outcomes import refresh_terms
from reviewer.evaluation.protocols import Protocol, protocol_lines, with_unjudged
from reviewer.evaluation.rule_scores import rule_scores
from reviewer.evaluation.rules import rule_of_run
from reviewer.evaluation.tables import METHOD_TITLE
from reviewer.metrics import total, unseen_share
from reviewer.pipeline.settings import IMPORTED
from reviewer.records import Run
from reviewer.store.database import Store
from reviewer.store.runs import list_runs
from reviewer.store.scores import PairScore
from reviewer.words import METHODS, SCOPES, Seen

TITLES = {
    "dr-tanet": "DR-TANet",
    "cscdnet": "CSCDNet",
    "cscdnet-attention": "CSCDNet + Siamese attention mask",
    "tanet": "TANet",
    "cdnet": "CDNet",
    "c3po": "C-3PO",
    "rscd-dinov2": "RSCD (DINOv2)",
    "rscd-resnet18": "RSCD (ResNet-18)",
}
"""Detectors by the names that papers give them, in the order of Table A; others follow."""
OF_TRAINING = ("threshold", "model_settings.detect.checkpoint", "model_settings.detect.weights")
"""Settings in which the runs of a repeated training differ; a checkpoint says its threshold."""
AUDITED = METHOD_TITLE["audited"]
Progress = Callable[[str], None]
Repeats = Mapping[str, Sequence[str]]


@dataclass(frozen=True, slots=True)
class Row:
    """A method under a variant.

    Attributes:
        title: the method.
        runs: whose mean it is, mostly one.
        variant: "" without DoI, a scope (and what becomes of f_b = 0 where it is not kept) with
            DoI, "after audit".
        own: whether the runs were made so, and the counts are those of their masks.
        pairs: on how many it stands.
        values: F by group, and of their mean.
        spreads: sample standard deviations over the runs, by group; empty for one run.
        unseen: share of the pixels that the runs have not seen, in [0, 1].
    """

    title: str
    runs: tuple[str, ...]
    variant: str
    own: bool
    pairs: int
    values: Mapping[str, float]
    spreads: Mapping[str, float]
    unseen: float

    @property
    def text(self) -> str:
        """The first column of the table."""
        if not self.variant:
            return self.title
        if self.variant == AUDITED:
            return f"{self.title}, {AUDITED}"
        return f"{self.title} w/ DoI ({self.variant})"


@dataclass(frozen=True, slots=True)
class _Scored:
    """A run under a variant, the pairs that were scored, and the share that it has not seen."""

    own: bool
    pair_ids: frozenset[int]
    values: Mapping[str, float]
    unseen: float


def table_a_rows(
    store: Store,
    scores: Sequence[PairScore],
    protocol: Protocol,
    *,
    repeats: Repeats | None = None,
    seen: Seen | None = None,
    progress: Progress = lambda run: None,
) -> list[Row]:
    """Return the rows of all runs that have stored counts, variant by variant.

    Args:
        scores: the stored counts; pairs that are not among them are left out everywhere.
        repeats: names of rows, and the runs that each is the mean of.
        seen: what happens to regions with f_b = 0; None = as in each run.
        progress: is called with the name of each run whose terms are brought up to date.

    Raises:
        InvalidInput: when repeated runs differ in more than their training, or in their pairs.
    """
    by_run: dict[str, list[PairScore]] = {}
    for score in with_unjudged(scores):
        by_run.setdefault(score.run, []).append(score)
    runs = {run.name: run for run in list_runs(store) if run.name in by_run}
    named = _members(runs, repeats or {})
    found = {
        name: dict(_variants(store, run, by_run[name], protocol, seen, progress))
        for name, run in runs.items()
    }
    variants = list(dict.fromkeys(variant for own in found.values() for variant in own))
    variants.sort(key=lambda variant: variant == AUDITED)
    return [
        _row(title, members, variant, [found[name][variant] for name in members])
        for variant in variants
        for title, members in named
        if all(variant in found[name] for name in members)
    ]


def _variants(
    store: Store,
    run: Run,
    scores: Sequence[PairScore],
    protocol: Protocol,
    seen: Seen | None,
    progress: Progress,
) -> Iterator[tuple[str, _Scored]]:
    base, doi, audited = (
        [score for score in scores if score.method == method] for method in METHODS
    )
    if base:
        yield "", _scored(base, protocol, own=True)
    if doi:
        progress(run.name)
        refresh_terms(store, run)
        counted = {score.pair_id for score in doi}
        mine = rule_of_run(run.settings)
        for scope in SCOPES:
            rule = replace(mine, scope=scope, seen=seen or mine.seen)
            variant = scope if rule.seen == "keep" else f"{scope}, f_b = 0: {rule.seen}"
            if rule == mine:
                yield variant, _scored(doi, protocol, own=True)
                continue
            other = [s for s in rule_scores(store, run, rule) if s.pair_id in counted]
            yield variant, _scored(other, protocol, own=False)
    if audited:
        yield AUDITED, _scored(audited, protocol, own=True)


def _scored(scores: Sequence[PairScore], protocol: Protocol, *, own: bool) -> _Scored:
    values = {line.split: line.f_score for line in protocol_lines(scores, protocol)}
    unseen = unseen_share(total(score.counts for score in scores))
    return _Scored(own, frozenset(score.pair_id for score in scores), values, unseen)


def _members(runs: Mapping[str, Run], repeats: Repeats) -> list[tuple[str, tuple[str, ...]]]:
    """Return the title and the runs of every row, in the order of the paper."""
    taken: set[str] = set()
    for title, names in repeats.items():
        given = f"--repeat {title}={','.join(names)}"
        for name in names:
            if name not in runs:
                raise InvalidInput(f"{given}: no run {name} has scores")
            if name in taken:
                raise InvalidInput(f"{given}: run {name} is named twice")
            taken.add(name)
            _check_same(given, runs[names[0]], runs[name])
    titles = {
        name: name if run.detector == IMPORTED else TITLES.get(run.detector, run.detector)
        for name, run in runs.items()
    }
    alone = [name for name in runs if name not in taken]
    groups = [(title, tuple(names)) for title, names in repeats.items()]
    for name in alone:
        title = titles[name]
        several = sum(titles[other] == title for other in alone) > 1
        groups.append((f"{title} ({name})" if several else title, (name,)))
    order = list(TITLES)
    places = {name: place for place, name in enumerate(runs)}

    def place(group: tuple[str, tuple[str, ...]]) -> tuple[int, int]:
        detector = runs[group[1][0]].detector
        known = order.index(detector) if detector in order else len(order)
        return known, places[group[1][0]]

    return sorted(groups, key=place)


def _check_same(given: str, first: Run, other: Run) -> None:
    """Refuse runs that differ in more than their detector's checkpoint and its threshold."""
    ours, theirs = (_but_training(run) for run in (first, other))
    for key in sorted({*ours, *theirs}):
        if ours.get(key) != theirs.get(key):
            raise InvalidInput(
                f"{given}: {other.name} has another {key}, {theirs.get(key)}, not {ours.get(key)}"
            )


def _but_training(run: Run) -> dict[str, Any]:
    settings = flat_settings(run.settings)
    return {key: value for key, value in settings.items() if key not in OF_TRAINING}


def _row(title: str, names: tuple[str, ...], variant: str, scored: Sequence[_Scored]) -> Row:
    for name, other in zip(names[1:], scored[1:], strict=True):
        if other.pair_ids != scored[0].pair_ids:
            raise InvalidInput(
                f"--repeat {title}={','.join(names)}: {name} is scored on other pairs than"
                f" {names[0]}"
            )
    groups = list(scored[0].values)
    columns = {group: [each.values[group] for each in scored] for group in groups}
    values = {group: fmean(column) for group, column in columns.items()}
    several = len(scored) > 1
    spreads = {group: stdev(column) for group, column in columns.items()} if several else {}
    own = all(each.own for each in scored)
    unseen = fmean(each.unseen for each in scored)
    return Row(title, names, variant, own, len(scored[0].pair_ids), values, spreads, unseen)


def read_repeats(given: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return the names and runs of `NAME=run1,run2` options.

    Raises:
        InvalidInput: when one has another form, fewer than two runs, or a name twice.
    """
    found: dict[str, tuple[str, ...]] = {}
    for text in given:
        match = re.fullmatch(r"([^=]+)=([^,]+(?:,[^,]+)+)", text)
        if match is None or match[1] in found:
            raise InvalidInput(f"--repeat {text}: must be NAME=run1,run2,.. with a name of its own")
        found[match[1]] = tuple(match[2].split(","))
    return found
