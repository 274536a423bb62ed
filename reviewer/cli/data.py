"""`import`, `import-layer`: what goes into the store."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, Database, Splits, app, open_store, progress_bar
from reviewer.errors import InvalidInput
from reviewer.words import AnnotationTool, Heading, LayerKind, Layout, Polarity

if TYPE_CHECKING:
    from reviewer.dataset.settings import ImportSettings
    from reviewer.store.database import Store

DryRun = Annotated[
    bool, typer.Option("--dry-run", help="Read and check everything, and say what would happen.")
]


@app.command("import")
def import_(
    folder: Annotated[Path, typer.Argument(help="A split, or a folder of splits.")],
    layout: Annotated[
        Layout,
        typer.Option(
            help="sequence: reference/ live/ mask/ poses.csv; t0t1: t0/ t1/ mask/, or A/ B/ label/"
            " (PCD, VL-CMU-CD, ChangeVPR, LEVIR, WHU); vl-cmu-cd: as published; pscd; changesim."
        ),
    ] = "sequence",
    split: Annotated[str | None, typer.Option(help="Name of the split; else the folder's.")] = None,
    polarity: Annotated[
        Polarity,
        typer.Option(help="Mask colour that means changed; nonzero: any grey above black."),
    ] = "auto",
    changed: Annotated[
        list[int] | None,
        typer.Option(help="Grey level of masks that means changed; repeatable."),
    ] = None,
    ignore: Annotated[
        list[int] | None,
        typer.Option(help="Grey level of masks that is not to be scored; repeatable."),
    ] = None,
    mask_threshold: Annotated[
        int | None, typer.Option(help="Changed where masks are lighter than this level.")
    ] = None,
    changed_colour: Annotated[
        str | None, typer.Option(help="Colour of masks that means changed, RRGGBB.")
    ] = None,
    max_distance: Annotated[
        float, typer.Option(help="Largest viewpoint distance of a pair, metres.", min=0)
    ] = 0.5,
    metres_per_radian: Annotated[
        float, typer.Option(help="Weight of heading in that distance.", min=0)
    ] = 1.0,
    heading: Annotated[
        Heading, typer.Option(help="Unit of theta in poses.csv; auto: radians up to a turn.")
    ] = "auto",
    skip_bad: Annotated[
        bool,
        typer.Option("--skip-bad", help="Leave out pairs with a bad file or of two sizes."),
    ] = False,
    dry_run: DryRun = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Import splits: each one whole, or not at all; splits that are there are left alone."""
    from tempfile import TemporaryDirectory

    from reviewer.dataset.settings import ImportSettings

    settings = ImportSettings(
        layout=layout,
        polarity=polarity,
        max_distance=max_distance,
        metres_per_radian=metres_per_radian,
        heading=heading,
        changed=tuple(changed or ()),
        ignore=tuple(ignore or ()),
        mask_threshold=mask_threshold,
        changed_colour=_colour(changed_colour) if changed_colour else None,
        skip_bad=skip_bad,
    )
    with TemporaryDirectory() as nowhere:
        # What would happen leaves no database behind where there was none.
        place = Path(nowhere) / "reviewer.db" if dry_run and not db.exists() else db
        with open_store(place, create=True) as store:
            import_all(store, folder, settings, split, dry_run=dry_run)


def _colour(text: str) -> tuple[int, int, int]:
    try:
        red, green, blue = bytes.fromhex(text.removeprefix("#"))
    except ValueError as error:
        raise InvalidInput(
            f"--changed-colour {text}: six hexadecimal digits are needed, such as ff0000"
        ) from error
    return red, green, blue


