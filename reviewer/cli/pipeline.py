"""`run` and `evaluate`: the pipeline over the store, and the scores of what it found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reviewer.cli.options import (
    DEFAULT_DB,
    TERMINAL,
    Database,
    Splits,
    app,
    open_store,
    print_table,
    progress_bar,
    require_pairs,
)
from reviewer.errors import InvalidInput
from reviewer.words import (
    EmptyRule,
    EngineName,
    LineGroup,
    LineWeight,
    ProtocolKind,
    Scope,
    Seen,
    StageOrAll,
    TableFormat,
)

if TYPE_CHECKING:
    from reviewer.evaluation.protocols import Protocol
    from reviewer.pipeline.runner import RunReport
    from reviewer.store.database import Store
    from reviewer.words import Standing

MEMBER_HELP = {
    "aligner": "dis, ecc, homography; loftr[:MODEL], pdcnet:DIR; files:DIR, imported",
    "detector": "siamese-lite, difference; dinov2[:MODEL]; cscdnet:CHECKPOINT,"
    " dr-tanet:CHECKPOINT, ...; files:DIR, imported",
    "labeller": "none, vocabulary:FILE.json; llava[:MODEL], llava-alpha:FILE.pth",
    "segmenter": "object-net, oversegment; grounded-sam[:sam2:MODEL],"
    " sam-everything[:sam2:MODEL], sam3[:MODEL]; files:DIR (DIR/live, DIR/reference),"
    " imported. MODEL: directory or hub id",
}


@app.command()
def run(
    stage: Annotated[StageOrAll, typer.Argument(help="Stage, or all of them.")] = "all",
    name: Annotated[str | None, typer.Option(help="Name of the run.")] = None,
    aligner: Annotated[str | None, typer.Option(help=MEMBER_HELP["aligner"])] = None,
    detector: Annotated[str | None, typer.Option(help=MEMBER_HELP["detector"])] = None,
    labeller: Annotated[str | None, typer.Option(help=MEMBER_HELP["labeller"])] = None,
    segmenter: Annotated[str | None, typer.Option(help=MEMBER_HELP["segmenter"])] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", help="STAGE.SETTING=VALUE of a member; repeatable."),
    ] = None,
    scope: Annotated[Scope | None, typer.Option(help="Scope of DoI.")] = None,
    seen: Annotated[
        Seen | None,
        typer.Option(
            help="Regions that the reference shows too (f_b = 0): keep M_o (the paper), or reject."
        ),
    ] = None,
    low: Annotated[float | None, typer.Option(help="Adopt where DoI is above.")] = None,
    high: Annotated[float | None, typer.Option(help="Adopt where DoI is below.")] = None,
    threshold: Annotated[float | None, typer.Option(help="Changed where p is above.")] = None,
    split: Splits = None,
    workers: Annotated[int, typer.Option(help="Pairs processed at a time.", min=1)] = 2,
    engine: Annotated[EngineName, typer.Option(help="Where pairs are processed.")] = "local",
    address: Annotated[
        str | None, typer.Option(help="Ray cluster, such as auto or ray://host:10001.")
    ] = None,
    db: Database = DEFAULT_DB,
) -> None:
    """Run the pipeline; finished pairs are skipped, so a stopped run resumes."""
    from reviewer.flows.running import RunOrder, run_stages
    from reviewer.pipeline.choices import FILES, read_member, read_settings
    from reviewer.pipeline.settings import IMPORTED, PipelineSettings
    from reviewer.store.runs import list_runs

    if address is not None and engine != "ray":
        raise InvalidInput(f"--address {address}: is for --engine ray")
    given: dict[str, Any] = {"scope": scope, "seen": seen, "low": low, "high": high}
    given["threshold"] = threshold
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
        require_pairs(store)
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
        order = RunOrder(
            settings,
            name,
            stage,
            tuple(split or ()),
            folders=folders,
            workers=workers,
            engine=engine,
            address=address,
        )
        print_run(run_stages(store, order, TERMINAL))


@app.command()
def evaluate(
    run: Annotated[str | None, typer.Option(help="Only this run.")] = None,
    protocol: Annotated[
        ProtocolKind, typer.Option(help="pooled: pixels pooled in a group; others: per image.")
    ] = "pooled",
    empty: Annotated[
        EmptyRule,
        typer.Option(help="Per image: how an image counts whose truth and mask are both empty."),
    ] = "skip",
    by: Annotated[LineGroup, typer.Option(help="What one row stands for.")] = "split",
    weight: Annotated[
        LineWeight, typer.Option(help="What has equal weight in the mean.")
    ] = "groups",
    state: Annotated[
        list[str] | None,
        typer.Option(
            help="Only pairs whose ground truth is approved, submitted, confirmed_empty or"
            " imported; repeatable. By default all of these; unfinished masks never score."
        ),
    ] = None,
    table_a: Annotated[
        bool,
        typer.Option(
            "--table-a", help="The paper's Table A: methods without and with DoI, both scopes."
        ),
    ] = False,
    matrix: Annotated[
        bool, typer.Option("--matrix", help="Matrix of training data by test data (--by).")
    ] = False,
    repeat: Annotated[
        list[str] | None,
        typer.Option(help="NAME=run1,run2: one row, mean and spread; for tables, figure-e."),
    ] = None,
    seen: Annotated[
        Seen | None,
        typer.Option(help="Tables: what happens to regions with f_b = 0; default: as in each run."),
    ] = None,
    shapes: Annotated[
        bool, typer.Option("--shapes", help="Objects at IoU 0.1, 0.25, 0.5; boundary F and IoU.")
    ] = False,
    figure_e: Annotated[
        Path | None, typer.Option(help="Write bars of F by split, .png, .pdf or .svg.")
    ] = None,
    figure_f: Annotated[
        Path | None,
        typer.Option(help="Write rows of reference, live, truth and masks, .png, .pdf or .svg."),
    ] = None,
    pairs: Annotated[
        str | None,
        typer.Option(help="figure-f: pairs such as cs1/0000,cr2/0001; default: telling ones."),
    ] = None,
    rows: Annotated[int, typer.Option(help="figure-f: rows of telling pairs.", min=1)] = 6,
    report: Annotated[
        Path | None, typer.Option(help="Write one HTML page: tables, plots, failures.")
    ] = None,
    format: Annotated[TableFormat, typer.Option(help="Output format.")] = "table",
    db: Database = DEFAULT_DB,
) -> None:
    """Print P, R and F; by default pixels pooled inside a split, unweighted mean over splits."""
    from reviewer.evaluation.basis import truth_basis
    from reviewer.evaluation.protocols import Protocol
    from reviewer.store.truth import check_standings

    chosen = Protocol(protocol, empty, weight, by)
    standings = check_standings(state or (), "--state")
    with open_store(db) as store:
        require_pairs(store)
        if shapes:
            typer.echo(truth_basis(store, standings), err=format != "table")
            _print_shapes(store, run, standings, format)
            return
        if report is not None:
            _write_report(store, run, chosen, standings, report)
        if table_a or matrix or figure_e is not None:
            from reviewer.cli.tables import draw_figure_e, print_rows, table_rows

            typer.echo(truth_basis(store, standings), err=format != "table")
            found = table_rows(store, run, chosen, standings, repeat or [], seen)
            title = f"F ({chosen.kind}), mean over {chosen.weight}"
            if table_a:
                print_rows(store, found, "table_a", format, title)
            if matrix:
                print_rows(store, found, "matrix", format, title)
            if figure_e is not None:
                draw_figure_e(found, figure_e)
        if not (table_a or matrix):
            print_scores(store, run, format, chosen, standings)
        if figure_f is not None:
            _write_rows(store, run, pairs, rows, standings, figure_f)


def _write_report(
    store: Store,
    run: str | None,
    protocol: Protocol,
    standings: Sequence[Standing],
    path: Path,
) -> None:
    from reviewer.atomic import whole_file
    from reviewer.reports.page import report_page
    from reviewer.store.runs import run_of_name

    if run is not None:
        run_of_name(store, run)
    page = report_page(
        store, run, protocol, lambda step: typer.echo(f"report: {step}", err=True), standings
    )
    with whole_file(path) as file:
        file.write(page.encode())
    typer.echo(f"wrote {path}, {len(page) / 1e6:.1f} MB")


def _write_rows(
    store: Store,
    run: str | None,
    titles: str | None,
    count: int,
    standings: Sequence[Standing],
    path: Path,
) -> None:
    from reviewer.reports.rows_figure import draw_rows, telling_pairs
    from reviewer.store.pairs import list_pairs
    from reviewer.store.runs import list_runs, run_of_name, run_or_newest

    runs = [run_of_name(store, run)] if run else list_runs(store)[-2:]
    shown = run_or_newest(store, run)
    wanted = titles.split(",") if titles else telling_pairs(store, shown, count, standings)
    known = {pair.title: pair for pair in list_pairs(store)}
    for title in wanted:
        if title not in known:
            raise InvalidInput(f"--pairs {title}: there is no such pair")
    draw_rows(store, runs, [known[title] for title in wanted], path)
    typer.echo(f"wrote {path}")


def _print_shapes(
    store: Store, run: str | None, standings: Sequence[Standing], form: TableFormat
) -> None:
    from reviewer.evaluation.shapes import shape_rows
    from reviewer.evaluation.tables import format_rows
    from reviewer.store.runs import run_of_name

    if run is not None:
        run_of_name(store, run)
    with progress_bar("masks") as bar:
        rows = shape_rows(store, run, lambda done, total: bar(done, total, ""), standings)
    if form == "table":
        title = "objects at an IoU; mean boundary F within pixels, IoU of bands by diagonal"
        print_table(rows, title=title)
    else:
        typer.echo(format_rows(rows, form))


def print_run(report: RunReport) -> None:
    """Say what a run did; exit 1 when pairs failed."""
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


def print_scores(
    store: Store,
    run: str | None,
    form: TableFormat,
    protocol: Protocol | None = None,
    standings: Sequence[Standing] = (),
) -> None:
    from reviewer.evaluation.basis import truth_basis
    from reviewer.evaluation.counting import refresh_counts
    from reviewer.evaluation.protocols import Protocol, protocol_lines
    from reviewer.evaluation.tables import MEAN, format_lines, short_row, unseen_text
    from reviewer.store.runs import run_of_name
    from reviewer.store.scores import pair_scores
    from reviewer.store.skips import count_skips, skipped_line

    if run is not None:
        run_of_name(store, run)
    refresh_counts(store)
    if skipped := count_skips(store):
        typer.echo(f"left out: {skipped_line(skipped)}", err=True)
    chosen = protocol or Protocol()
    lines = protocol_lines(pair_scores(store, run, standings), chosen)
    # What is read by machines stays as it is; people read on the other channel.
    typer.echo(truth_basis(store, standings), err=form != "table")
    unseen: dict[str, dict[str, None]] = {}
    for line in lines:
        if line.split == MEAN:
            unseen.setdefault(unseen_text(line.counts), {})[line.run] = None
    for text, names in unseen.items():
        typer.echo(f"{', '.join(names)}: {text}", err=form != "table")
    if form != "table":
        typer.echo(format_lines(lines, form))
        return
    cells = [short_row(line, chosen.group) for line in lines]
    mean = f"mean over {chosen.weight}"
    print_table(cells, title=f"{chosen.kind} by {chosen.group}, {mean}", sections="mean")
