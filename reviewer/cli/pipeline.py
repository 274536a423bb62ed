"""`run` and `evaluate`: the pipeline over the store, and the scores of what it found."""

from __future__ import annotations

from collections.abc import Mapping
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
from reviewer.errors import InvalidInput

if TYPE_CHECKING:
    from reviewer.records import Run
    from reviewer.store.database import Store

StageName = Literal["align", "detect", "label", "search", "integrate", "all"]
ScopeName = Literal["component", "image"]
EngineChoice = Literal["local", "ray"]
MEMBER_HELP = {
    "aligner": "dis, ecc, homography; loftr[:MODEL], pdcnet:DIR; files:DIR, imported",
    "detector": "difference; cscdnet:CHECKPOINT, dr-tanet:CHECKPOINT, ...; files:DIR, imported",
    "labeller": "none, vocabulary:FILE.json; llava[:MODEL], llava-alpha:FILE.pth",
    "segmenter": "oversegment; grounded-sam[:sam2:MODEL], sam-everything[:sam2:MODEL],"
    " sam3[:MODEL]; files:DIR (DIR/live, DIR/reference), imported. MODEL: directory or hub id",
}


@app.command()
def run(
    stage: Annotated[StageName, typer.Argument(help="Stage, or all of them.")] = "all",
    name: Annotated[str | None, typer.Option(help="Name of the run.")] = None,
    aligner: Annotated[str | None, typer.Option(help=MEMBER_HELP["aligner"])] = None,
    detector: Annotated[str | None, typer.Option(help=MEMBER_HELP["detector"])] = None,
    labeller: Annotated[str | None, typer.Option(help=MEMBER_HELP["labeller"])] = None,
    segmenter: Annotated[str | None, typer.Option(help=MEMBER_HELP["segmenter"])] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="STAGE.SETTING=VALUE of a member; repeatable."),
    ] = None,
    scope: Annotated[ScopeName | None, typer.Option(help="Scope of DoI.")] = None,
    low: Annotated[float | None, typer.Option(help="Adopt where DoI is above.")] = None,
    high: Annotated[float | None, typer.Option(help="Adopt where DoI is below.")] = None,
    threshold: Annotated[float | None, typer.Option(help="Changed where p is above.")] = None,
    split: Splits = None,
    workers: Annotated[int, typer.Option(help="Pairs at a time.", min=1)] = 2,
    engine: Annotated[EngineChoice, typer.Option(help="Where the work is done.")] = "local",
    address: Annotated[
        str | None, typer.Option(help="Ray cluster, such as auto or ray://host:10001.")
    ] = None,
    db: Database = DEFAULT_DB,
) -> None:
    """Run the pipeline; pairs that are done are not done again, so a killed run resumes."""
    from reviewer.pipeline.choices import FILES, read_member, read_settings
    from reviewer.pipeline.settings import IMPORTED, PipelineSettings
    from reviewer.store.runs import list_runs

    if address is not None and engine != "ray":
        raise InvalidInput(f"--address {address}: is for --engine ray")
    given: dict[str, Any] = {"scope": scope, "low": low, "high": high, "threshold": threshold}
    members: dict[str, Any] = {str(k): v for k, v in read_settings(set_ or []).items()}
    folders: dict[str, Path] = {}
    named = {"align": aligner, "detect": detector, "label": labeller, "search": segmenter}
    for (place, text), option in zip(named.items(), MEMBER_HELP, strict=True):
        if text is None:
            continue
        if text.startswith(f"{FILES}:"):
            if place == "label":
                raise InvalidInput(f"--labeller {text}: labels are no files, use vocabulary:FILE")
            folders[place] = Path(text.partition(":")[2])
            given[option] = IMPORTED
            continue
        given[option], own = read_member(f"--{option}", text)
        if own:
            members[place] = {**own, **members.get(place, {})}
    given = {key: value for key, value in given.items() if value is not None}
    with open_store(db) as store:
        stored = {known.name: known.settings for known in list_runs(store)}.get(name or "", {})
        # The stored settings of a member do not fit another one.
        kept = {
            place: own
            for (place, text), own in (
                (item, stored.get("model_settings", {}).get(item[0])) for item in named.items()
            )
            if own is not None and text is None
        }
        for place, own in members.items():
            kept[place] = {**kept.get(place, {}), **own}
        settings = PipelineSettings.of_record({**stored, **given, "model_settings": kept})
        run_stages(
            store,
            name,
            settings,
            stage,
            split,
            workers,
            engine=engine,
            address=address,
            folders=folders,
        )


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
    store: Store,
    name: str | None,
    settings: Any,
    stage: str,
    split: list[str] | None,
    workers: int,
    *,
    engine: EngineChoice = "local",
    address: str | None = None,
    folders: Mapping[str, Path] | None = None,
) -> None:
    """Open the run, bring in the layers of `folders`, do the stages; exit 1 when pairs failed."""
    from reviewer.pipeline.members import build_members
    from reviewer.pipeline.runner import prepare_run, run_pipeline
    from reviewer.store.pairs import pair_ids
    from reviewer.store.results import STAGES

    members = build_members(settings)
    opened = prepare_run(store, name, settings, members)
    for place, folder in (folders or {}).items():
        _bring_in(store, opened, place, folder, split)
    with progress_bar(opened.name) as bar:
        report = run_pipeline(
            store,
            opened,
            pair_ids(store, split or []),
            stages=[wanted for wanted in STAGES if stage in (wanted, "all")],
            engine=engine,
            address=address,
            workers=workers,
            members=members,
            progress=lambda r: bar(
                r.done + r.already_done + len(r.failures),
                r.total,
                f"{stage}, {r.pairs_per_s:.1f} pairs/s",
            ),
        )
    for failure in report.failures:
        typer.echo(f"failed: {failure}")
    before = f"{report.already_done} were done before"
    if report.taken_over:
        before += f" ({report.taken_over} by other runs)"
    typer.echo(
        f"run {report.run}: {report.done} pairs done, {before}, {len(report.failures)} failed;"
        f" {report.pairs_per_s:.1f} pairs/s"
    )
    if report.failures:
        raise typer.Exit(1)


def _bring_in(store: Store, run: Run, stage: str, folder: Path, split: list[str] | None) -> None:
    from reviewer.dataset.layers import Kind, import_layer
    from reviewer.pipeline.fields import packing
    from reviewer.store.pairs import list_pairs

    kinds: dict[str, list[tuple[Kind, Path]]] = {
        "align": [("alignment", folder)],
        "detect": [("detection", folder)],
        "search": [("live-objects", folder / "live"), ("reference-objects", folder / "reference")],
    }
    for kind, place in kinds[stage]:
        found = import_layer(store, run, kind, place, list_pairs(store, split or []), packing(run))
        typer.echo(f"{kind}: {found.imported} pairs from {place}")


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
