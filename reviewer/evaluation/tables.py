"""The evaluation table: pooled pixels inside a split, unweighted mean over splits.

The paper's protocol: P, R and F from total pixel counts of a split, "Mean F-Score" over the twelve
splits (Table A). Rows are run x method; `base` is the detector alone, `doi` with DoI, `audited`
after people's verdicts.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from reviewer.metrics import Counts, f_score, precision, recall, unseen_share
from reviewer.records import Score
from reviewer.texts import as_cell, as_latex, as_markdown
from reviewer.words import Method, TextFormat

METHOD_TITLE: dict[Method, str] = {
    "base": "without DoI",
    "doi": "with DoI",
    "audited": "after audit",
}
MEAN = "mean"
DASH = "–"


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

    @property
    def unseen(self) -> float:
        """Share of the pixels that the run has not seen, in [0, 1]; they are in no score."""
        return unseen_share(self.counts)


def table_lines(scores: Sequence[Score]) -> list[Line]:
    """Return one line per split and a mean line for every run and method, in that order."""
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
    for _, own in sorted(groups.items(), key=lambda g: (g[0][0], order.index(g[0][1]))):
        lines += own
        lines.append(mean_line(own))
    return lines


def mean_line(lines: Sequence[Line], weights: Sequence[float] | None = None) -> Line:
    """Return the mean of a run's lines by one method, unweighted unless `weights` is given."""
    shares = weights or [1.0] * len(lines)
    whole = sum(shares)
    precisions, recalls, scores = (
        sum(share * value for share, value in zip(shares, values, strict=True)) / whole
        for values in (
            [line.precision for line in lines],
            [line.recall for line in lines],
            [line.f_score for line in lines],
        )
    )
    counts = sum((line.counts for line in lines), Counts())
    pairs = sum(line.pairs for line in lines)
    run, method = lines[0].run, lines[0].method
    return Line(run, method, MEAN, pairs, counts, precisions, recalls, scores)


def format_rows(rows: Sequence[Mapping[str, str | float | None]], form: TextFormat) -> str:
    """Write rows of the same columns as text; numbers keep all their digits in JSON and CSV."""
    if form == "json":
        return json.dumps(rows, indent=1)
    columns = list(rows[0]) if rows else []
    if form == "csv":
        return csv_text(rows, columns)
    cells = [[_short(row[column]) for column in columns] for row in rows]
    if form == "latex":
        return _latex(columns, cells)
    head = ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]
    return "\n".join([*head, *map(_markdown_row, cells)])


def format_lines(lines: Sequence[Line], form: TextFormat) -> str:
    """Write lines as text; numbers keep all their digits in JSON and CSV."""
    rows = [_row(line) for line in lines]
    if form == "latex":
        columns = ["run", "method", "split", "pairs", "P", "R", "F", "unseen"]
        return _latex(columns, [_cells(line) for line in lines])
    if form == "json":
        return json.dumps(rows, indent=1)
    if form == "csv":
        return csv_text(rows, _COLUMNS)
    return _markdown(lines)


def csv_text(rows: Sequence[Mapping[str, str | float | None]], columns: Sequence[str]) -> str:
    """Write rows as CSV with a head, without a line's end after the last."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, fieldnames=list(columns), lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: as_cell(value) for name, value in row.items()} for row in rows)
    return buffer.getvalue().rstrip("\n")


def _markdown_row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(as_markdown(cell) for cell in cells) + " |"


def _short(value: str | float | None) -> str:
    if value is None:
        return DASH
    return f"{value:.4f}" if isinstance(value, float) else str(value)


def shown_scores(line: Line) -> tuple[float | None, float | None, float | None]:
    """Return P, R and F for display: None where truth and prediction are empty (0/0)."""
    if line.counts.rightly_empty:
        return None, None, None
    return line.precision, line.recall, line.f_score


def _cells(line: Line) -> list[str]:
    numbers = [_short(value) for value in shown_scores(line)]
    return [
        line.run,
        METHOD_TITLE[line.method],
        line.split,
        str(line.pairs),
        *numbers,
        _short(line.unseen),
    ]


def _latex(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Write a table in the style of booktabs."""
    numeric = [all(_is_number(row[k]) for row in rows) for k in range(len(columns))]
    shape = "".join("r" if number else "l" for number in numeric)
    body = [" & ".join(as_latex(cell) for cell in row) + r" \\" for row in rows]
    head = " & ".join(as_latex(column) for column in columns) + r" \\"
    lines = [rf"\begin{{tabular}}{{{shape}}}", r"\toprule", head, r"\midrule", *body]
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"])


def _is_number(text: str) -> bool:
    return text == DASH or text.replace(".", "", 1).isdigit()


def short_row(line: Line, group: str = "split") -> dict[str, str | int | float | None]:
    """Return the columns that people read: run, method, group, pairs, P, R, F, unseen."""
    precisions, recalls, scores = shown_scores(line)
    return {
        "run": line.run,
        "method": METHOD_TITLE[line.method],
        group: line.split,
        "pairs": line.pairs,
        "P": precisions,
        "R": recalls,
        "F": scores,
        "unseen": line.unseen,
    }


def unseen_text(counts: Counts) -> str:
    """Return what of the scored pairs a run has not seen, as the line beside its scores."""
    objects = counts.unseen_objects
    return (
        f"{unseen_share(counts):.2%} of the pixels are unseen, {objects} changed"
        f" object{'s' * (objects != 1)} as a whole; they are left out"
    )


_COLUMNS = ("run", "method", "split", "pairs", "precision", "recall", "f_score", "unseen",
            "tp", "fp", "fn", "tn", "ignored", "unseen_px", "unseen_objects")  # fmt: skip


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
        "unseen": line.unseen,
        "tp": counts.tp,
        "fp": counts.fp,
        "fn": counts.fn,
        "tn": counts.tn,
        "ignored": counts.ignored,
        "unseen_px": counts.unseen_px,
        "unseen_objects": counts.unseen_objects,
    }


def _markdown(lines: Sequence[Line]) -> str:
    out = [
        "| run | method | split | pairs | P | R | F | unseen |",
        "|---|---|---|---:|---:|---:|---:|---:|",
    ]
    for line in lines:
        out.append(_markdown_row(_cells(line)).replace(f"| {MEAN} |", f"| **{MEAN}** |"))
    return "\n".join(out)
