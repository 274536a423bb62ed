"""`audit report`: decisions against the oracle's, and DoI as a predictor of detector errors."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, Database, app, open_store, print_table, progress_bar
from reviewer.errors import NotFound
from reviewer.words import Seen

audit_app = typer.Typer(
    help="Report on the decisions of a run.", no_args_is_help=True, rich_markup_mode=None
)
app.add_typer(audit_app, name="audit")


@audit_app.callback()
def _audit() -> None:
    """Report on the decisions of a run."""


@audit_app.command()
def report(
    run: Annotated[str | None, typer.Option(help="Run; default: the newest.")] = None,
    seen: Annotated[
        Seen | None,
        typer.Option(help="What happens to regions with f_b = 0; default: as in the run."),
    ] = None,
    figure: Annotated[
        Path | None, typer.Option(help="Write risk-coverage and reliability, .png or .pdf.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON.")] = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Compare decisions with the oracle's, and rate DoI as a predictor of detector errors."""
    from reviewer.evaluation.audit import audit_report
    from reviewer.evaluation.outcomes import refresh_terms
    from reviewer.evaluation.predictors import predictor_rows, seen_text
    from reviewer.evaluation.rules import rule_of_run
    from reviewer.store.audit_rows import audit_rows
    from reviewer.store.runs import run_or_newest

    with open_store(db) as store:
        chosen = run_or_newest(store, run)
        with progress_bar(chosen.name) as bar:
            refresh_terms(store, chosen, lambda done, total: bar(done, total, "outcomes"))
        rows = audit_rows(store, chosen.id)
    if not rows:
        raise NotFound(f"run {chosen.name}: no region of it lies in a pair with ground truth")
    decided = seen or rule_of_run(chosen.settings).seen
    found = audit_report(rows, decided)
    if figure is not None:
        from reviewer.reports.audit_figure import draw_predictors

        draw_predictors(found.predictors, figure)
    if as_json:
        typer.echo(json.dumps(found.record(), indent=1))
        return
    typer.echo(
        f"run {chosen.name}, scope {chosen.settings['scope']}, f_b = 0: {decided}:"
        f" {found.regions} regions, {found.counted} with something to decide"
    )
    print_table(found.confusion, title="decisions and the oracle's (fewer wrong pixels)")
    print_table(found.groups, title="where decisions are right, and what the wrong ones cost")
    print_table(found.verdicts, title="verdicts of people")
    people = found.people
    if people.things:
        typer.echo(
            f"{people.things} regions were judged by two or more: {people.share:.1%} of opinions"
            f" agree, Krippendorff's alpha {people.alpha:.3f}"
        )
    title = "DoI as a predictor of detector errors, 95 % intervals over pairs"
    print_table(predictor_rows(found.predictors), title=title)
    typer.echo(seen_text(found.seen))
