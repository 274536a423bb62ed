"""How two runs differ: in settings, by split, and by pair, over the pixels that both have seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.evaluation.predicting import Interval
from reviewer.evaluation.protocols import Protocol, paired_change, protocol_lines
from reviewer.evaluation.seen_by_both import scores_seen_by_both
from reviewer.evaluation.tables import MEAN, METHOD_TITLE, Line, table_lines
from reviewer.metrics import f_score, total, unseen_share
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.runs import run_of_name
from reviewer.store.scores import PairScore, pair_scores, split_scores
from reviewer.words import Method

MOST_CHANGED = 10


@dataclass(frozen=True, slots=True)
class Comparison:
    """Rows of three tables: settings that differ, splits, and the pairs that changed most; the
    change of the mean F with its 95 % interval over pairs; and the share of the pixels that each
    run has not seen in these pairs, by its name."""

    settings: list[dict[str, Any]]
    splits: list[dict[str, Any]]
    pairs: list[dict[str, Any]]
    change: Interval
    unseen: dict[str, float]

    def record(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        return asdict(self)


def mean_lines(store: Store, run: str) -> dict[Method, Line]:
    """Return the mean over splits by method, of the counts that are up to date."""
    lines = table_lines(split_scores(store, run))
    return {line.method: line for line in lines if line.split == MEAN}


def compare_runs(store: Store, first: str, second: str, method: str) -> Comparison:
    """Compare two runs by one method, over the pixels that both have seen.

    Raises:
        NotFound: when a run does not exist.
        InvalidInput: when the method is unknown.
    """
    known = next((m for m in METHOD_TITLE if m == method), None)
    if known is None:
        raise InvalidInput(f"method {method!r}: is none of {', '.join(METHOD_TITLE)}")
    runs = [run_of_name(store, name) for name in (first, second)]
    flat = [flat_settings(run.settings) for run in runs]
    settings = [
        {"setting": key, first: flat[0].get(key), second: flat[1].get(key)}
        for key in sorted({*flat[0], *flat[1]})
        if flat[0].get(key) != flat[1].get(key)
    ]
    ours, theirs = scores_seen_by_both(store, runs[0], runs[1], known)
    pairs = _pair_rows(store, ours, theirs, first, second)
    both = {score.pair_id for score in ours}
    return Comparison(
        settings,
        _split_rows(ours, theirs, first, second),
        [row for row in pairs if row["change"]][:MOST_CHANGED],
        paired_change(ours, theirs),
        {
            name: unseen_share(
                total(
                    score.counts
                    for score in pair_scores(store, name)
                    if score.method == known and score.pair_id in both
                )
            )
            for name in (first, second)
        },
    )


def _split_rows(
    ours: Sequence[PairScore], theirs: Sequence[PairScore], first: str, second: str
) -> list[dict[str, Any]]:
    """Return one row per split and their mean."""
    lines = [protocol_lines(scores, Protocol()) for scores in (ours, theirs)]
    return [
        {
            "split": a.split,
            "pairs": a.pairs,
            "unseen": a.unseen,
            first: a.f_score,
            second: b.f_score,
            "change": b.f_score - a.f_score,
        }
        for a, b in zip(*lines, strict=True)
    ]


def _pair_rows(
    store: Store, ours: Sequence[PairScore], theirs: Sequence[PairScore], first: str, second: str
) -> list[dict[str, Any]]:
    """Return one row per pair, what changed most first."""
    titles = {pair.id: pair.title for pair in list_pairs(store)}
    rows = []
    for a, b in zip(ours, theirs, strict=True):
        f, other = f_score(a.counts), f_score(b.counts)
        rows.append({"pair": titles[a.pair_id], first: f, second: other, "change": other - f})
    return sorted(rows, key=lambda row: (-abs(row["change"]), row["pair"]))


def flat_settings(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the settings of a run by dotted name: model_settings.detect.middle."""
    found: dict[str, Any] = {}
    for key, value in settings.items():
        if isinstance(value, dict):
            found.update(flat_settings(value, f"{prefix}{key}."))
        else:
            found[prefix + key] = value
    return found
