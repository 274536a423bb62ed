"""`run` and `evaluate`: the pipeline over the store, and the scores of what it found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
    print_table,
    progress_bar,
)
from reviewer.errors import InvalidInput

if TYPE_CHECKING:
    from reviewer.evaluation.protocols import Protocol
    from reviewer.evaluation.tables import Line
    from reviewer.records import Run
    from reviewer.store.database import Store

StageName = Literal["align", "detect", "label", "search", "integrate", "all"]
ScopeName = Literal["component", "image"]
EngineChoice = Literal["local", "ray"]
ProtocolName = Literal["pooled", "image_mean", "mean_pr"]
EmptyName = Literal["skip", "one", "zero"]
GroupName = Literal["split", "workspace", "group"]
WeightName = Literal["groups", "images"]
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
    protocol: Annotated[
        ProtocolName, typer.Option(help="Pixels pooled in a group; or per image.")
    ] = "pooled",
    empty: Annotated[
        EmptyName, typer.Option(help="Per image: without change and rightly so, counts as.")
    ] = "skip",
    by: Annotated[GroupName, typer.Option(help="What a line is.")] = "split",
    weight: Annotated[WeightName, typer.Option(help="What the mean line weighs alike.")] = "groups",
    table_a: Annotated[
        bool, typer.Option("--table-a", help="One line a run: mean F without and with DoI.")
    ] = False,
    shapes: Annotated[
        bool, typer.Option("--shapes", help="Objects found at IoU 0.1, 0.25, 0.5, and borders.")
    ] = False,
    figure_e: Annotated[
        Path | None, typer.Option(help="Write bars of F by split, .png, .pdf or .svg.")
    ] = None,
    figure_f: Annotated[
        Path | None,
        typer.Option(help="Write rows of reference, live, truth and masks, .png, .pdf or .svg."),
    ] = None,
    pairs: Annotated[
        str | None, typer.Option(help="figure-f: cs1/0000,cr2/0001; else telling ones.")
    ] = None,
    rows: Annotated[int, typer.Option(help="figure-f: rows of telling pairs.", min=1)] = 6,
    report: Annotated[
        Path | None, typer.Option(help="Write one HTML page: tables, plots, failures.")
    ] = None,
    format: Annotated[FormatName, typer.Option(help="How to write it.")] = "table",
    db: Database = DEFAULT_DB,
) -> None:
    """Print P, R and F; by default pixels pooled inside a split, unweighted mean over splits."""
    from reviewer.evaluation.protocols import Protocol

    chosen = Protocol(protocol, empty, weight, by)
    with open_store(db) as store:
        if shapes:
            _print_shapes(store, run, format)
            return
        if report is not None:
            _write_report(store, run, chosen, report)
        lines = print_scores(store, run, format, chosen, table_a=table_a)
        if figure_f is not None:
            _write_rows(store, run, pairs, rows, figure_f)
    if figure_e is not None:
        from reviewer.evaluation.split_figure import draw_splits

        draw_splits(lines, figure_e)


def _write_report(store: Store, run: str | None, protocol: Protocol, path: Path) -> None:
    from reviewer.atomic import whole_file
    from reviewer.evaluation.report import report_page
    from reviewer.store.runs import run_of_name

    if run is not None:
        run_of_name(store, run)
    page = report_page(store, run, protocol, lambda step: typer.echo(f"report: {step}", err=True))
    with whole_file(path) as file:
        file.write(page.encode())
    typer.echo(f"wrote {path}, {len(page) / 1e6:.1f} MB")


def _write_rows(store: Store, run: str | None, titles: str | None, count: int, path: Path) -> None:
    from reviewer.evaluation.rows_figure import draw_rows, telling_pairs
    from reviewer.store.pairs import list_pairs
    from reviewer.store.runs import list_runs, run_of_name, run_or_newest

    runs = [run_of_name(store, run)] if run else list_runs(store)[-2:]
    wanted = titles.split(",") if titles else telling_pairs(store, run_or_newest(store, run), count)
    known = {pair.title: pair for pair in list_pairs(store)}
    for title in wanted:
        if title not in known:
            raise InvalidInput(f"--pairs {title}: there is no such pair")
    draw_rows(store, runs, [known[title] for title in wanted], path)
    typer.echo(f"wrote {path}")


def _print_shapes(store: Store, run: str | None, form: FormatName) -> None:
    from reviewer.evaluation.shapes import shape_rows
    from reviewer.evaluation.tables import format_rows
    from reviewer.store.runs import run_of_name

    if run is not None:
        run_of_name(store, run)
    with progress_bar("masks") as bar:
        rows = shape_rows(store, run, lambda done, total: bar(done, total, ""))
    if form == "table":
        print_table(rows, title="objects found at an IoU, and mean boundary F")
    else:
        typer.echo(format_rows(rows, form))


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
    only: Sequence[int] | None = None,
) -> None:
    """Open the run, bring in the layers of `folders`, do the stages (of some pairs, if named); exit
    1 when pairs failed."""
    from reviewer.pipeline.members import Members, build_members
    from reviewer.pipeline.runner import prepare_run, run_pipeline, works_here
    from reviewer.store.pairs import pair_ids
    from reviewer.store.results import STAGES

    members: Members | None = build_members(settings)
    opened = prepare_run(store, name, settings, members)
    if not works_here(engine, workers):
        members = None  # every worker builds its own; the memory is needed for those
    for place, folder in (folders or {}).items():
        _bring_in(store, opened, place, folder, split)
    with progress_bar(opened.name) as bar:
        report = run_pipeline(
            store,
            opened,
            pair_ids(store, split or []) if only is None else only,
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


def print_scores(
    store: Store,
    run: str | None,
    form: FormatName,
    protocol: Protocol | None = None,
    *,
    table_a: bool = False,
) -> list[Line]:
    from reviewer.evaluation.counting import refresh_counts
    from reviewer.evaluation.protocols import Protocol, protocol_lines
    from reviewer.evaluation.tables import format_lines, format_rows, short_row, table_a_rows
    from reviewer.store.runs import run_of_name
    from reviewer.store.scores import pair_scores
    from reviewer.store.skips import count_skips, skipped_line

    if run is not None:
        run_of_name(store, run)
    refresh_counts(store)
    if skipped := count_skips(store):
        typer.echo(f"left out: {skipped_line(skipped)}", err=True)
    chosen = protocol or Protocol()
    lines = protocol_lines(pair_scores(store, run), chosen)
    if table_a:
        rows = table_a_rows(lines)
        if form == "table":
            print_table(rows, title=f"mean F ({chosen.kind})")
        else:
            typer.echo(format_rows(rows, form))
        return lines
    if form != "table":
        typer.echo(format_lines(lines, form))
        return lines
    cells = [short_row(line, chosen.group) for line in lines]
    mean = f"mean over {chosen.weight}"
    print_table(cells, title=f"{chosen.kind} by {chosen.group}, {mean}", sections="mean")
    return lines
