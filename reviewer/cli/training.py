"""`train`: detectors fitted to synthetic pairs of reference images, or to ground truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from reviewer.cli.options import DEFAULT_DB, TERMINAL, Database, app, open_store
from reviewer.cli.pipeline import print_run
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
from reviewer.words import FoldKind, NetName, Precision, Preprocessing, RecipeName, TrainedOn

if TYPE_CHECKING:
    from reviewer.flows.training import Folding, TrainingOrder
    from reviewer.store.database import Store
    from reviewer.synthesis.bank import Bank


@app.command()
def train(
    detector: Annotated[NetName, typer.Argument(help="Which net.")],
    name: Annotated[
        str | None, typer.Option(help="Name of the training; default: the net's, or NET-truth.")
    ] = None,
    from_ground_truth: Annotated[
        bool,
        typer.Option(
            "--from-ground-truth",
            help="Train one net per fold on the stored masks, and run the pipeline with them.",
        ),
    ] = False,
    by: Annotated[
        FoldKind | None, typer.Option(help="Ground truth: what a fold holds out.  [workspace]")
    ] = None,
    parts: Annotated[
        int | None, typer.Option(help="Ground truth: folds of --by same-split.  [5]")
    ] = None,
    warped_by: Annotated[
        str | None,
        typer.Option(help="Ground truth: run that aligned the pairs; default: the newest."),
    ] = None,
    state: Annotated[
        list[str] | None,
        typer.Option(help="Ground truth: only pairs in this review state; repeatable."),
    ] = None,
    synthetic_share: Annotated[
        float | None,
        typer.Option(
            help="Ground truth: share of synthetic pairs in the training.  [0.5]", min=0, max=0.99
        ),
    ] = None,
    start: Annotated[
        Path | None, typer.Option(help="Checkpoint of the same net to start from.")
    ] = None,
    split: Annotated[
        list[str] | None,
        typer.Option(
            "--split",
            "--splits",
            help="Splits the detector is for, cs1,cs2 or repeated; default: all.",
        ),
    ] = None,
    train_on: TrainOn = "same_split",
    recipe: Annotated[
        RecipeName,
        typer.Option(
            help="paper: one COCO object per pair and no other difference, an ImageNet backbone, no"
            " gradient limit, CSCDNet's last weights of 40,000 while the rate falls over 50,000."
        ),
    ] = "default",
    width: Annotated[float, typer.Option(help="Factor on channels; 1 is the paper's net.")] = 1.0,
    iterations: Annotated[int | None, typer.Option(help="Default: the paper's.", min=1)] = None,
    epochs: Annotated[
        int | None,
        typer.Option(
            help="Instead of --iterations: how often each reference image is used.", min=1
        ),
    ] = None,
    batch: Annotated[int | None, typer.Option(help="Default: the paper's.", min=2)] = None,
    lr: Annotated[float | None, typer.Option(help="Default: the paper's.")] = None,
    crop: Annotated[int, typer.Option(help="Side of the training squares, pixels.")] = 256,
    class_weight: Annotated[
        float, typer.Option(help="Weight of changed pixels in the loss; unchanged ones have 1.")
    ] = 1.0,
    backbone_weights: Annotated[
        str, typer.Option(help="ResNet-18 file, torchvision or timm naming; or none.")
    ] = "none",
    preprocessing: Annotated[
        Preprocessing, typer.Option(help="How pixel values are normalised.")
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
    precision: Annotated[Precision, typer.Option(help="Precision of the arithmetic.")] = "auto",
    validate_every: Annotated[
        int, typer.Option(help="Iterations between two checkpoints.", min=1)
    ] = 500,
    validation_pairs: Annotated[
        int, typer.Option(help="Synthetic pairs per validation.", min=1)
    ] = 64,
    coco: Coco = None,
    images: CocoImages = None,
    category: Category = None,
    least_area: LeastArea = 400,
    synthesis: Synthesis = None,
    seed: Seed = 0,
    workers: Annotated[
        int, typer.Option(help="Processes that make pairs; 0 = only this one.", min=0)
    ] = 0,
    db: Database = DEFAULT_DB,
) -> None:
    """Train a detector on synthetic pairs, or on ground truth; the same command resumes."""
    from reviewer.flows.training import Folding
    from reviewer.store.runs import clean_run_name
    from reviewer.training.recipes import check_paper

    given = {"iterations": iterations, "batch": batch, "lr": lr, "clip_norm": clip_norm}
    of_net = {"level": level, "strength": strength, "source": source, "window": window}
    options = Options(
        detector,
        clean_run_name(name or (f"{detector}-truth" if from_ground_truth else detector)),
        recipe,
        {
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
        },
        read_synthesis(synthesis),
        tuple(each for text in split or [] for each in text.split(",")),
        None if backbone_weights == "none" else Path(backbone_weights),
        start,
        workers,
        epochs,
        lambda store: open_bank(store, coco, images, category, least_area, seed),
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
    if recipe == "paper":
        _refuse({"--from-ground-truth": from_ground_truth}, "is no part of --recipe paper")
        check_paper(options.backbone, coco)
    if epochs:
        _refuse({"--iterations": iterations}, "and --epochs say the same; give one of them")
    if not from_ground_truth:
        _refuse(labelled, "belongs to --from-ground-truth, which is not given")
        _train_on_synthesis(options, train_on, db)
        return
    if not share:
        _refuse(pasted, "is about synthetic pairs, of which --synthetic-share 0 shows none")
    _refuse({"--epochs": epochs}, "counts reference images; with --from-ground-truth, --iterations")
    folding = Folding(by or "workspace", parts or 5, warped_by, tuple(state or ()), share)
    _train_on_truth(options, folding, db)


@dataclass(frozen=True, slots=True)
class Options:
    """What both ways to train read from the command line."""

    detector: NetName
    title: str
    recipe: RecipeName
    training: dict[str, Any]
    synthesis: dict[str, Any]
    splits: tuple[str, ...]
    backbone: Path | None
    start: Path | None
    workers: int
    epochs: int | None
    open_bank: Callable[[Store], Bank]

    def order(self) -> TrainingOrder:
        """Return what is to be trained, and say where it is not what people might expect."""
        from reviewer.flows.training import TrainingOrder
        from reviewer.training.recipes import make_recipe

        recipe = make_recipe(self.recipe, self.detector, self.training, self.synthesis)
        if recipe.name == "paper":
            for what, (here, there) in recipe.differences().items():
                typer.echo(f"recipe paper, {what}: {here} (default {there})")
        if self.backbone is None and self.start is None:
            typer.echo("encoders start from random weights (--backbone-weights takes a ResNet-18)")
        return TrainingOrder(
            self.title, recipe, self.splits, self.backbone, self.start, self.workers, self.epochs
        )


def _train_on_synthesis(options: Options, train_on: TrainedOn, db: Path) -> None:
    from reviewer.flows.training import train_on_synthesis

    order = options.order()
    with open_store(db) as store:
        done = train_on_synthesis(
            store, order, train_on, lambda: options.open_bank(store), TERMINAL
        )
        best = order.folder(store) / order.recipe.weights
    typer.echo(
        f"{order.title}: {done.iteration} iterations; best F on synthetic validation"
        f" {done.best_f:.4f} at iteration {done.best_iteration}"
    )
    typer.echo(f"next: reviewer run --detector {options.detector}:{best}")


def _train_on_truth(options: Options, folding: Folding, db: Path) -> None:
    from reviewer.flows.training import train_on_truth

    order = options.order()
    with open_store(db) as store:
        report = train_on_truth(store, order, folding, lambda: options.open_bank(store), TERMINAL)
    print_run(report)
    typer.echo(f"next: reviewer evaluate --run {order.title}; reviewer evaluate --table-a")


def _refuse(given: Mapping[str, object], why: str) -> None:
    for option, value in given.items():
        if value:
            raise InvalidInput(f"{option}: {why}")
