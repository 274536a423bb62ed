"""`train`: detectors fitted to synthetic pairs of reference images, or to ground truth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reviewer.cli.fitting import Folding, Order, train_on_synthesis, train_on_truth
from reviewer.cli.options import DEFAULT_DB, Database, app, open_store
from reviewer.cli.synthesis import (
    Category,
    Coco,
    CocoImages,
    LeastArea,
    Seed,
    Synthesis,
    TrainOn,
    open_bank,
    read_synthesis,
)
from reviewer.errors import InvalidInput
from reviewer.words import FoldKind, NetName, Precision, Preprocessing, RecipeName

if TYPE_CHECKING:
    from reviewer.synthesis.bank import Bank


@app.command()
def train(
    detector: Annotated[NetName, typer.Argument(help="Which net.")],
    name: Annotated[
        str | None, typer.Option(help="Name of the training; else the net's, or NET-truth.")
    ] = None,
    from_ground_truth: Annotated[
        bool,
        typer.Option(
            "--from-ground-truth",
            help="Train on the stored masks, a net a fold, and run the pipeline on what they find.",
        ),
    ] = False,
    by: Annotated[
        FoldKind | None, typer.Option(help="Ground truth: what a fold holds out.  [workspace]")
    ] = None,
    parts: Annotated[
        int | None, typer.Option(help="Ground truth: folds of --by same-split.  [5]")
    ] = None,
    warped_by: Annotated[
        str | None, typer.Option(help="Ground truth: run that aligned the pairs; else the newest.")
    ] = None,
    state: Annotated[
        list[str] | None,
        typer.Option(help="Ground truth: only pairs in this review state; repeatable."),
    ] = None,
    synthetic_share: Annotated[
        float | None,
        typer.Option(
            help="Ground truth: share of synthetic pairs among those shown.  [0.5]", min=0, max=0.99
        ),
    ] = None,
    start: Annotated[
        Path | None, typer.Option(help="Checkpoint of the same net to go on from.")
    ] = None,
    split: Annotated[
        list[str] | None,
        typer.Option(
            "--split", "--splits", help="Splits it is for, cs1,cs2 or repeated; else all."
        ),
    ] = None,
    train_on: TrainOn = "same_split",
    recipe: Annotated[
        RecipeName,
        typer.Option(
            help="paper: one COCO object a pair and no other difference, an ImageNet backbone, no"
            " gradient limit, CSCDNet's last weights of 40,000 while the rate falls over 50,000."
        ),
    ] = "default",
    width: Annotated[float, typer.Option(help="Factor on channels; 1 is the paper's net.")] = 1.0,
    iterations: Annotated[int | None, typer.Option(help="Else the paper's.", min=1)] = None,
    epochs: Annotated[
        int | None,
        typer.Option(help="In place of --iterations: how often all references are shown.", min=1),
    ] = None,
    batch: Annotated[int | None, typer.Option(help="Else the paper's.", min=2)] = None,
    lr: Annotated[float | None, typer.Option(help="Else the paper's.")] = None,
    crop: Annotated[int, typer.Option(help="Side of the training squares, pixels.")] = 256,
    class_weight: Annotated[
        float, typer.Option(help="Weight of changed pixels in the loss; unchanged ones have 1.")
    ] = 1.0,
    backbone_weights: Annotated[
        str, typer.Option(help="ResNet-18 file, torchvision or timm naming; or none.")
    ] = "none",
    preprocessing: Annotated[
        Preprocessing, typer.Option(help="How pictures become numbers.")
    ] = "bgr_128",
    level: Annotated[
        int | None, typer.Option(help="cscdnet-attention: level of the mask, 2 to 5.")
    ] = None,
    strength: Annotated[
        float | None, typer.Option(help="cscdnet-attention: lambda, 0 to 1.")
    ] = None,
    source: Annotated[
        str | None, typer.Option(help="cscdnet-attention: descriptor-energy, texture-energy.")
    ] = None,
    window: Annotated[int | None, typer.Option(help="tanet: side of its window.")] = None,
    clip_norm: Annotated[
        float | None, typer.Option(help="Largest gradient norm; 0 = any.  [5]")
    ] = None,
    precision: Annotated[Precision, typer.Option(help="Of the arithmetic.")] = "auto",
    validate_every: Annotated[
        int, typer.Option(help="Iterations between two checkpoints.", min=1)
    ] = 500,
    validation_pairs: Annotated[int, typer.Option(help="Synthetic pairs of each.", min=1)] = 64,
    coco: Coco = None,
    images: CocoImages = None,
    category: Category = None,
    least_area: LeastArea = 400,
    synthesis: Synthesis = None,
    seed: Seed = 0,
    workers: Annotated[
        int, typer.Option(help="Processes that make pairs; 0 = none beside this one.", min=0)
    ] = 0,
    db: Database = DEFAULT_DB,
) -> None:
    """Train a detector on synthetic pairs, or on ground truth; the same command again goes on."""
    from reviewer.store.runs import clean_run_name
    from reviewer.training.recipes import check_paper, make_recipe

    given = {"iterations": iterations, "batch": batch, "lr": lr, "clip_norm": clip_norm}
    of_net = {"level": level, "strength": strength, "source": source, "window": window}
    training = {
        "width": width,
        "net_settings": {key: value for key, value in of_net.items() if value is not None},
        "crop_px": crop,
        "class_weights": (1.0, class_weight),
        "preprocessing": preprocessing,
        "precision": precision,
        "validate_every": validate_every,
        "validation_pairs": validation_pairs,
        "seed": seed,
        **{key: value for key, value in given.items() if value is not None},
    }
    followed = make_recipe(recipe, detector, training, read_synthesis(synthesis))
    backbone = None if backbone_weights == "none" else Path(backbone_weights)
    if recipe == "paper":
        _refuse({"--from-ground-truth": from_ground_truth}, "is no part of --recipe paper")
        check_paper(backbone, coco)
        for what, (here, there) in followed.differences().items():
            typer.echo(f"recipe paper, {what}: {here} (default {there})")
    if backbone is None and start is None:
        typer.echo("encoders start from random weights (--backbone-weights takes a ResNet-18)")
    order = Order(
        clean_run_name(name or (f"{detector}-truth" if from_ground_truth else detector)),
        followed,
        [each for text in split or [] for each in text.split(",")],
        backbone,
        start,
        workers,
        epochs,
    )
    labelled = {
        "--by": by,
        "--parts": parts,
        "--warped-by": warped_by,
        "--state": state,
        "--synthetic-share": synthetic_share,
    }
    share = 0.5 if synthetic_share is None else synthetic_share
    pasted = {"--coco": coco, "--images": images, "--category": category, "--synthesis": synthesis}
    if epochs:
        _refuse({"--iterations": iterations}, "and --epochs say the same; give one of them")
    if from_ground_truth and not share:
        _refuse(pasted, "is about synthetic pairs, of which --synthetic-share 0 shows none")
    if not from_ground_truth:
        _refuse(labelled, "belongs to --from-ground-truth, which is not given")
    else:
        _refuse(
            {"--epochs": epochs}, "counts reference images; with --from-ground-truth, --iterations"
        )
    with open_store(db) as store:

        def bank() -> Bank:
            return open_bank(store, coco, images, category, least_area, seed)

        if from_ground_truth:
            folding = Folding(by or "workspace", parts or 5, warped_by, tuple(state or ()))
            train_on_truth(store, order, folding, bank, share)
        else:
            train_on_synthesis(store, order, train_on, bank)


def _refuse(given: Mapping[str, object], why: str) -> None:
    for option, value in given.items():
        if value:
            raise InvalidInput(f"{option}: {why}")
