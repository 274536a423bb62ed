"""Table A as text: the paper's form in Markdown and LaTeX, plain values, and a short table of runs.

Called by the command line, the report and the Scores tab; `table_a` makes the rows.
"""

from __future__ import annotations

from collections.abc import Sequence

from reviewer.evaluation.table_a import AUDITED, Row
from reviewer.evaluation.tables import MEAN, METHOD_TITLE, csv_text, format_rows
from reviewer.texts import as_latex, as_markdown
from reviewer.words import TextFormat

Value = str | int | float | None


def groups_of(rows: Sequence[Row]) -> list[str]:
    """Return the mean, then the groups that any row has."""
    return [MEAN, *sorted({group for row in rows for group in row.values} - {MEAN})]


def columns_of(rows: Sequence[Row]) -> list[str]:
    """Return the column titles of `table_a_cells`."""
    return ["Method", "pairs", "unseen", "Mean F", *groups_of(rows)[1:]]


def scope_rows(rows: Sequence[Row]) -> list[dict[str, Value]]:
    """Return a short table: one row per method, what was not seen, mean F by variant; None where a
    run has none."""
    found: dict[tuple[str, ...], dict[str, Value]] = {}
    titles = {"": METHOD_TITLE["base"], AUDITED: AUDITED}
    columns = list(dict.fromkeys(row.variant for row in rows))
    for row in rows:
        short = found.setdefault(
            row.runs, {"run": ", ".join(row.runs), "pairs": row.pairs, "unseen": row.unseen}
        )
        for variant in columns:
            short.setdefault(titles.get(variant, f"with DoI ({variant})"), None)
        short[titles.get(row.variant, f"with DoI ({row.variant})")] = row.values[MEAN]
    return list(found.values())


def table_a_cells(rows: Sequence[Row], bold: str = "{}", sign: str = "±") -> list[list[str]]:
    """Return the cells as text: method, pairs, unseen, mean F, F by group; the best F is bold."""
    groups = groups_of(rows)
    best = {
        group: max(round(row.values[group], 4) for row in rows if group in row.values)
        for group in groups
    }
    lines = []
    for row in rows:
        cells = [_cell(row, group, best[group], bold, sign) for group in groups]
        lines.append([row.text, str(row.pairs), f"{row.unseen:.4f}", *cells])
    return lines


def _cell(row: Row, group: str, best: float, bold: str, sign: str) -> str:
    if group not in row.values:
        return "-"
    text = f"{row.values[group]:.4f}"
    if group in row.spreads:
        text += f" {sign} {row.spreads[group]:.4f}"
    return bold.format(text) if round(row.values[group], 4) == best else text


def table_a_text(rows: Sequence[Row], form: TextFormat) -> str:
    """Write the table; numbers keep all their digits in JSON and CSV."""
    if form in ("json", "csv"):
        records = [row_record(row, rows) for row in rows]
        return format_rows(records, form) if form == "json" else csv_text(records, list(records[0]))
    head = columns_of(rows)
    if form == "markdown":
        body = [[as_markdown(first), *rest] for first, *rest in table_a_cells(rows, "**{}**")]
        return "\n".join(f"| {' | '.join(cells)} |" for cells in [head, ["---"] * len(head), *body])
    lines = [rf"\begin{{tabular}}{{l{'r' * (len(head) - 1)}}}", r"\toprule", _latex_line(head)]
    cells = table_a_cells(rows, r"\textbf{{{}}}", r"$\pm$")
    before = None
    for row, (first, *rest) in zip(rows, cells, strict=True):
        if row.variant != before:
            lines.append(r"\midrule")
        before = row.variant
        lines.append(" & ".join([as_latex(first), *rest]) + r" \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"])


def _latex_line(cells: Sequence[str]) -> str:
    return " & ".join(as_latex(cell) for cell in cells) + r" \\"


def row_record(row: Row, rows: Sequence[Row]) -> dict[str, Value]:
    """Return a row as plain values; spreads are there where any of `rows` has one."""
    record: dict[str, Value] = {
        "method": row.title,
        "DoI": row.variant,
        "run": ", ".join(row.runs),
        "pairs": row.pairs,
        "unseen": row.unseen,
    }
    several = any(each.spreads for each in rows)
    for group in groups_of(rows):
        record[group] = row.values.get(group)
        if several:
            record[f"{group} spread"] = row.spreads.get(group)
    return record
