"""`runs list | show | compare | delete`: what runs there are, what they did, how they differ."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reviewer.cli.options import (
    DEFAULT_DB,
    Database,
    app,
    open_store,
    print_table,
    progress_bar,
)

if TYPE_CHECKING:
    from reviewer.evaluation.swapping import Swapped
    from reviewer.store.database import Store

runs_app = typer.Typer(
    help="List, show, compare and delete runs.", no_args_is_help=True, rich_markup_mode=None
)
app.add_typer(runs_app, name="runs")

Name = Annotated[str, typer.Argument(help="Name of the run.")]
NOTABLE_UNSEEN = 0.01
"""Runs whose unseen shares differ by more have scores of their own that must not be compared."""
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON.")]


@runs_app.command("list")
def list_(as_json: AsJson = False, db: Database = DEFAULT_DB) -> None:
    """List runs: members, pairs done, failed, scored, mean F without and with DoI, unseen share."""
    from reviewer.evaluation.comparing import mean_lines
    from reviewer.evaluation.counting import refresh_counts
    from reviewer.store.runs import list_runs, run_summary

    with open_store(db) as store:
        refresh_counts(store)
        rows: list[dict[str, Any]] = []
        for run in list_runs(store):
            stages = {stage.stage: stage for stage in run_summary(store, run.id)}
            means = mean_lines(store, run.name)
            rows.append(
                {
                    "run": run.name,
                    "members": " ".join(
                        [run.aligner, run.detector, run.settings["labeller"], run.segmenter]
                    ),
                    "done": stages["integrate"].done,
                    "failed": sum(stage.failed for stage in stages.values()),
                    "scored": max((line.pairs for line in means.values()), default=0),
                    "F without DoI": means["base"].f_score if "base" in means else None,
                    "F with DoI": means["doi"].f_score if "doi" in means else None,
                    "unseen": means["base"].unseen if "base" in means else None,
                    "made": run.created_at[:16].replace("T", " "),
                }
            )
    _write(rows, as_json, "there are no runs yet; `reviewer run` makes one")


@runs_app.command()
def show(name: Name, as_json: AsJson = False, db: Database = DEFAULT_DB) -> None:
    """Show a run: settings, stages with their times, failures."""
    from reviewer.store.runs import run_failures, run_of_name, run_summary

    with open_store(db) as store:
        run = run_of_name(store, name)
        stages = run_summary(store, run.id)
        failures = run_failures(store, run.id)
    rows = [
        {
            "stage": s.stage,
            "done": s.done,
            "failed": s.failed,
            "ms a pair": f"{1000 * s.mean_seconds:.1f}",
        }
        for s in stages
    ]
    failed = [{"pair": f.pair, "stage": f.stage, "message": f.message} for f in failures]
    if as_json:
        typer.echo(
            json.dumps(
                {"run": run.name, "settings": run.settings, "stages": rows, "failures": failed},
                indent=1,
            )
        )
        return
    typer.echo(f"run {run.name}, made {run.created_at}")
    typer.echo(json.dumps(run.settings, indent=1))
    print_table(rows)
    if failed:
        print_table(failed, title=f"{len(failed)} failures")


@runs_app.command()
def compare(
    first: Annotated[str, typer.Argument(help="One run.")],
    second: Annotated[str, typer.Argument(help="The other run.")],
    method: Annotated[str, typer.Option(help="base, doi or audited.")] = "doi",
    swapped: Annotated[
        bool,
        typer.Option(
            "--swapped",
            help="Detect each pair again with reference and live swapped, and show both F: nets"
            " that only learnt an order fall.",
        ),
    ] = False,
    as_json: AsJson = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Compare two runs: settings that differ, F by split, and the pairs that changed most.

    F is over the pixels that both runs have seen.
    """
    from reviewer.evaluation.comparing import compare_runs
    from reviewer.evaluation.counting import refresh_counts

    with open_store(db) as store:
        refresh_counts(store)
        found = compare_runs(store, first, second, method)
        again = _swap(store, [first, second]) if swapped else []
    if as_json:
        more = {"swapped": [each.record() for each in again]} if swapped else {}
        typer.echo(json.dumps({**found.record(), **more}, indent=1))
        return
    print_table(found.settings, title="settings that differ")
    print_table(found.splits, title=f"F by split, {method}")
    print_table(found.pairs, title="pairs that changed most")
    c = found.change
    typer.echo(f"mean F changes by {c.value:+.4f}, 95 % over pairs: {c.low:+.4f} to {c.high:+.4f}")
    if abs(found.unseen[first] - found.unseen[second]) > NOTABLE_UNSEEN:
        fewer, most = sorted(found.unseen, key=lambda name: found.unseen[name])
        typer.echo(
            f"{most} has not seen {found.unseen[most]:.1%} of the pixels, {fewer}"
            f" {found.unseen[fewer]:.1%}: F is over the pixels that both have seen"
        )
    if swapped:
        _print_swapped(again)


def _swap(store: Store, names: Sequence[str]) -> list[Swapped]:
    from reviewer.evaluation.swapping import swap_pictures
    from reviewer.store.runs import run_of_name

    found = []
    for name in dict.fromkeys(names):
        with progress_bar(f"{name}, pictures swapped") as advance:
            found.append(swap_pictures(store, run_of_name(store, name), advance))
    return found


def _print_swapped(again: Sequence[Swapped]) -> None:
    rows = [row for each in again for row in each.splits]
    print_table(rows, title="F of the detector alone, reference and live swapped")
    for each in again:
        c = each.change
        typer.echo(
            f"{each.run}: mean F changes by {c.value:+.4f} when they are swapped, 95 % over"
            f" pairs: {c.low:+.4f} to {c.high:+.4f}"
        )
        for failure in each.failures:
            typer.echo(f"{each.run}: {failure}")


@runs_app.command()
def delete(
    name: Name,
    with_verdicts: Annotated[
        bool, typer.Option("--with-verdicts", help="Delete it even if people gave verdicts in it.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Delete a run with its layers, regions and predictions; ground truth stays."""
    from reviewer.store.runs import delete_run, run_of_name

    with open_store(db) as store:
        run_of_name(store, name)
        if not yes:
            typer.confirm(f"delete run {name}?", abort=True)
        delete_run(store, name, with_verdicts=with_verdicts)
    typer.echo(f"run {name}: deleted")


def _write(rows: list[dict[str, Any]], as_json: bool, nothing: str) -> None:
    if as_json:
        typer.echo(json.dumps(rows, indent=1))
    elif rows:
        print_table(rows)
    else:
        typer.echo(nothing)