@app.command("import-masks")
def import_masks(
    tool: Annotated[AnnotationTool, typer.Argument(help="Whose file it is.")],
    path: Annotated[Path, typer.Argument(help="JSON, annotations.xml; labelme: a folder.")],
    label: Annotated[
        list[str] | None,
        typer.Option(help="Label that means changed, repeatable; else all but the next one."),
    ] = None,
    ill_posed: Annotated[
        str, typer.Option(help="Label of pixels that are not to be scored.")
    ] = "ill-posed",
    empty: Annotated[
        bool,
        typer.Option("--empty", help="An image without any shape means that nothing changed."),
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="Also above ground truth that is there.")
    ] = False,
    split: Splits = None,
    dry_run: DryRun = False,
    db: Database = DEFAULT_DB,
) -> None:
    """Import masks that COCO, labelme, CVAT or Label Studio files hold of live images here."""
    from reviewer.dataset.mask_importer import import_masks as bring_in

    with open_store(db) as store:
        report = bring_in(
            store,
            tool,
            path,
            splits=split or [],
            change=label or [],
            ill_posed=ill_posed,
            empty=empty,
            replace=replace,
            dry_run=dry_run,
        )
    for name, reading in report.labels.items():
        typer.echo(f"label {name!r}: {reading}")
    for name in report.strangers:
        typer.echo(f"skipped {name}: no live image of that name here (--split believes its folder)")
    for name in report.empty:
        typer.echo(f"skipped {name}: no shape in it is a mask (--empty: without any = unchanged)")
    for kind, number in sorted(report.left_out.items()):
        typer.echo(f"left out: {number} shapes of kind {kind}")
    written, zeros = len(report.written), sum(area == 0 for _, area in report.written)
    skipped = len(report.strangers) + len(report.empty)
    typer.echo(
        f"{written} masks {'would be ' if dry_run else ''}imported ({zeros} of them empty),"
        f" {report.unchanged} are there already, {skipped} images skipped"
    )


@app.command("import-layer")
def import_layer(
    kind: Annotated[LayerKind, typer.Argument(help="What the files hold.")],
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
        if run in {known.name for known in list_runs(store)}:
            opened = run_of_name(store, run)
        else:
            chosen = aligner or (IMPORTED if kind == "alignment" else DEFAULT_ALIGNER)
            settings = PipelineSettings(chosen, detector, segmenter=segmenter)
            opened = prepare_run(store, run, settings)
        report = bring_in(
            store, opened, kind, folder, list_pairs(store, split or []), packing(opened)
        )
    for title in report.without_file:
        typer.echo(f"without a file: {title}")
    typer.echo(f"{report.imported} pairs got {kind}, {len(report.without_file)} have none")
    typer.echo(f"next: reviewer run all --name {opened.name}")


def import_all(
    store: Store,
    folder: Path,
    settings: ImportSettings,
    split: str | None = None,
    *,
    dry_run: bool = False,
) -> None:
    from reviewer.dataset.importer import import_split
    from reviewer.dataset.layouts import find_splits

    found = find_splits(folder, settings.layout)
    if split is not None and len(found) > 1:
        raise InvalidInput(f"--split {split}: {folder} holds {len(found)} splits, name one folder")
    reports = []
    with progress_bar("import") as bar:
        for name, place in found:
            reports.append(
                import_split(
                    store,
                    split or name,
                    place,
                    settings,
                    lambda s, n, t: bar(n, t, s),
                    dry_run=dry_run,
                )
            )
    for report in reports:
        for path, reason in report.skipped:
            typer.echo(f"skipped {path}: {reason}")
        if report.already_there:
            typer.echo(f"{report.split}: is in the database already")
        else:
            typer.echo(
                f"{report.split}: {report.pairs} pairs, {report.masks} with a mask,"
                f" {len(report.skipped)} files skipped, masks: {report.polarity}"
            )
        for note in report.notes:
            typer.echo(f"{report.split}: {note}")
    pairs = sum(report.pairs for report in reports)
    skipped = sum(len(report.skipped) for report in reports)
    would = "would be " if dry_run else ""
    typer.echo(f"{pairs} pairs {would}imported, {skipped} files skipped")
