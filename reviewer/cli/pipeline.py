"""`run` and `evaluate`: the pipeline over the store, and the scores of what it found."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from reviewer.cli.options import (
    DEFAULT_DB,
    Database,
    FormatName,
    Splits,
    app,
    open_store,
    progress_bar,
)

if TYPE_CHECKING:
    from reviewer.store.database import Store

StageName = Literal["align", "detect", "search", "integrate", "all"]
ScopeName = Literal["component", "image"]


@app.command()
def run(
    stage: Annotated[StageName, typer.Argument(help="Stage, or all of them.")] = "all",
    name: Annotated[str | None, typer.Option(help="Name of the run.")] = None,
    aligner: Annotated[
        str | None, typer.Option(help="dis, ecc, homography; loftr or loftr:DIRECTORY-OR-HUB-ID")
    ] = None,
    detector: Annotated[
        str | None,
        typer.Option(help="difference, imported; cscdnet:CHECKPOINT, dr-tanet:CHECKPOINT, ..."),
    ] = None,
    segmenter: Annotated[str | None, typer.Option(help="oversegment, imported")] = None,
    scope: Annotated[ScopeName | None, typer.Option(help="Scope of DoI.")] = None,
    low: Annotated[float | None, typer.Option(help="Adopt where DoI is above.")] = None,
    high: Annotated[float | None, typer.Option(help="Adopt where DoI is below.")] = None,
    threshold: Annotated[float | None, typer.Option(help="Changed where p is above.")] = None,
    split: Splits = None,
    workers: Annotated[int, typer.Option(help="Pairs at a time.", min=1)] = 2,
    db: Database = DEFAULT_DB,
) -> None:
    """Run the pipeline; pairs that are done are not done again, so a killed run resumes."""
    from reviewer.pipeline.settings import PipelineSettings
    from reviewer.store.runs import list_runs

    member, _, checkpoint = (detector or "").partition(":")
    alignment, _, matcher = (aligner or "").partition(":")
    given: dict[str, Any] = {
        "aligner": alignment or None,
        "detector": member or None,
        "segmenter": segmenter,
        "scope": scope,
        "low": low,
        "high": high,
        "threshold": threshold,
    }
    given = {key: value for key, value in given.items() if value is not None}
    members: dict[str, Any] = {}
    if checkpoint:
        members["detect"] = {"checkpoint": str(Path(checkpoint).resolve())}
    if matcher:
        folder = Path(matcher)
        members["align"] = {"checkpoint": str(folder.resolve()) if folder.is_dir() else matcher}
    if members:
        given["model_settings"] = members
    with open_store(db) as store:
        stored = {known.name: known.settings for known in list_runs(store)}.get(name or "", {})
        if {"aligner", "detector", "segmenter"} & set(given):
            # The stored settings of a member do not fit another one.
            stored = {key: value for key, value in stored.items() if key != "model_settings"}
        settings = PipelineSettings.of_record({**stored, **given})
        run_stages(store, name, settings, stage, split, workers)


@app.command()
def evaluate(
    run: Annotated[str | None, typer.Option(help="Only this run.")] = None,
    format: Annotated[FormatName, typer.Option(help="How to write it.")] = "table",
    db: Database = DEFAULT_DB,
) -> None:
    """Print P, R and F: pixels pooled inside a split, unweighted mean over splits."""
    with open_store(db) as store:
        print_scores(store, run, format)


def run_stages(
    store: Store, name: str | None, settings: Any, stage: str, split: list[str] | None, workers: int
) -> None:
    from reviewer.pipeline.runner import prepare_run, run_pipeline
    from reviewer.store.pairs import list_pairs
    from reviewer.store.runs import STAGES

    opened = prepare_run(store, name, settings)
    stages = [wanted for wanted in STAGES if stage in (wanted, "all")]
    with progress_bar(opened.name) as bar:
        report = run_pipeline(
            store,
            opened,
            list_pairs(store, split or []),
            stages=stages,
            workers=workers,
            progress=lambda done, total: bar(done, total, stage),
        )
    for failure in report.failures:
        typer.echo(f"failed: {failure}")
    typer.echo(
        f"run {report.run}: {report.done} pairs done, {report.already_done} were done before,"
        f" {len(report.failures)} failed"
    )


def print_scores(store: Store, run: str | None, form: FormatName) -> None:
    from reviewer.evaluation.counting import refresh_counts
    from reviewer.evaluation.tables import METHOD_TITLE, format_lines, table_lines
    from reviewer.store.runs import run_of_name
    from reviewer.store.scores import split_scores

    if run is not None:
        run_of_name(store, run)
    refresh_counts(store)
    lines = table_lines(split_scores(store, run))
    if form != "table":
        typer.echo(format_lines(lines, form))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(title="pooled pixels a split, unweighted mean over splits")
    for column in ("run", "method", "split"):
        table.add_column(column)
    for column in ("pairs", "P", "R", "F"):
        table.add_column(column, justify="right")
    for line in lines:
        numbers = [f"{v:.4f}" for v in (line.precision, line.recall, line.f_score)]
        last = line.split == "mean"
        cells = [line.run, METHOD_TITLE[line.method], line.split, str(line.pairs), *numbers]
        table.add_row(*cells, style="bold" if last else None, end_section=last)
    Console(width=max(100, Console().width)).print(table)
