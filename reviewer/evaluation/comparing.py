"""How two runs differ: in settings, by split, and by pair; from stored counts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.evaluation.predicting import Interval
from reviewer.evaluation.protocols import Protocol, paired_change, protocol_lines
from reviewer.evaluation.tables import MEAN, METHOD_TITLE, Line, table_lines
from reviewer.store.database import Store
from reviewer.store.runs import run_of_name
from reviewer.store.scores import PairScore, pair_f_scores, pair_scores, split_scores
from reviewer.words import Method

MOST_CHANGED = 10


@dataclass(frozen=True, slots=True)
class Comparison:
    """Rows of three tables: settings that differ, splits, and the pairs that changed most; and the
    change of the mean F with its 95 % interval over pairs."""

    settings: list[dict[str, Any]]
    splits: list[dict[str, Any]]
    pairs: list[dict[str, Any]]
    change: Interval

    def record(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        return asdict(self)


def mean_lines(store: Store, run: str) -> dict[Method, Line]:
    """Return the mean over splits by method, of the counts that are up to date."""
    lines = table_lines(split_scores(store, run))
    return {line.method: line for line in lines if line.split == MEAN}


def compare_runs(store: Store, first: str, second: str, method: str) -> Comparison:
    """Compare two runs by one method.

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
    by_pair = [pair_f_scores(store, run.id, known) for run in runs]
    pairs = _rows("pair", by_pair[0], by_pair[1], first, second)
    pairs.sort(key=lambda row: -abs(row["change"]))
    changed = [row for row in pairs if row["change"]]
    scores = [
        [score for score in pair_scores(store, name) if score.method == known]
        for name in (first, second)
    ]
    return Comparison(
        settings,
        _split_rows(scores[0], scores[1], first, second),
        changed[:MOST_CHANGED],
        paired_change(scores[0], scores[1]),
    )


def _split_rows(
    ours: Sequence[PairScore], theirs: Sequence[PairScore], first: str, second: str
) -> list[dict[str, Any]]:
    """Return one row per split and their mean, over the pairs that both runs have."""
    both = {score.pair_id for score in ours} & {score.pair_id for score in theirs}
    lines = [
        protocol_lines([score for score in scores if score.pair_id in both], Protocol())
        for scores in (ours, theirs)
    ]
    return [
        {
            "split": a.split,
            "pairs": a.pairs,
            first: a.f_score,
            second: b.f_score,
            "change": b.f_score - a.f_score,
        }
        for a, b in zip(*lines, strict=True)
    ]


def _rows(
    title: str, ours: Mapping[str, float], theirs: Mapping[str, float], first: str, second: str
) -> list[dict[str, Any]]:
    """Return one row for each pair that both runs have."""
    return [
        {title: key, first: ours[key], second: theirs[key], "change": theirs[key] - ours[key]}
        for key in ours
        if key in theirs
    ]


def flat_settings(settings: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the settings of a run by dotted name: model_settings.detect.middle."""
    found: dict[str, Any] = {}
    for key, value in settings.items():
        if isinstance(value, dict):
            found.update(flat_settings(value, f"{prefix}{key}."))
        else:
            found[prefix + key] = value
    return found
