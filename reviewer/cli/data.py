"""`import`, `import-layer`, `export`: what goes into the store and what comes out of it."""

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
ExportName = Literal["png", "coco", "t0t1", "folds", "webdataset"]
IgnoreName = Literal["separate", "255", "none"]
FoldName = Literal["same-split", "split", "workspace"]


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


@app.command()
def export(
    format: Annotated[ExportName, typer.Argument(help="What to write.")],
    target: Annotated[Path, typer.Argument(help="New folder, or file for coco.")],
    split: Splits = None,
    state: Annotated[
        list[str] | None, typer.Option(help="Only pairs in this review state; repeatable.")
    ] = None,
    annotator: Annotated[
        list[str] | None, typer.Option(help="Only masks that this person wrote last; repeatable.")
    ] = None,
    least_px: Annotated[int | None, typer.Option(help="Fewest changed pixels.")] = None,
    most_px: Annotated[int | None, typer.Option(help="Most changed pixels.")] = None,
    run: Annotated[
        str | None, typer.Option(help="Final masks of this run in place of ground truth.")
    ] = None,
    warped_by: Annotated[
        str | None, typer.Option(help="t0t1: references warped to live by this run.")
    ] = None,
    ignore: Annotated[
        IgnoreName,
        typer.Option(help="t0t1: ill-posed pixels in ignore/, as 255, or nowhere."),
    ] = "separate",
    by: Annotated[FoldName, typer.Option(help="folds: what is held out.")] = "same-split",
    parts: Annotated[int, typer.Option(help="folds: parts of same-split.")] = 5,
    db: Database = DEFAULT_DB,
) -> None:
    """Export masks, all-zero ones included; whole or not at all, with hashes in a manifest.

    png: a tree of masks; coco: one JSON file; t0t1: pictures and masks to train on; webdataset: the
    same as tar shards; folds: lists of pairs to train and to test on.
    """
    from reviewer.export.coco import export_coco
    from reviewer.export.folds import export_folds
    from reviewer.export.png import export_png
    from reviewer.export.selection import Selection, select_labelled
    from reviewer.export.t0t1 import export_t0t1
    from reviewer.export.webdataset import export_webdataset
    from reviewer.store.runs import run_of_name

    selection = Selection(
        tuple(split or ()),
        tuple(state or ()),
        tuple(annotator or ()),
        least_px,
        most_px,
        run,
    )
    with open_store(db) as store:
        labelled, without = select_labelled(store, selection)
        if format == "coco":
            count = export_coco(labelled, target)
        elif format == "png":
            count = export_png(labelled, target, selection)
        elif format == "webdataset":
            count = export_webdataset(labelled, target, selection)
        elif format == "t0t1":
            warper = run_of_name(store, warped_by) if warped_by else None
            count = export_t0t1(store, labelled, target, selection, warped_by=warper, ignore=ignore)
        else:
            count = export_folds(store, labelled, target, selection, by, parts)
    what = "folds" if format == "folds" else "masks"
    typer.echo(f"{count} {what} in {target}; {len(without)} pairs have none")


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
