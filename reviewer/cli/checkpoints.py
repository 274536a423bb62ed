"""`checkpoint`: say what a weights file is, and give a bare one the record it lacks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from reviewer.cli.options import app
from reviewer.errors import InvalidInput
from reviewer.words import BatchNormMode, Merging, NetName, Preprocessing, Side


@app.command()
def checkpoint(
    path: Annotated[
        Path,
        typer.Argument(help="Weights of a net: from `reviewer train`, or a public state dict."),
    ],
    save: Annotated[
        Path | None, typer.Option(help="Write it to this file, with its record as changed below.")
    ] = None,
    net: Annotated[NetName | None, typer.Option(help="Which net, if the keys fit two.")] = None,
    backbone_weights: Annotated[
        Path | None,
        typer.Option(help="RSCD on DINOv2: the frozen DINOv2 that its file leaves out."),
    ] = None,
    preprocessing: Annotated[
        Preprocessing | None, typer.Option(help="Normalisation it was trained with.")
    ] = None,
    bn_mode: Annotated[
        BatchNormMode | None,
        typer.Option(
            help="Batch norm with statistics of the training, or of each pair (public CSCDNet)."
        ),
    ] = None,
    refinement: Annotated[
        bool | None,
        typer.Option(
            "--refinement/--no-refinement",
            help="TANet, DR-TANet: whether it was trained with refinement; the file does not say.",
        ),
    ] = None,
    merging: Annotated[
        Merging | None,
        typer.Option(help="C-3PO: the changes it was trained for, where the file does not say."),
    ] = None,
    threshold: Annotated[float | None, typer.Option(help="Changed where p is above.")] = None,
    window: Annotated[
        int | None,
        typer.Option(help="Side of the windows in which it sees pictures; 0 = whole pictures."),
    ] = None,
    squeeze: Annotated[
        int | None,
        typer.Option(help="Side of the square that pictures are squeezed to; 0 = not squeezed."),
    ] = None,
    first: Annotated[
        Side | None, typer.Option(help="Which of the two pictures it sees first.")
    ] = None,
    changed_class: Annotated[
        int | None, typer.Option(help="Which of its two classes means changed (polarity).")
    ] = None,
) -> None:
    """Describe a checkpoint; --save writes it with its preprocessing, threshold, polarity."""
    from dataclasses import replace

    from reviewer.models.nets.checkpoints import load_checkpoint, save_checkpoint

    module, record = load_checkpoint(path, net, backbone_weights)
    given: dict[str, Any] = {
        "preprocessing": preprocessing,
        "bn_mode": bn_mode,
        "threshold": threshold,
        "changed_class": changed_class,
        "window_px": window,
        "squeeze_px": squeeze,
        "first": first,
    }
    for setting, value, nets in (
        ("refinement", refinement, "TANet and DR-TANet"),
        ("merging", merging, "C-3PO"),
    ):
        if value is None:
            continue
        if setting not in record.settings:
            raise InvalidInput(f"--{setting}: is about {nets}, not {record.net}")
        given["settings"] = {**record.settings, setting: value}
        given["assumed"] = ()
    record = replace(record, **{key: value for key, value in given.items() if value is not None})
    parameters = sum(p.numel() for p in module.parameters())
    typer.echo(f"{record.net}, width {record.width:g}, {parameters / 1e6:.2f} M parameters")
    for key, value in record.settings.items():
        assumed = " (assumed: the file does not tell)" if key in record.assumed else ""
        typer.echo(f"{key}: {value}{assumed}")
    if record.settings.get("relu") == "stage":
        typer.echo("fitted by an early version, with one ReLU a stage; it keeps that arithmetic")
    typer.echo(f"preprocessing: {record.preprocessing}, bn_mode: {record.bn_mode}")
    windows = f"in windows of {record.window_px} pixels" if record.window_px else "whole"
    squeezed = f"squeezed to {record.squeeze_px} x {record.squeeze_px} pixels, "
    typer.echo(
        f"pictures are shown {squeezed if record.squeeze_px else ''}{windows}, the {record.first}"
        " one first"
    )
    typer.echo(f"changed: class {record.changed_class} where p > {record.threshold:g}")
    if record.training:
        name = next(key for key in record.training if key.endswith("_validation"))
        scores = record.training[name]
        typer.echo(
            f"trained here: iteration {record.training['iteration']}, seed"
            f" {record.training['training']['seed']}, F {scores['f_score']:.4f} on"
            f" {name.replace('_', ' ')}, data {record.training['data']['sha256'][:12]}"
        )
    if save is not None:
        save_checkpoint(save, module, record)
        typer.echo(f"next: reviewer run --detector {record.net}:{save}")
