"""`train`: detectors fitted to synthetic pairs of reference images, or to ground truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from reviewer.cli.exporting import FoldName
from reviewer.cli.options import DEFAULT_DB, Database, app, open_store, progress_bar
from reviewer.cli.pipeline import run_stages
from reviewer.cli.synthesis import (
    Category,
    Coco,
    CocoImages,
    LeastArea,
    Seed,
    Synthesis,
    TrainOn,
    TrainOnName,
    open_bank,
    read_synthesis,
)
from reviewer.errors import InvalidInput

if TYPE_CHECKING:
    from reviewer.store.database import Store
    from reviewer.synthesis.bank import Bank
    from reviewer.synthesis.settings import SynthesisSettings
    from reviewer.training.loop import Step
    from reviewer.training.session import TrainingData, Validated
    from reviewer.training.settings import TrainingSettings

DetectorName = Literal["cscdnet", "cscdnet-attention", "dr-tanet", "cdnet", "tanet"]
PreprocessingName = Literal["bgr_128", "imagenet"]
PrecisionName = Literal["auto", "float32", "bfloat16"]


@app.command()
def train(
    detector: Annotated[DetectorName, typer.Argument(help="Which net.")],
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
        FoldName | None, typer.Option(help="Ground truth: what a fold holds out.  [workspace]")
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
    width: Annotated[float, typer.Option(help="Factor on channels; 1 is the paper's net.")] = 1.0,
    iterations: Annotated[int | None, typer.Option(help="Else the paper's.", min=1)] = None,
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
        PreprocessingName, typer.Option(help="How pictures become numbers.")
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
    clip_norm: Annotated[float, typer.Option(help="Largest gradient norm; 0 = any.")] = 5.0,
    precision: Annotated[PrecisionName, typer.Option(help="Of the arithmetic.")] = "auto",
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
    from reviewer.training.settings import TrainingSettings

    given = {"iterations": iterations, "batch": batch, "lr": lr}
    of_net = {"level": level, "strength": strength, "source": source, "window": window}
    settings = TrainingSettings.of_paper(
        detector,
        width=width,
        net_settings={key: value for key, value in of_net.items() if value is not None},
        crop_px=crop,
        class_weights=(1.0, class_weight),
        preprocessing=preprocessing,
        clip_norm=clip_norm,
        precision=precision,
        validate_every=validate_every,
        validation_pairs=validation_pairs,
        seed=seed,
        **{key: value for key, value in given.items() if value is not None},
    )
    backbone = None if backbone_weights == "none" else Path(backbone_weights)
    if backbone is None and start is None:
        typer.echo("encoders start from random weights (--backbone-weights takes a ResNet-18)")
    order = Order(
        name or (f"{detector}-truth" if from_ground_truth else detector),
        settings,
        [each for text in split or [] for each in text.split(",")],
        backbone,
        start,
        workers,
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
    if from_ground_truth and not share:
        _refuse(pasted, "is about synthetic pairs, of which --synthetic-share 0 shows none")
    if not from_ground_truth:
        _refuse(labelled, "belongs to --from-ground-truth, which is not given")
    pasting = read_synthesis(synthesis)
    with open_store(db) as store:

        def bank() -> Bank:
            return open_bank(store, coco, images, category, least_area, seed)

        if from_ground_truth:
            folding = Folding(by or "workspace", parts or 5, warped_by, tuple(state or ()))
            _train_on_truth(store, order, folding, bank, pasting, share)
        else:
            _train_on_synthesis(store, order, train_on, bank, pasting)


@dataclass(frozen=True)
class Order:
    """What is to be trained, whatever on."""

    title: str
    settings: TrainingSettings
    splits: list[str]
    backbone: Path | None
    start: Path | None
    workers: int

    def folder(self, store: Store) -> Path:
        return store.folder / "trainings" / self.title


@dataclass(frozen=True)
class Folding:
    """Which ground truth is divided, and how."""

    by: FoldName
    parts: int
    warped_by: str | None
    states: tuple[str, ...]


def _refuse(given: Mapping[str, object], why: str) -> None:
    for option, value in given.items():
        if value:
            raise InvalidInput(f"{option}: {why}")


def _train_on_synthesis(
    store: Store,
    order: Order,
    train_on: TrainOnName,
    open_objects: Callable[[], Bank],
    pasting: SynthesisSettings,
) -> None:
    from reviewer.synthesis.shelf import Shelf
    from reviewer.training.selection import data_record, select_references
    from reviewer.training.session import train as fit
    from reviewer.training.stream import SyntheticData

    settings, folder = order.settings, order.folder(store)
    references = select_references(store, order.splits, train_on)
    bank = open_objects()
    record = {
        **data_record(references, bank, pasting),
        "splits": sorted(order.splits),
        "train_on": train_on,
    }
    data = SyntheticData(Shelf([image.path for image in references]), bank, pasting, record)
    with progress_bar(order.title) as bar:
        done = fit(
            folder,
            settings,
            data,
            backbone=order.backbone,
            start=order.start,
            workers=order.workers,
            on_step=lambda step: bar(step.iteration, settings.iterations, _speed(step)),
            on_validation=lambda at: _keep(store, order.title, folder, settings, data, at),
        )
    typer.echo(
        f"{order.title}: {done.iteration} iterations; best F on synthetic validation"
        f" {done.best_f:.4f} at iteration {done.best_iteration}"
    )
    typer.echo(f"next: reviewer run --detector {settings.net}:{folder / 'best.pt'}")


def _train_on_truth(
    store: Store,
    order: Order,
    folding: Folding,
    open_objects: Callable[[], Bank],
    synthesis: SynthesisSettings,
    share: float,
) -> None:
    """Fit a net a fold, then run the pipeline on what each found in the pairs it has not seen."""
    from dataclasses import replace

    from reviewer.crossfit.fitting import Reports, fit_folds
    from reviewer.crossfit.folds import Pasting, fold_data, write_truth
    from reviewer.export.folds import make_folds
    from reviewer.export.selection import Selection, select_labelled
    from reviewer.export.skipped import leave_out_skipped
    from reviewer.pipeline.runner import prepare_run
    from reviewer.pipeline.settings import IMPORTED, PipelineSettings
    from reviewer.store.runs import list_runs, run_or_newest
    from reviewer.store.skips import skipped_line

    settings, folder = order.settings, order.folder(store)
    names = [run.name for run in list_runs(store)]
    others = [name for name in names if name != order.title]
    warper = run_or_newest(store, folding.warped_by or (others[-1] if others else None))
    known = PipelineSettings.of_record(warper.settings)
    models = {stage: own for stage, own in known.model_settings.items() if stage != "detect"}
    found = replace(known, detector=IMPORTED, threshold=settings.threshold, model_settings=models)
    if order.title in names:
        prepare_run(store, order.title, found)  # another run of that name is told now, not then
    wanted = Selection(splits=tuple(order.splits), states=folding.states)
    selection = leave_out_skipped(store, wanted)
    labelled, without = select_labelled(store, selection)
    folds = make_folds(store, [item.pair for item in labelled], folding.by, folding.parts)
    files = write_truth(store, labelled, folder / "truth", selection, warper)
    pasting = Pasting(open_objects(), synthesis, share) if share else None
    folded = fold_data(folds, files, {"by": folding.by, "warped_by": warper.name}, pasting)
    typer.echo(
        f"{len(labelled)} pairs with ground truth ({len(without)} without), warped by"
        f" {warper.name}; folds by {folding.by}: {', '.join(fold.name for fold in folds)}"
    )
    if selection.skipped:
        typer.echo(f"left out: {skipped_line(len(selection.skipped))}")
    for fold in folds:
        past = [{pair.reference.sha256 for pair in pairs} for pairs in (fold.train, fold.test)]
        if past[0] & past[1]:
            typer.echo(
                f"fold {fold.name}: {len(past[0] & past[1])} of its reference images are trained on"
                " as well, with other live images"
            )
    with progress_bar(order.title) as bar:
        maps = fit_folds(
            store,
            folder,
            settings,
            folded,
            warper,
            Reports(
                step=lambda each, step: bar(
                    folded.index(each) * settings.iterations + step.iteration,
                    len(folded) * settings.iterations,
                    f"fold {each.fold.name}, {_speed(step)}",
                ),
                validated=lambda each, at: _keep(
                    store,
                    f"{order.title}/{each.fold.name}",
                    folder / each.fold.name,
                    settings,
                    each.data,
                    at,
                ),
            ),
            backbone=order.backbone,
            start=order.start,
            workers=order.workers,
        )
    judged = [pair.id for fold in folds for pair in fold.test]
    run_stages(
        store, order.title, found, "all", order.splits, 2, folders={"detect": maps}, only=judged
    )
    typer.echo(f"next: reviewer evaluate --run {order.title}; reviewer evaluate --table-a")


def _speed(step: Step) -> str:
    return f"loss {step.loss:.4f}, {step.pairs_per_s:.1f} pairs/s"


def _keep(
    store: Store,
    name: str,
    folder: Path,
    settings: TrainingSettings,
    data: TrainingData,
    at: Validated,
) -> None:
    """Say where a training stands, and bring the store's row of it up to date."""
    from reviewer.dataset.files import hash_file
    from reviewer.metrics import f_score
    from reviewer.store.trainings import StoredTraining, save_training

    typer.echo(
        f"{name}, iteration {at.iteration}: F {f_score(at.counts):.4f} on {data.kind} validation,"
        f" best {at.best_f:.4f} at {at.best_iteration}"
    )
    best, parts = folder / "best.pt", data.parts()
    save_training(
        store,
        StoredTraining(
            name,
            settings.net,
            best.relative_to(store.folder).as_posix(),
            hash_file(best),
            {"training": settings.record(), **parts},
            parts["data"]["sha256"],
            settings.seed,
            at.iteration,
            at.best_f,
        ),
    )
