"""How counts of pairs become one score: pooled, per image, or from mean P and R.

All are arithmetic on the counts of pairs, so every protocol of every run is a matter of
milliseconds. An image in which nothing has changed and nothing was found has no F of its own (0/0):
`empty` says whether it is left out, counts 1, or counts 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from reviewer.evaluation.predicting import Interval
from reviewer.evaluation.tables import METHOD_TITLE, Line, mean_line
from reviewer.metrics import Counts, f_score, precision, recall, total
from reviewer.store.scores import PairScore
from reviewer.words import EmptyRule, LineGroup, LineWeight, Method, ProtocolKind

RESAMPLES = 1000


@dataclass(frozen=True, slots=True)
class Protocol:
    """How to score.

    Attributes:
        kind: "pooled" sums pixels over a group (the paper's); "image_mean" averages F over images;
            "mean_pr" averages P and R over images and takes F of the averages.
        empty: what an image without change counts in which nothing was found. One whose changes
            are all unseen, or that is unseen as a whole, counts nothing: nobody knows.
        weight: the mean line weighs groups alike (the paper's), or by their images.
        group: what a line is: a split, a workspace, or an object group.
    """

    kind: ProtocolKind = "pooled"
    empty: EmptyRule = "skip"
    weight: LineWeight = "groups"
    group: LineGroup = "split"


def protocol_lines(scores: Sequence[PairScore], protocol: Protocol) -> list[Line]:
    """Return one line per group and a mean line for every run and method, in that order."""
    found: dict[tuple[str, Method], dict[str, list[Counts]]] = {}
    for score in with_unjudged(scores):
        groups = found.setdefault((score.run, score.method), {})
        groups.setdefault(_group_of(score, protocol.group), []).append(score.counts)
    order = list(METHOD_TITLE)
    lines: list[Line] = []
    for (run, method), groups in sorted(
        found.items(), key=lambda entry: (entry[0][0], order.index(entry[0][1]))
    ):
        own = [
            _line(run, method, name, counts, protocol) for name, counts in sorted(groups.items())
        ]
        images = [float(line.pairs) for line in own] if protocol.weight == "images" else None
        lines += [*own, mean_line(own, images)]
    return lines


def with_unjudged(scores: Sequence[PairScore]) -> list[PairScore]:
    """Return the scores with those "after audit" completed in runs that have any.

    A pair without verdicts keeps the mask with DoI, so all methods of a run are scored on the same
    pairs.
    """
    judged = {(score.run, score.pair_id) for score in scores if score.method == "audited"}
    runs = {run for run, _ in judged}
    unjudged = [
        replace(score, method="audited")
        for score in scores
        if score.method == "doi" and score.run in runs and (score.run, score.pair_id) not in judged
    ]
    return [*scores, *unjudged]


def _group_of(score: PairScore, group: LineGroup) -> str:
    if group == "split":
        return score.split
    if group == "workspace":
        return score.workspace or score.split
    return score.split if score.object_group is None else f"group {score.object_group}"


def _line(run: str, method: Method, name: str, counts: list[Counts], protocol: Protocol) -> Line:
    pooled = total(counts)
    if protocol.kind == "pooled":
        p, r, f = precision(pooled), recall(pooled), f_score(pooled)
    else:
        p, r, f = _per_image(counts, protocol)
    return Line(run, method, name, len(counts), pooled, p, r, f)


def _per_image(counts: list[Counts], protocol: Protocol) -> tuple[float, float, float]:
    """Return mean P and R over images, and the mean F or the F of these means."""
    empty = {"one": 1.0, "zero": 0.0}.get(protocol.empty)
    rows = []
    for c in counts:
        if c.tp + c.fp + c.fn:
            rows.append((precision(c), recall(c), f_score(c)))
        elif empty is not None and not c.unseen_objects and (c.tn or not c.unseen_px):
            rows.append((empty, empty, empty))
    if not rows:
        return 0.0, 0.0, 0.0
    p, r, f = (float(value) for value in np.mean(rows, axis=0))
    if protocol.kind == "mean_pr":
        f = 2 * p * r / (p + r) if p + r else 0.0
    return p, r, f


def paired_change(
    first: Sequence[PairScore], second: Sequence[PairScore], *, seed: int = 0
) -> Interval:
    """Return the change of the mean F over splits (pooled) from one run to another, with its 95 %
    bootstrap interval: pairs are drawn anew inside each split, the same ones for both.

    Pairs that only one of them has are left out.
    """
    ours = {score.pair_id: score for score in first}
    theirs = {score.pair_id: score for score in second}
    splits: dict[str, list[int]] = {}
    for pair_id in sorted(ours.keys() & theirs.keys()):
        splits.setdefault(ours[pair_id].split, []).append(pair_id)
    if not splits:
        return Interval(float("nan"), float("nan"), float("nan"))
    rng = np.random.default_rng(seed)
    value, drawn = 0.0, np.zeros(RESAMPLES)
    for ids in splits.values():
        tables = [_table([found[k].counts for k in ids]) for found in (ours, theirs)]
        here = rng.integers(0, len(ids), (RESAMPLES, len(ids)))
        value += _f_of(tables[1].sum(axis=0)) - _f_of(tables[0].sum(axis=0))
        drawn += _f_of(tables[1][here].sum(axis=1)) - _f_of(tables[0][here].sum(axis=1))
    low, high = np.quantile(drawn / len(splits), (0.025, 0.975))
    return Interval(float(value) / len(splits), float(low), float(high))


def _table(counts: Sequence[Counts]) -> np.ndarray:
    return np.array([(c.tp, c.fp, c.fn) for c in counts], np.int64)


def _f_of(table: np.ndarray) -> np.ndarray:
    """Return F of counts (..., 3): TP, FP, FN; 0 where all are 0."""
    tp, fp, fn = table[..., 0], table[..., 1], table[..., 2]
    return np.asarray(2 * tp / np.maximum(2 * tp + fp + fn, 1))
