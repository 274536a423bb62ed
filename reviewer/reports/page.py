"""The evaluation as one self-contained HTML page: tables, plots, failures."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import IO, Any

import numpy as np
from matplotlib.figure import Figure

from reviewer.errors import NotFound
from reviewer.evaluation.audit import AuditReport, audit_report
from reviewer.evaluation.basis import truth_basis
from reviewer.evaluation.counting import refresh_counts
from reviewer.evaluation.outcomes import refresh_terms, run_terms
from reviewer.evaluation.predictors import predictor_rows, seen_text
from reviewer.evaluation.protocols import Protocol, protocol_lines
from reviewer.evaluation.rules import rule_of_run, vary_rule
from reviewer.evaluation.shapes import shape_rows
from reviewer.evaluation.table_a import table_a_rows
from reviewer.evaluation.tables import DASH, MEAN, Line, short_row, unseen_text
from reviewer.records import Run
from reviewer.reports.audit_figure import draw_predictors
from reviewer.reports.rows_figure import draw_rows, telling_pairs
from reviewer.reports.split_figure import draw_splits
from reviewer.reports.table_a_text import scope_rows
from reviewer.store.audit_rows import audit_rows
from reviewer.store.database import Store
from reviewer.store.pairs import list_pairs
from reviewer.store.runs import list_runs
from reviewer.store.scores import pair_scores
from reviewer.store.skips import count_skips, skipped_line
from reviewer.version import VERSION
from reviewer.words import Standing

STEPS = 101
TELLING = 8

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1100px; margin: 0 auto; padding: 28px;
  color: #1e232b; background: #fff; }
h1 { font-size: 24px; margin: 0; } h2 { font-size: 18px; margin: 34px 0 8px; }
p { margin: 4px 0 12px; max-width: 48em; } .soft { color: #636d7b; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 14px; }
th { text-align: left; font-weight: 600; border-bottom: 1.5px solid #1e232b; }
th, td { padding: 3px 14px 3px 0; } td:not(:first-child), th { white-space: nowrap; }
td.number { text-align: right; }
tr.mean td { font-weight: 650; border-bottom: 1px solid #d6dbe2; }
img { max-width: 100%; display: block; margin: 6px 0; } details { margin: 8px 0; }
summary { cursor: pointer; color: #14828c; }
"""


def report_page(
    store: Store,
    run: str | None,
    protocol: Protocol,
    told: Callable[[str], None],
    standings: Sequence[Standing] = (),
) -> str:
    """Return the page of one run, or of all.

    Args:
        told: called with each step.
        standings: see `pair_scores`.

    Raises:
        NotFound: when no run has a prediction of a pair with ground truth.
    """
    told("counts")
    refresh_counts(store)
    scores = pair_scores(store, run, standings)
    lines = protocol_lines(scores, protocol)
    if not lines:
        raise NotFound("report: no run has a prediction of a pair with ground truth")
    runs = [each for each in list_runs(store) if any(line.run == each.name for line in lines)]
    told("objects and borders")
    shapes = shape_rows(store, run, standings=standings)
    counted = {score.pair_id for score in scores}
    rows = table_a_rows(store, scores, protocol)
    parts = [_head(lines, protocol, truth_basis(store, standings))]
    if skipped := count_skips(store):
        parts.append(f'<p class="soft">Left out: {skipped_line(skipped)}.</p>')
    parts += ["<h2>Mean F</h2>", _table(scope_rows(rows))]
    parts += ["<h2>By split</h2>", _picture(lambda file: draw_splits(rows, file), "F by split")]
    parts.append(f"<details><summary>numbers</summary>{_lines_table(lines)}</details>")
    parts += [
        "<h2>Objects and borders</h2>",
        '<p class="soft">Precision and recall of objects at an IoU, over these pairs; mean'
        " boundary F within some pixels, and Boundary IoU of bands as deep as a share of the"
        " image's diagonal.</p>",
        _table(shapes),
    ]
    for each in runs:
        told(each.name)
        seen = next(line for line in lines if (line.run, line.split) == (each.name, MEAN))
        parts.append(_run_part(store, each, counted, unseen_text(seen.counts)))
    told("pictures")
    parts.append(_pictures(store, runs, standings))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Evaluation</title><style>{STYLE}</style></head>\n<body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )


def _head(lines: Sequence[Line], protocol: Protocol, basis: str) -> str:
    names = list(dict.fromkeys(line.run for line in lines))
    # One method of one run looks at every pair once.
    one = [
        line for line in lines if line.split != MEAN and (line.run, line.method) == _first(lines)
    ]
    ignored = sum(line.counts.ignored for line in one)
    pixels = sum(_pixels(line) for line in one)
    rule = {
        "pooled": "pixels are pooled inside a group",
        "image_mean": f"F is averaged over images (empty and rightly so: {protocol.empty})",
        "mean_pr": f"P and R are averaged over images (empty and rightly so: {protocol.empty})",
    }[protocol.kind]
    return (
        "<h1>Evaluation</h1>"
        f'<p class="soft">{len(names)} run{"s" * (len(names) != 1)} on'
        f" {basis}. {rule[0].upper()}{rule[1:]}, means weigh {protocol.weight} alike."
        f" {ignored:,} of {pixels:,} pixels are ill-posed and were left out"
        f" ({ignored / pixels if pixels else 0:.2%}). reviewer {VERSION}.</p>"
    )


