"""`train`: detectors fitted to synthetic pairs of reference images, or to ground truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from reviewer.cli.options import TERMINAL, app, open_store
from reviewer.cli.pipeline import print_run
from reviewer.cli.records import options_of
from reviewer.cli.small_training import train_small
from reviewer.cli.synthesis import open_bank, read_synthesis
from reviewer.cli.train_options import TrainOptions
from reviewer.errors import InvalidInput

if TYPE_CHECKING:
    from reviewer.flows.training import TrainingOrder
    from reviewer.store.database import Store
    from reviewer.synthesis.bank import Bank


@app.command()
@options_of(TrainOptions)
def train(given: TrainOptions) -> None:
    """Train a net on synthetic pairs, a detector also on ground truth; the same command resumes."""
    if given.net == "clicks" or given.net == "change":
        train_small(given, given.net)
        return
    _refuse({"--backgrounds": given.backgrounds}, f"is for clicks and change, not for {given.net}")
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
    typer.echo(f"next: reviewer run --detector {given.net}:{best}")


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
    followed = make_recipe(given.recipe, given.net, training, read_synthesis(given.synthesis))
    backbone = None if given.backbone_weights == "none" else Path(given.backbone_weights)
    if given.recipe == "paper":
        _refuse({"--from-ground-truth": given.from_ground_truth}, "is no part of --recipe paper")
        check_paper(backbone, given.coco)
        for what, (here, there) in followed.differences().items():
            typer.echo(f"recipe paper, {what}: {here} (default {there})")
    if backbone is None and given.start is None:
        typer.echo("encoders start from random weights (--backbone-weights takes a ResNet-18)")
    plain = f"{given.net}-truth" if given.from_ground_truth else given.net
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
        store.folder, given.coco, given.images, given.category, given.least_area, given.seed
    )


def _refuse(given: Mapping[str, object], why: str) -> None:
    for option, value in given.items():
        if value:
            raise InvalidInput(f"{option}: {why}")
