"""`import`, `import-layer`: what goes into the store."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from reviewer.cli.options import DEFAULT_DB, Database, Splits, app, open_store, progress_bar
from reviewer.errors import InvalidInput

if TYPE_CHECKING:
    from reviewer.store.database import Store

LayoutName = Literal["sequence", "t0t1"]
PolarityName = Literal["auto", "white", "black"]
LayerName = Literal["alignment", "detection", "live-objects", "reference-objects"]


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
    with open_store(db, create=True) as store:
        import_all(store, folder, layout, polarity, split, max_distance, metres_per_radian)


@app.command("import-layer")
def import_layer(
    kind: Annotated[LayerName, typer.Argument(help="What the files hold.")],
    folder: Annotated[Path, typer.Argument(help="DIR/<split>/<pair>.png, .npy; flows .flo, .npy")],
    run: Annotated[str, typer.Option(help="Run that shows it; made if it is new.")],
    segmenter: Annotated[
        str, typer.Option(help='Segmenter of a new run; "imported" for your own masks.')
    ] = "imported",
    detector: Annotated[
        str, typer.Option(help='Detector of a new run; "imported" for your own maps.')
    ] = "imported",
    aligner: Annotated[
        str | None, typer.Option(help='Aligner of a new run; "imported" for your own flows.')
    ] = None,
    split: Splits = None,
    db: Database = DEFAULT_DB,
) -> None:
    """Import your own flows, detector's maps or object masks as layers of a run."""
    from reviewer.dataset.layers import import_layer as bring_in
    from reviewer.pipeline.fields import packing
    from reviewer.pipeline.runner import prepare_run
    from reviewer.pipeline.settings import DEFAULT_ALIGNER, IMPORTED, PipelineSettings
    from reviewer.store.pairs import list_pairs
    from reviewer.store.runs import list_runs, run_of_name

    with open_store(db) as store:
        if run not in {known.name for known in list_runs(store)}:
            chosen = aligner or (IMPORTED if kind == "alignment" else DEFAULT_ALIGNER)
            prepare_run(store, run, PipelineSettings(chosen, detector, segmenter=segmenter))
        opened = run_of_name(store, run)
        report = bring_in(
            store, opened, kind, folder, list_pairs(store, split or []), packing(opened)
        )
    for title in report.without_file:
        typer.echo(f"without a file: {title}")
    typer.echo(f"{report.imported} pairs got {kind}, {len(report.without_file)} have none")
    typer.echo(f"next: reviewer run all --name {run}")


def import_all(
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
    with progress_bar("import") as bar:
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
