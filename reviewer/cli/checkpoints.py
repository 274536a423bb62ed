"""`checkpoint`: say what a weights file is, and give a bare one the record it lacks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from reviewer.cli.options import app
from reviewer.errors import InvalidInput
from reviewer.words import BatchNormMode, NetName, Preprocessing


@app.command()
def checkpoint(
    path: Annotated[Path, typer.Argument(help="Weights of a net: ours, or a public state dict.")],
    save: Annotated[
        Path | None, typer.Option(help="Write it here with its record, as changed below.")
    ] = None,
    net: Annotated[NetName | None, typer.Option(help="Which net, where the keys fit two.")] = None,
    preprocessing: Annotated[
        Preprocessing | None, typer.Option(help="What it was trained with.")
    ] = None,
    bn_mode: Annotated[
        BatchNormMode | None,
        typer.Option(help="Batch norm by training, or by the pair at hand (public CSCDNet)."),
    ] = None,
    refinement: Annotated[
        bool | None,
        typer.Option(
            "--refinement/--no-refinement",
            help="TANet, DR-TANet: it was trained with refinement, which the file does not tell.",
        ),
    ] = None,
    threshold: Annotated[float | None, typer.Option(help="Changed where p is above.")] = None,
    window: Annotated[
        int | None, typer.Option(help="Show it pictures in windows of this side; 0 = whole.")
    ] = None,
    changed_class: Annotated[
        int | None, typer.Option(help="Which of its two classes means changed (polarity).")
    ] = None,
) -> None:
    """Say what a checkpoint is; --save writes it with its preprocessing, threshold, polarity."""
    from dataclasses import replace

    from reviewer.models.nets.checkpoints import load_checkpoint, save_checkpoint

    module, record = load_checkpoint(path, net)
    given: dict[str, Any] = {
        "preprocessing": preprocessing,
        "bn_mode": bn_mode,
        "threshold": threshold,
        "changed_class": changed_class,
        "window_px": window,
    }
    if refinement is not None:
        if "refinement" not in record.settings:
            raise InvalidInput(f"--refinement: is about TANet and DR-TANet, not {record.net}")
        given["settings"] = {**record.settings, "refinement": refinement}
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
    typer.echo(f"pictures are shown {windows}")
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
