"""Command line: one function call a command; errors a user can act on end in one line and exit 2.

Heavy libraries are imported inside the commands, so `reviewer --help` answers at once.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from reviewer.errors import InvalidInput, ReviewerError

if TYPE_CHECKING:
    from reviewer.store.database import Store

app = typer.Typer(
    name="reviewer",
    help="Build, review and audit change-detection ground truth on reference/live image pairs.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

Database = Annotated[
    Path, typer.Option("--db", envvar="REVIEWER_DB", help="SQLite database.", show_default=True)
]
ClickModel = Annotated[
    str,
    typer.Option(
        help="What answers clicks: grabcut, sam:PATH, sam2:PATH; a directory or a hub id.",
        metavar="NAME[:PATH]",
    ),
]
Splits = Annotated[list[str] | None, typer.Option("--split", help="Only these splits; repeatable.")]
DEFAULT_DB = Path("reviewer.db")


StageName = Literal["align", "detect", "search", "integrate", "all"]
LayoutName = Literal["sequence", "t0t1"]
PolarityName = Literal["auto", "white", "black"]
LayerName = Literal["detection", "live-objects", "reference-objects"]
FormatName = Literal["table", "json", "csv", "markdown"]
ExportName = Literal["png", "coco"]
ScopeName = Literal["component", "image"]


@app.command()
def demo(
    folder: Annotated[Path, typer.Option("--dir", help="Where the world is kept.")] = Path(
        "demo-data"
    ),
    pairs_per_split: Annotated[str, typer.Option(help='Pairs a split, or "paper": 1875.')] = "4",
    seed: Annotated[int, typer.Option(help="Another seed is another world.")] = 7,
    workers: Annotated[int, typer.Option(help="Processes that render.", min=1)] = 2,
    check: Annotated[bool, typer.Option("--check", help="Print the table and stop.")] = False,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The one port.")] = 8000,
    token: Annotated[str | None, typer.Option(envvar="REVIEWER_TOKEN")] = None,
    click: ClickModel = "grabcut",
) -> None:
    """Render the demo world, import it, run the weight-free pipeline, and open the app."""
    from reviewer.dataset.demo.world import plan_splits, render_world
    from reviewer.pipeline.settings import PipelineSettings

    if pairs_per_split != "paper" and not (pairs_per_split.isdigit() and int(pairs_per_split) > 0):
        raise InvalidInput(f'--pairs-per-split: a number or "paper", not {pairs_per_split!r}')
    plans = plan_splits(None if pairs_per_split == "paper" else int(pairs_per_split), seed)
    data = folder / f"world-{seed}-{pairs_per_split}"
    total = sum(plan.pairs for plan in plans)
    with _bar("render") as bar:
        done = 0
        for name, pairs in render_world(data, plans, workers=workers):
            done += pairs
            bar(done, total, name)
    with _open(data / "reviewer.db", create=True) as store:
        _import_all(store, data, "sequence", "auto", None, 0.5, 1.0)
        _run(store, None, PipelineSettings(), "all", None, workers)
        _evaluate(store, None, "table")
    if not check:
        _serve(data / "reviewer.db", host, port, token, [], click)


@app.command("import")
def import_(
    folder: Annotated[Path, typer.Argument(help="A split, or a folder of splits.")],
    layout: Annotated[LayoutName, typer.Option(help="Folder layout.")] = "sequence",
    split: Annotated[str | None, typer.Option(help="Name of the split; else the folder's.")] = None,
    polarity: Annotated[
        PolarityName, typer.Option(help="Mask colour that means changed.")
    ] = "auto",
    max_distance: Annotated[
        float, typer.Option(help="Largest viewpoint distance of a pair, metres.", min=0)
    ] = 0.5,
    metres_per_radian: Annotated[
        float, typer.Option(help="Weight of heading in that distance.", min=0)
    ] = 1.0,
    db: Database = DEFAULT_DB,
) -> None:
    """Import splits: each one whole, or not at all; splits that are there are left alone."""
    with _open(db, create=True) as store:
        _import_all(store, folder, layout, polarity, split, max_distance, metres_per_radian)


@app.command("import-layer")
def import_layer(
    kind: Annotated[LayerName, typer.Argument(help="What the files hold.")],
    folder: Annotated[Path, typer.Argument(help="DIR/<split>/<pair>.png or .npy")],
    run: Annotated[str, typer.Option(help="Run that shows it; made if it is new.")],
    segmenter: Annotated[
        str, typer.Option(help='Segmenter of a new run; "imported" for your own masks.')
    ] = "imported",
    detector: Annotated[
        str, typer.Option(help='Detector of a new run; "imported" for your own maps.')
    ] = "imported",
    split: Splits = None,
    db: Database = DEFAULT_DB,
) -> None:
    """Import your own detector's maps or object masks as layers of a run."""
    from reviewer.dataset.layers import import_layer as bring_in
    from reviewer.pipeline.fields import store_detection
    from reviewer.pipeline.runner import prepare_run
    from reviewer.pipeline.settings import PipelineSettings
    from reviewer.store.pairs import list_pairs
    from reviewer.store.runs import list_runs, run_of_name

    with _open(db) as store:
        if run not in {known.name for known in list_runs(store)}:
            prepare_run(store, run, PipelineSettings(detector=detector, segmenter=segmenter))
        report = bring_in(
            store,
            run_of_name(store, run),
            kind,
            folder,
            list_pairs(store, split or []),
            lambda probability, threshold: store_detection(probability, threshold, 0.0),
        )
    for title in report.without_file:
        typer.echo(f"without a file: {title}")
    typer.echo(f"{report.imported} pairs got {kind}, {len(report.without_file)} have none")
    typer.echo(f"next: reviewer run all --name {run}")


