"""The evaluation table: pooled pixels inside a split, unweighted mean over splits.

The paper's protocol: P, R and F from total pixel counts of a split, "Mean F-Score" over the twelve
splits (Table A). Rows are run x method; `base` is the detector alone, `doi` with DoI, `audited`
after people's verdicts.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from reviewer.metrics import Counts, f_score, precision, recall
from reviewer.records import Method, Score

METHOD_TITLE: dict[Method, str] = {
    "base": "without DoI",
    "doi": "with DoI",
    "audited": "after audit",
}
MEAN = "mean"


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the table; the mean over splits carries pooled counts for reference only."""

    run: str
    method: Method
    split: str
    pairs: int
    counts: Counts
    precision: float
    recall: float
    f_score: float


def table_lines(scores: Sequence[Score]) -> list[Line]:
    """Return a line a split and a mean line for every run and method, in that order."""
    groups: dict[tuple[str, Method], list[Line]] = {}
    for s in scores:
        line = Line(
            s.run,
            s.method,
            s.split,
            s.pairs,
            s.counts,
            precision(s.counts),
            recall(s.counts),
            f_score(s.counts),
        )
        groups.setdefault((s.run, s.method), []).append(line)
    lines: list[Line] = []
    order = list(METHOD_TITLE)
    for (run, method), own in sorted(groups.items(), key=lambda g: (g[0][0], order.index(g[0][1]))):
        lines += own
        lines.append(_mean(run, method, own))
    return lines


def _mean(run: str, method: Method, lines: Sequence[Line]) -> Line:
    number = len(lines)
    return Line(
        run,
        method,
        MEAN,
        sum(line.pairs for line in lines),
        sum((line.counts for line in lines), Counts()),
        sum(line.precision for line in lines) / number,
        sum(line.recall for line in lines) / number,
        sum(line.f_score for line in lines) / number,
    )


def format_lines(lines: Sequence[Line], form: Literal["json", "csv", "markdown"]) -> str:
    """Write lines as text; numbers keep all their digits in JSON and CSV."""
    rows = [_row(line) for line in lines]
    if form == "json":
        return json.dumps(rows, indent=1)
    if form == "csv":
        buffer = io.StringIO()
        writer = csv.DictWriter(buffer, fieldnames=list(_COLUMNS), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
        return buffer.getvalue().rstrip("\n")
    return _markdown(lines)


_COLUMNS = ("run", "method", "split", "pairs", "precision", "recall", "f_score",
            "tp", "fp", "fn", "tn", "ignored")  # fmt: skip


def _row(line: Line) -> dict[str, str | int | float]:
    counts = line.counts
    return {
        "run": line.run,
        "method": line.method,
        "split": line.split,
        "pairs": line.pairs,
        "precision": line.precision,
        "recall": line.recall,
        "f_score": line.f_score,
        "tp": counts.tp,
        "fp": counts.fp,
        "fn": counts.fn,
        "tn": counts.tn,
        "ignored": counts.ignored,
    }


def _markdown(lines: Sequence[Line]) -> str:
    out = ["| run | method | split | pairs | P | R | F |", "|---|---|---|---:|---:|---:|---:|"]
    for line in lines:
        numbers = f"{line.precision:.4f} | {line.recall:.4f} | {line.f_score:.4f}"
        cells = f"{line.run} | {METHOD_TITLE[line.method]} | {line.split} | {line.pairs}"
        row = f"| {cells} | {numbers} |"
        out.append(row.replace(f"| {MEAN} |", f"| **{MEAN}** |"))
    return "\n".join(out)