def _first(lines: Sequence[Line]) -> tuple[str, str]:
    return lines[0].run, lines[0].method


def _pixels(line: Line) -> int:
    c = line.counts
    return c.tp + c.fp + c.fn + c.tn + c.ignored + c.unseen_px


def _run_part(store: Store, run: Run, counted: Collection[int], unseen: str) -> str:
    """What a run has not seen and what it decided: F under other thresholds, decisions against the
    oracle's, DoI as a sign of errors."""
    refresh_terms(store, run)
    terms = run_terms(store, run, counted)
    parts = [f"<h2>{html.escape(run.name)}</h2>"]
    rule = rule_of_run(run.settings)
    members = (
        f"{run.aligner}, {run.detector}, {run.settings.get('labeller')}, {run.segmenter};"
        f" scope {rule.scope}, f_b = 0: {rule.seen}"
    )
    parts.append(f'<p class="soft">{html.escape(members)}. {unseen}.</p>')
    if terms.pair_ids:
        values = np.linspace(0.0, 1.01, STEPS)
        engine = terms.whatif
        curve = engine.sweep([vary_rule(rule, "high", float(v)) for v in values]).mean_f()
        levels = {
            "detector alone": float(engine.base().mean_f()[0]),
            f"oracle, scope {rule.scope}": float(engine.oracle(rule.scope, rule.seen).mean_f()[0]),
        }
        parts.append(
            _picture(
                lambda file: _draw_curve(values, curve, levels, rule.high, file),
                "mean F by threshold",
            )
        )
    rows = [row for row in audit_rows(store, run.id) if row.pair_id in counted]
    if rows:
        found = audit_report(rows, rule.seen)
        parts.append(_audit_text(found))
        parts.append(_table(predictor_rows(found.predictors)))
        parts.append(f'<p class="soft">{html.escape(seen_text(found.seen))}.</p>')
        draw = partial(draw_predictors, found.predictors)
        parts.append(_picture(draw, "DoI and errors"))
        parts.append(
            "<details><summary>decisions by split, label, size and reason</summary>"
            f"{_table(found.confusion)}<br>{_table(found.groups)}<br>{_table(found.verdicts)}"
            "</details>"
        )
    return "\n".join(parts)


def _audit_text(found: AuditReport) -> str:
    right = sum(row["right"] for row in found.groups if row["by"] == "split")
    return (
        f"<p>{found.regions} regions, {found.counted} with something to decide; {right} of these"
        " decisions leave as few wrong pixels as any. DoI as a predictor of detector errors, with"
        " 95 % intervals over pairs:</p>"
    )


def _draw_curve(
    values: Any, curve: Any, levels: Mapping[str, float], now: float, file: IO[bytes]
) -> None:
    figure = Figure(figsize=(7.5, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.plot(values, curve, color="#14828c", linewidth=2.5, label="mean F")
    for (name, level), colour in zip(levels.items(), ("#e8590c", "#7048e8"), strict=True):
        axes.axhline(level, color=colour, linestyle="--", linewidth=1, label=name)
    axes.axvline(now, color="#868e96", linewidth=1, label="threshold of the run")
    axes.set(xlabel="adopt where DoI is below", ylabel="F", xlim=(0, 1.01))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(file, dpi=110)


def _pictures(store: Store, runs: Sequence[Run], standings: Sequence[Standing]) -> str:
    """Figure F of pairs in which DoI gained and lost most, by the newest run."""
    titles = telling_pairs(store, runs[-1], TELLING, standings)
    by_title = {pair.title: pair for pair in list_pairs(store)}
    pairs = [by_title[title] for title in titles]
    if not pairs:
        return ""
    shown = runs[-2:]
    about = (
        f"First the pairs in which DoI gained most in {html.escape(runs[-1].name)}, then those in"
        " which it lost most, or whose F is lowest."
    )
    picture = _picture(lambda file: draw_rows(store, shown, pairs, file), "masks of pairs")
    return f'<h2>Gains and failures</h2><p class="soft">{about}</p>{picture}'


def _picture(draw: Callable[[IO[bytes]], None], title: str) -> str:
    buffer = io.BytesIO()
    draw(buffer)
    data = base64.b64encode(buffer.getvalue()).decode()
    return f'<img alt="{html.escape(title)}" src="data:image/png;base64,{data}">'


def _lines_table(lines: Sequence[Line]) -> str:
    return _table([short_row(line) for line in lines], strong="split")


def _table(rows: Sequence[Mapping[str, Any]], strong: str = "") -> str:
    if not rows:
        return '<p class="soft">none</p>'
    head = "".join(f"<th>{html.escape(str(column))}</th>" for column in rows[0])
    body = "".join(
        f'<tr class="{"mean" if strong and row[strong] == MEAN else ""}">'
        + "".join(_cell(value) for value in row.values())
        + "</tr>"
        for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _cell(value: Any) -> str:
    if value is None:
        return f'<td class="number">{DASH}</td>'
    if isinstance(value, float):
        return f'<td class="number">{value:.4f}</td>'
    if isinstance(value, int):
        return f'<td class="number">{value}</td>'
    return f"<td>{html.escape(str(value))}</td>"