@app.command()
def run(
    stage: Annotated[StageName, typer.Argument(help="Stage, or all of them.")] = "all",
    name: Annotated[str | None, typer.Option(help="Name of the run.")] = None,
    aligner: Annotated[str | None, typer.Option(help="dis, homography")] = None,
    detector: Annotated[str | None, typer.Option(help="difference, imported")] = None,
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

    given: dict[str, Any] = {
        "aligner": aligner,
        "detector": detector,
        "segmenter": segmenter,
        "scope": scope,
        "low": low,
        "high": high,
        "threshold": threshold,
    }
    given = {key: value for key, value in given.items() if value is not None}
    with _open(db) as store:
        stored = {known.name: known.settings for known in list_runs(store)}.get(name or "", {})
        if {"aligner", "detector", "segmenter"} & set(given):
            # The stored settings of a member do not fit another one.
            stored = {key: value for key, value in stored.items() if key != "model_settings"}
        settings = PipelineSettings.of_record({**stored, **given})
        _run(store, name, settings, stage, split, workers)


@app.command()
def evaluate(
    run: Annotated[str | None, typer.Option(help="Only this run.")] = None,
    format: Annotated[FormatName, typer.Option(help="How to write it.")] = "table",
    db: Database = DEFAULT_DB,
) -> None:
    """Print P, R and F: pixels pooled inside a split, unweighted mean over splits."""
    with _open(db) as store:
        _evaluate(store, run, format)


@app.command()
def export(
    format: Annotated[ExportName, typer.Argument(help="png: a tree; coco: one JSON file.")],
    target: Annotated[Path, typer.Argument(help="New folder or file.")],
    split: Splits = None,
    db: Database = DEFAULT_DB,
) -> None:
    """Export ground truth, all-zero masks included; whole or not at all."""
    from reviewer.export.coco import export_coco
    from reviewer.export.png import export_png
    from reviewer.export.selection import select_labelled

    with _open(db) as store:
        labelled, without = select_labelled(store, split or [])
        writer = export_png if format == "png" else export_coco
        count = writer(labelled, target)
    typer.echo(f"{count} masks in {target}; {len(without)} pairs have no ground truth")


@app.command()
def serve(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The one port.")] = 8000,
    token: Annotated[
        str | None, typer.Option(envvar="REVIEWER_TOKEN", help="Sign-in token; else a new one.")
    ] = None,
    allow_host: Annotated[
        list[str] | None, typer.Option(help="Further host names of this server; repeatable.")
    ] = None,
    click: ClickModel = "grabcut",
    db: Database = DEFAULT_DB,
) -> None:
    """Open the app on one port and print the link to sign in with."""
    _serve(db, host, port, token, allow_host or [], click)


@app.command()
def schema() -> None:
    """Print the database schema as Markdown (this is db/README.md)."""
    from reviewer.store.describe import describe_schema

    typer.echo(describe_schema())


def main() -> None:
    """Entry point: turn errors a user can act on into one line and exit code 2."""
    try:
        app()
    except ReviewerError as error:
        typer.echo(f"reviewer: {error}", err=True)
        sys.exit(2)


def _open(path: Path, *, create: bool = False) -> Store:
    from reviewer.store.database import Store

    return Store(path, create=create)


def _import_all(
    store: Store,
    folder: Path,
    layout: LayoutName,
    polarity: PolarityName,
    split: str | None,
    max_distance: float,
    metres_per_radian: float,
) -> None:
    from reviewer.dataset.importer import ImportSettings, find_splits, import_split

    found = find_splits(folder, layout)
    if split is not None and len(found) > 1:
        raise InvalidInput(f"--split {split}: {folder} holds {len(found)} splits, name one folder")
    settings = ImportSettings(layout, polarity, max_distance, metres_per_radian)
    reports = []
    with _bar("import") as bar:
        for name, place in found:
            reports.append(
                import_split(store, split or name, place, settings, lambda s, n, t: bar(n, t, s))
            )
    for report in reports:
        for path, reason in report.skipped:
            typer.echo(f"skipped {path}: {reason}")
        if report.already_there:
            typer.echo(f"{report.split}: is in the database already")
        else:
            typer.echo(
                f"{report.split}: {report.pairs} pairs, {len(report.skipped)} files skipped,"
                f" masks: {report.polarity}"
            )
    pairs = sum(report.pairs for report in reports)
    skipped = sum(len(report.skipped) for report in reports)
    typer.echo(f"{pairs} pairs imported, {skipped} files skipped")


def _run(
    store: Store, name: str | None, settings: Any, stage: str, split: list[str] | None, workers: int
) -> None:
    from reviewer.pipeline.runner import prepare_run, run_pipeline
    from reviewer.store.pairs import list_pairs
    from reviewer.store.runs import STAGES

    opened = prepare_run(store, name, settings)
    stages = [wanted for wanted in STAGES if stage in (wanted, "all")]
    with _bar(opened.name) as bar:
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


def _evaluate(store: Store, run: str | None, form: FormatName) -> None:
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


def _serve(
    db: Path, host: str, port: int, token: str | None, allow_host: list[str], click: str
) -> None:
    from reviewer.app.server import serve_app

    serve_app(db, host=host, port=port, token=token, allow_hosts=allow_host, click=click)


@contextmanager
def _bar(title: str) -> Iterator[Any]:
    """A progress bar on the terminal: call it with (done, total, what)."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn(f"{title} {{task.description}}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, transient=True) as progress:
        task = progress.add_task("", total=None)

        def advance(done: int, total: int, what: str) -> None:
            progress.update(task, completed=done, total=total, description=what)

        yield advance
