"""`whatif`: scores under other DoI rules, from stored integers."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Annotated, Any

import typer

from reviewer.cli.options import DEFAULT_DB, Database, app, open_store, print_table, progress_bar
from reviewer.errors import InvalidInput, NotFound
from reviewer.words import Scope, Seen, Vary

DEFAULT_VALUES: dict[str, str] = {
    "high": "0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8,0.85,0.9,0.95,1.01",
    "low": "0,0.01,0.02,0.05,0.1,0.2,0.3,0.4",
    "max-overlap-px": "0,5,10,20,50,100,200,500",
}


@app.command()
def whatif(
    vary: Annotated[Vary, typer.Argument(help="Parameter to vary.")] = "high",
    values: Annotated[str | None, typer.Option(help="Comma-separated values.")] = None,
    run: Annotated[str | None, typer.Option(help="Run; default: the newest.")] = None,
    scope: Annotated[Scope | None, typer.Option(help="Scope.")] = None,
    seen: Annotated[
        Seen | None,
        typer.Option(help="Regions that the reference shows too (f_b = 0): keep or reject."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON.")] = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Show F under other thresholds, overlap tolerances or scopes; no mask is changed.

    The oracle is the highest F that any decisions of the same scope have.
    """
    from reviewer.evaluation.counting import detector_counts, refresh_counts
    from reviewer.evaluation.outcomes import refresh_terms, run_terms
    from reviewer.evaluation.rules import rule_of_run, vary_rule
    from reviewer.metrics import unseen_share
    from reviewer.store.runs import run_or_newest

    with open_store(db) as store:
        chosen = run_or_newest(store, run)
        with progress_bar(chosen.name) as bar:
            refresh_terms(store, chosen, lambda done, total: bar(done, total, "terms"))
        engine = run_terms(store, chosen).whatif
        refresh_counts(store)
        unseen = unseen_share(detector_counts(store, chosen.name))
    if not engine.splits:
        raise NotFound(f"run {chosen.name}: no pair of it has both a prediction and ground truth")
    own = rule_of_run(chosen.settings)
    rule = replace(own, scope=scope or own.scope, seen=seen or own.seen)
    name = vary.replace("-", "_")
    try:
        wanted = [float(value) for value in (values or DEFAULT_VALUES[vary]).split(",")]
    except ValueError as error:
        raise InvalidInput(f"--values {values}: must be numbers with commas between") from error
    rules = [vary_rule(rule, name, value) for value in wanted]
    sweep, splits = engine.sweep(rules), engine.splits
    rows: list[dict[str, Any]] = []
    lines = {f"{vary} {value:g}": sweep.f_scores()[k] for k, value in enumerate(wanted)}
    lines["detector alone"] = engine.base().f_scores()[0]
    lines["oracle"] = engine.oracle(rule.scope, rule.seen).f_scores()[0]
    for title, scores in lines.items():
        row: dict[str, Any] = {"rule": title, "mean F": float(scores.mean()), "unseen": unseen}
        row |= {split: float(score) for split, score in zip(splits, scores, strict=True)}
        rows.append(row)
    if as_json:
        typer.echo(json.dumps(rows, indent=1))
        return
    print_table(rows, title=f"run {chosen.name}, scope {rule.scope}, f_b = 0: {rule.seen}")
