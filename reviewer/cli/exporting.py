"""`export`: what comes out of the store, in the format that the next tool reads."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, Database, Splits, app, open_store
from reviewer.words import ExportFormat, FoldKind, IgnoreMode


@app.command()
def export(
    format: Annotated[ExportFormat, typer.Argument(help="Format of the export.")],
    target: Annotated[Path, typer.Argument(help="New folder, or file for coco.")],
    split: Splits = None,
    state: Annotated[
        list[str] | None, typer.Option(help="Only pairs in this review state; repeatable.")
    ] = None,
    annotator: Annotated[
        list[str] | None, typer.Option(help="Only masks that this person wrote last; repeatable.")
    ] = None,
    verdict: Annotated[
        list[str] | None,
        typer.Option(help="Only pairs with a region whose newest verdict is this; repeatable."),
    ] = None,
    least_px: Annotated[int | None, typer.Option(help="Fewest changed pixels.")] = None,
    most_px: Annotated[int | None, typer.Option(help="Most changed pixels.")] = None,
    run: Annotated[
        str | None, typer.Option(help="Export the final masks of this run instead of ground truth.")
    ] = None,
    ignore_unseen: Annotated[
        bool,
        typer.Option(
            "--ignore-unseen", help="With --run: what it has not seen goes with ill-posed pixels."
        ),
    ] = False,
    consensus: Annotated[
        int,
        typer.Option(
            help="Export the pixels that more than half of the people agree on, where at least this"
            " many finished; ties are ill-posed. 0 = ground truth.",
            min=0,
        ),
    ] = 0,
    with_skipped: Annotated[
        bool, typer.Option("--with-skipped", help="Include pairs skipped as badly aligned.")
    ] = False,
    warped_by: Annotated[
        str | None, typer.Option(help="t0t1: references warped to live by this run.")
    ] = None,
    ignore: Annotated[
        IgnoreMode,
        typer.Option(help="t0t1: ill-posed pixels in ignore/, as 255, or nowhere."),
    ] = "separate",
    by: Annotated[FoldKind, typer.Option(help="folds: what is held out.")] = "same-split",
    parts: Annotated[int, typer.Option(help="folds: parts of same-split.")] = 5,
    per_component: Annotated[
        bool, typer.Option("--per-component", help="coco: one annotation per component.")
    ] = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Export masks, all-zero ones included, with a manifest of hashes; complete or not at all.

    png: a tree of masks. coco: one JSON file; coco-panoptic: with PNGs. t0t1: pictures and masks to
    train on; webdataset: the same as tar shards; huggingface: as Parquet. labelme, cvat, yolo-seg:
    for those tools. folds: lists of pairs to train and to test on. The same command resumes an
    export that was stopped.
    """
    from reviewer.export.formats import Options, export_as
    from reviewer.export.selection import Selection, select_labelled
    from reviewer.export.skipped import leave_out_skipped
    from reviewer.store.runs import run_of_name
    from reviewer.store.skips import skipped_line

    selection = Selection(
        splits=tuple(split or ()),
        states=tuple(state or ()),
        annotators=tuple(annotator or ()),
        least_px=least_px,
        most_px=most_px,
        run=run,
        ignore_unseen=ignore_unseen,
        verdicts=tuple(verdict or ()),
        consensus=consensus,
    )
    with open_store(db) as store:
        if not with_skipped:
            selection = leave_out_skipped(store, selection)
        labelled, without = select_labelled(store, selection)
        warper = run_of_name(store, warped_by) if warped_by else None
        options = Options(warper, ignore, by, parts, per_component)
        count = export_as(store, format, labelled, target, selection, options)
    what = "folds" if format == "folds" else "masks"
    typer.echo(f"{count} {what} in {target}; {len(without)} pairs have none")
    if selection.skipped:
        typer.echo(f"left out: {skipped_line(len(selection.skipped))}")
