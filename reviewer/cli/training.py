"""`train`: detectors fitted to synthetic pairs of reference images, or to ground truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from reviewer.cli.options import DEFAULT_DB, TERMINAL, Database, app, open_store
from reviewer.cli.pipeline import print_run
from reviewer.cli.records import options_of
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
from reviewer.words import FoldKind, Precision, Preprocessing, RecipeName, TrainedNet

if TYPE_CHECKING:
    from reviewer.flows.training import TrainingOrder
    from reviewer.store.database import Store
    from reviewer.synthesis.bank import Bank


@dataclass(frozen=True)
class TrainOptions:
    """What `train` is told; the options of its help, in that order."""

    detector: Annotated[TrainedNet, typer.Argument(help="Which net.")]
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
        Path | None, typer.Option(help="Checkpoint of the same net to start from.")
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
    recipe: Annotated[
        RecipeName,
        typer.Option(
            help="paper: one COCO object per pair and no other difference, an ImageNet backbone, no"
            " gradient limit, CSCDNet's last weights of 40,000 while the rate falls over 50,000."
        ),
    ] = "default"
    width: Annotated[float, typer.Option(help="Factor on channels; 1 is the paper's net.")] = 1.0
    iterations: Annotated[int | None, typer.Option(help="Default: the paper's.", min=1)] = None
    epochs: Annotated[
        int | None,
        typer.Option(
            help="Instead of --iterations: how often each reference image is used.", min=1
        ),
    ] = None
    batch: Annotated[int | None, typer.Option(help="Default: the paper's.", min=2)] = None
    lr: Annotated[float | None, typer.Option(help="Default: the paper's.")] = None
    crop: Annotated[int, typer.Option(help="Side of the training squares, pixels.")] = 256
    class_weight: Annotated[
        float, typer.Option(help="Weight of changed pixels in the loss; unchanged ones have 1.")
    ] = 1.0
    backbone_weights: Annotated[
        str, typer.Option(help="ResNet-18 file, torchvision or timm naming; or none.")
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


@app.command()
@options_of(TrainOptions)
def train(given: TrainOptions) -> None:
    """Train a detector on synthetic pairs, or on ground truth; the same command resumes."""
    order = _read_order(given)
    if given.epochs:
        _refuse({"--iterations": given.iterations}, "and --epochs say the same; give one of them")
    if given.from_ground_truth:
        _train_on_truth(given, order)
    else:
        _train_on_synthesis(given, order)


def _train_on_synthesis(given: TrainOptions, order: TrainingOrder) -> None:
    from reviewer.flows.training import train_on_synthesis

    labelled = {
        "--by": given.by,
        "--parts": given.parts,
        "--warped-by": given.warped_by,
        "--state": given.state,
        "--synthetic-share": given.synthetic_share,
    }
    _refuse(labelled, "belongs to --from-ground-truth, which is not given")
    with open_store(given.db) as store:
        done = train_on_synthesis(store, order, given.train_on, _opener(store, given), TERMINAL)
        best = order.folder(store) / order.recipe.weights
    typer.echo(
        f"{order.title}: {done.iteration} iterations; best F on synthetic validation"
        f" {done.best_f:.4f} at iteration {done.best_iteration}"
    )
    typer.echo(f"next: reviewer run --detector {given.detector}:{best}")


def _train_on_truth(given: TrainOptions, order: TrainingOrder) -> None:
    from reviewer.flows.training import Folding, train_on_truth

    share = 0.5 if given.synthetic_share is None else given.synthetic_share
    if not share:
        pasted = {
            "--coco": given.coco,
            "--images": given.images,
            "--category": given.category,
            "--synthesis": given.synthesis,
        }
        _refuse(pasted, "is about synthetic pairs, of which --synthetic-share 0 shows none")
    _refuse(
        {"--epochs": given.epochs},
        "counts reference images; with --from-ground-truth, --iterations",
    )
    folding = Folding(
        given.by or "workspace",
        given.parts or 5,
        given.warped_by,
        tuple(given.state or ()),
        share,
    )
    with open_store(given.db) as store:
        report = train_on_truth(store, order, folding, _opener(store, given), TERMINAL)
    print_run(report)
    typer.echo(f"next: reviewer evaluate --run {order.title}; reviewer evaluate --table-a")


def _read_order(given: TrainOptions) -> TrainingOrder:
    from reviewer.flows.training import TrainingOrder
    from reviewer.store.runs import clean_run_name
    from reviewer.training.recipes import check_paper, make_recipe

    numbers = {
        "iterations": given.iterations,
        "batch": given.batch,
        "lr": given.lr,
        "clip_norm": given.clip_norm,
    }
    of_net = {
        "level": given.level,
        "strength": given.strength,
        "source": given.source,
        "window": given.window,
    }
    training = {
        "width": given.width,
        "net_settings": {key: value for key, value in of_net.items() if value is not None},
        "crop_px": given.crop,
        "class_weights": (1.0, given.class_weight),
        "preprocessing": given.preprocessing,
        "precision": given.precision,
        "validate_every": given.validate_every,
        "validation_pairs": given.validation_pairs,
        "seed": given.seed,
        **{key: value for key, value in numbers.items() if value is not None},
    }
    followed = make_recipe(given.recipe, given.detector, training, read_synthesis(given.synthesis))
    backbone = None if given.backbone_weights == "none" else Path(given.backbone_weights)
    if given.recipe == "paper":
        _refuse({"--from-ground-truth": given.from_ground_truth}, "is no part of --recipe paper")
        check_paper(backbone, given.coco)
        for what, (here, there) in followed.differences().items():
            typer.echo(f"recipe paper, {what}: {here} (default {there})")
    if backbone is None and given.start is None:
        typer.echo("encoders start from random weights (--backbone-weights takes a ResNet-18)")
    plain = f"{given.detector}-truth" if given.from_ground_truth else given.detector
    return TrainingOrder(
        clean_run_name(given.name or plain),
        followed,
        tuple(each for text in given.split or [] for each in text.split(",")),
        backbone,
        given.start,
        given.workers,
        given.epochs,
    )


def _opener(store: Store, given: TrainOptions) -> Callable[[], Bank]:
    return lambda: open_bank(
        store, given.coco, given.images, given.category, given.least_area, given.seed
    )


def _refuse(given: Mapping[str, object], why: str) -> None:
    for option, value in given.items():
        if value:
            raise InvalidInput(f"{option}: {why}")
