"""How two runs differ: in settings, by split, and by pair; from stored counts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from reviewer.errors import InvalidInput
from reviewer.evaluation.predicting import Interval
from reviewer.evaluation.protocols import paired_change
from reviewer.evaluation.tables import MEAN, METHOD_TITLE, table_lines
from reviewer.records import Method
from reviewer.store.database import Store
from reviewer.store.runs import run_of_name
from reviewer.store.scores import pair_f_scores, pair_scores, split_scores

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


def mean_scores(store: Store, run: str) -> dict[Method, float]:
    """Return the mean F over splits by method, of the counts that are up to date."""
    lines = table_lines(split_scores(store, run))
    return {line.method: line.f_score for line in lines if line.split == MEAN}


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
    by_split = [
        {
            line.split: line.f_score
            for line in table_lines(split_scores(store, name))
            if line.method == known
        }
        for name in (first, second)
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
        _rows("split", by_split[0], by_split[1], first, second),
        changed[:MOST_CHANGED],
        paired_change(scores[0], scores[1]),
    )


def _rows(
    title: str, ours: Mapping[str, float], theirs: Mapping[str, float], first: str, second: str
) -> list[dict[str, Any]]:
    """Return a row for everything that both have."""
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
