"""The options of `train`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, Database
from reviewer.cli.synthesis import (
    Category,
    Coco,
    CocoImages,
    LeastArea,
    Seed,
    Synthesis,
    TrainOn,
)
from reviewer.words import FoldKind, Precision, Preprocessing, RecipeName, Trainable


@dataclass(frozen=True)
class TrainOptions:
    """What `train` is told; the options of its help, in that order."""

    net: Annotated[
        Trainable,
        typer.Argument(
            help="A detector; clicks: the net behind --click click-net and --segmenter object-net;"
            " change: the one behind --detector siamese-lite."
        ),
    ]
    name: Annotated[
        str | None, typer.Option(help="Name of the training; default: the net's, or NET-truth.")
    ] = None
    from_ground_truth: Annotated[
        bool,
        typer.Option(
            "--from-ground-truth",
            help="Train one net per fold on the stored masks, and run the pipeline with them.",
        ),
    ] = False
    by: Annotated[
        FoldKind | None, typer.Option(help="Ground truth: what a fold holds out.  [workspace]")
    ] = None
    parts: Annotated[
        int | None, typer.Option(help="Ground truth: folds of --by same-split.  [5]")
    ] = None
    warped_by: Annotated[
        str | None,
        typer.Option(help="Ground truth: run that aligned the pairs; default: the newest."),
    ] = None
    state: Annotated[
        list[str] | None,
        typer.Option(help="Ground truth: only pairs in this review state; repeatable."),
    ] = None
    synthetic_share: Annotated[
        float | None,
        typer.Option(
            help="Ground truth: share of synthetic pairs in the training.  [0.5]", min=0, max=0.99
        ),
    ] = None
    start: Annotated[
        Path | None,
        typer.Option(
            help="Checkpoint of the same net to start from; clicks, change: also the word shipped."
        ),
    ] = None
    split: Annotated[
        list[str] | None,
        typer.Option(
            "--split",
            "--splits",
            help="Splits the detector is for, cs1,cs2 or repeated; default: all.",
        ),
    ] = None
    train_on: TrainOn = "same_split"
    backgrounds: Annotated[
        Path | None,
        typer.Option(
            help="clicks, change: folder of photographs in place of the reference images."
        ),
    ] = None
    recipe: Annotated[
        RecipeName,
        typer.Option(
            help="paper: one COCO object per pair and no other difference, an ImageNet backbone, no"
            " gradient limit, CSCDNet's last weights of 40,000 while the rate falls over 50,000."
        ),
    ] = "default"
    width: Annotated[float, typer.Option(help="Factor on channels; 1 is the paper's net.")] = 1.0
    iterations: Annotated[
        int | None, typer.Option(help="Default: the paper's, or the recipe's.", min=1)
    ] = None
    epochs: Annotated[
        int | None,
        typer.Option(
            help="Instead of --iterations: how often each reference image is used.", min=1
        ),
    ] = None
    batch: Annotated[
        int | None, typer.Option(help="Default: the paper's, or the recipe's.", min=2)
    ] = None
    lr: Annotated[float | None, typer.Option(help="Default: the paper's, or the recipe's.")] = None
    crop: Annotated[int, typer.Option(help="Side of the training squares, pixels.")] = 256
    class_weight: Annotated[
        float, typer.Option(help="Weight of changed pixels in the loss; unchanged ones have 1.")
    ] = 1.0
    backbone_weights: Annotated[
        str,
        typer.Option(
            help="ResNet-18 file, torchvision or timm naming; change: EfficientNet-Lite0; or none."
        ),
    ] = "none"
    preprocessing: Annotated[
        Preprocessing, typer.Option(help="How pixel values are normalised.")
    ] = "bgr_128"
    level: Annotated[
        int | None, typer.Option(help="cscdnet-attention: level of the mask, 2 to 5.")
    ] = None
    strength: Annotated[float | None, typer.Option(help="cscdnet-attention: lambda, 0 to 1.")] = (
        None
    )
    source: Annotated[
        str | None, typer.Option(help="cscdnet-attention: descriptor-energy, texture-energy.")
    ] = None
    window: Annotated[int | None, typer.Option(help="tanet: side of its window.")] = None
    clip_norm: Annotated[
        float | None, typer.Option(help="Largest gradient norm; 0 = any.  [5]")
    ] = None
    precision: Annotated[Precision, typer.Option(help="Precision of the arithmetic.")] = "auto"
    validate_every: Annotated[
        int, typer.Option(help="Iterations between two checkpoints.", min=1)
    ] = 500
    validation_pairs: Annotated[
        int, typer.Option(help="Synthetic pairs per validation.", min=1)
    ] = 64
    coco: Coco = None
    images: CocoImages = None
    category: Category = None
    least_area: LeastArea = 400
    synthesis: Synthesis = None
    seed: Seed = 0
    workers: Annotated[
        int, typer.Option(help="Processes that make pairs; 0 = only this one.", min=0)
    ] = 0
    db: Database = DEFAULT_DB
